"""The whole: images in, and on the bus everybody who is followed, whom the planner chose, and what modules found."""

import time
from collections import OrderedDict
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from forests.frames import check_depth
from pipelines.online.book import TrackBook
from pipelines.online.bus import Bus
from pipelines.online.costs import Costs
from pipelines.online.detecting import Detector, Seen
from pipelines.online.given import placed
from pipelines.online.messages import NS, CameraFrame, CameraPose, Notice, Plan, TrackedPersons
from pipelines.online.modules.jobs import Job, Modules, Told
from pipelines.online.planner import ModuleStates, PlannerSettings, decide, plan_of
from pipelines.online.tracker import Tracker, TrackerSettings

REPLAYED_NS = NS
"""Time that jumps back farther begins anew; images that are only late are left out [ns]."""
N_POSES = 300
"""Images whose poses are kept for answers that are still to come."""


@dataclass(frozen=True)
class SystemSettings:
    """How the parts work.

    Attributes:
        tracker: How people are followed.
        planner: How they are chosen.
    """

    tracker: TrackerSettings = field(default_factory=TrackerSettings)
    planner: PlannerSettings = field(default_factory=PlannerSettings)


class OnlineSystem:
    """Finds, follows and analyses people in the images of one camera.

    Attributes:
        bus: Where everything is told.
        settings: How the parts work.
    """

    def __init__(
        self,
        detector: Detector,
        modules: Modules,
        settings: SystemSettings | None = None,
        bus: Bus | None = None,
    ) -> None:
        self.bus = bus or Bus()
        self.settings = settings or SystemSettings()
        self._detector, self._modules = detector, modules
        self._names = tuple(one.name for one in modules.settings)
        self._costs = Costs({one.name: one.cost_s for one in modules.settings})
        self._tracker, self._book = Tracker(self.settings.tracker), TrackBook()
        self._poses: OrderedDict[int, tuple[NDArray[np.float64], str]] = OrderedDict()
        self._stamp: int | None = None
        self._credit_s = 0.0

    def step(self, frame: CameraFrame, tracks: TrackedPersons | None = None) -> None:
        """Takes an image. What is wrong with it is told in a `Notice`, and the system goes on with the next.

        Args:
            frame: The image.
            tracks: Of another tracker, of the same time, which are then taken instead of own ones.
        """
        fault = self._fault(frame)
        if fault is not None:
            self.bus.publish(fault)
            return
        self._stamp = frame.stamp
        self.bus.publish(frame)
        seen = self._detector.detect(frame)
        if seen.is_moved:
            kind = "the camera moved without its pose being told"
            self.bus.publish(Notice(kind, f"{kind}, or the floor was lost: all tracks end and begin anew"))
            self._restart()
        floor = seen.detections.frame_id if tracks is None else tracks.frame_id
        self.bus.publish(CameraPose(frame.stamp, floor, frame.frame_id, seen.T_floor_camera))
        self.bus.publish(seen.detections)
        if tracks is None:
            persons = self._tracker.update(seen.detections)
        else:
            persons = placed(tracks, frame, seen.T_floor_camera)
        self._book.turn(persons)
        self.bus.publish(persons)
        self._poses[frame.stamp] = seen.T_floor_camera, persons.frame_id
        if len(self._poses) > N_POSES:
            self._poses.popitem(last=False)
        plan = self._plan(persons, seen.T_floor_camera)
        self.bus.publish(plan)
        self._submit(frame, seen, plan)
        self.collect()

    def collect(self, timeout_s: float = 0.0) -> None:
        """Takes what modules have said; waits for the first word, but not longer than told."""
        self._take(self._modules.collect(timeout_s))

    def finish(self, timeout_s: float = 10.0) -> None:
        """Waits for the answers that are still to come, but not longer than told."""
        end = time.monotonic() + timeout_s
        while self._modules.is_busy() and (left := end - time.monotonic()) > 0:
            self.collect(min(left, 0.1))
        self.collect()

    def _fault(self, frame: CameraFrame) -> Notice | None:
        """What is wrong with an image; time that jumps back far begins anew."""
        try:
            check_depth(frame.depth)
        except ValueError as error:
            return Notice("unusable images", f"an image is left out: {error}")
        camera = np.array([frame.camera.fx, frame.camera.fy, frame.camera.cx, frame.camera.cy])
        if not (np.isfinite(camera).all() and (camera[:2] > 0).all()):
            return Notice("unusable cameras", f"an image is left out: its intrinsics are {camera.tolist()}")
        pose = frame.T_world_camera
        if pose is not None and not (np.isfinite(pose).all() and abs(pose[2, 2]) < 0.999):
            return Notice(
                "unusable poses", "an image is left out: its camera's pose is not finite or looks straight down"
            )
        if self._stamp is not None and frame.stamp <= self._stamp:
            back_s = (self._stamp - frame.stamp) / NS
            if self._stamp - frame.stamp <= REPLAYED_NS:
                return Notice("late images", f"an image is left out: it is {back_s:.3f} s older than the last")
            kind = "time ran backwards"
            self.bus.publish(Notice(kind, f"{kind} by {back_s:.3f} s: all tracks end and begin anew"))
            self._restart()
        return None

    def _restart(self) -> None:
        self._tracker.restart()
        self._book.clear()
        self._poses.clear()
        self._credit_s = 0.0

    def _plan(self, persons: TrackedPersons, T_floor_camera: NDArray[np.float64]) -> Plan:
        settings, modules = self.settings.planner, self._modules.settings
        states = ModuleStates(
            np.array([self._costs[name] for name in self._names], np.float64),
            np.array([one.interval_s for one in modules], np.float64),
            np.array([one.reach_m for one in modules], np.float64),
            np.array([one.weight for one in modules], np.float64),
            np.array([self._modules.is_up(name) for name in self._names], bool),
        )
        tracks = self._book.states(persons, T_floor_camera, self._names)
        allowed = settings.budget_s + self._credit_s
        decision = decide(tracks, states, settings, self._credit_s)
        self._credit_s = decision.credit_s
        return plan_of(persons.stamp, decision, persons.persons, self._names, allowed)

    def _submit(self, frame: CameraFrame, seen: Seen, plan: Plan) -> None:
        axes = np.array([one.axis for one in seen.detections.people], np.float64).reshape(-1, 3)
        jobs = {}
        sound = [request for request in plan.requests if _is_box(request.box) and _is_box(request.upper_body)]
        if len(sound) < len(plan.requests):
            self.bus.publish(
                Notice("empty boxes", "a person's box is empty, so that no module is asked about them")
            )
        for name in self._names:
            requests = tuple(request for request in sound if request.module == name)
            if requests:
                jobs[name] = Job(frame.stamp, frame.frame_id, frame.camera, seen.floor, axes, requests)
        self._modules.submit(frame, jobs)

    def _take(self, told: Told) -> None:
        for notice in told.notices:
            self.bus.publish(notice)
        for result in told.results:
            self._costs.learn(result)
            pose = self._poses.get(result.stamp)
            if pose is None:
                self.bus.publish(Notice("answers of other times", "an answer came long after its image"))
                continue
            taken = self._book.take(result, *pose)
            if isinstance(taken, Notice):
                self.bus.publish(taken)
                continue
            self.bus.publish(result)
            if taken is not None:
                self.bus.publish(taken)


def _is_box(box: Box) -> bool:
    """Whether a box has an inside."""
    return bool(np.isfinite(box).all()) and box[0] < box[2] and box[1] < box[3]
