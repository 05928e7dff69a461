"""What the page shows at one time, and how it comes out of what the on-line system tells."""

import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from forests.finder.floor import Floor
from forests.frames import Intrinsics
from pipelines.online.messages import (
    NS,
    CameraFrame,
    CameraPose,
    OrientationResult,
    Plan,
    TrackedPerson,
    TrackedPersons,
    TrackSkeleton,
)

LEVEL = Floor(np.array([0.0, -1.0, 0.0]), 0.0).T_floor_camera
"""(4, 4) float64, a camera of which nothing is known: it looks level, at the height 0."""
BELIEVED_NS = NS // 2
"""Skeletons and orientations are shown for so long [ns]."""
N_KEPT = 300
"""Moments of a live source that one can go back to."""


class Labels(NamedTuple):
    """What the pixels show.

    Attributes:
        codes: (height, width) uint8.
        colours: (n_codes, 3) uint8 red, green, blue by code.
    """

    codes: NDArray[np.uint8]
    colours: NDArray[np.uint8]


class Arrow(NamedTuple):
    """Which way a body faces, or a head looks.

    Attributes:
        track_id: Whose.
        region: body or head.
        direction: (2,) float64 on the floor, of length 1.
    """

    track_id: int
    region: str
    direction: NDArray[np.float64]


@dataclass(frozen=True)
class Moment:
    """What is shown at one time. All places are in one frame of reference, whose plane z = 0 is the floor.

    Attributes:
        words: What it is, in a line.
        depth: (height, width) uint16 [mm], 0 = nothing; None = no image is known.
        camera: Intrinsics of the image.
        T_floor_camera: (4, 4) float64, the camera.
        labels: What the pixels are, by what the labels are called.
        persons: Everybody.
        skeletons: Their joints; several of a person, if several models were asked.
        arrows: Which way they face.
        plan: Whom the planner chose; None = there was no planner.
    """

    words: str
    depth: NDArray[np.uint16] | None
    camera: Intrinsics
    T_floor_camera: NDArray[np.float64]
    labels: Mapping[str, Labels] = field(default_factory=dict)
    persons: tuple[TrackedPerson, ...] = ()
    skeletons: tuple[TrackSkeleton, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    plan: Plan | None = None

    @property
    def frame(self) -> CameraFrame | None:
        """The image as the on-line system knows it."""
        return None if self.depth is None else CameraFrame(0, "camera", self.depth, self.camera)


class Show(Protocol):
    """Moments in order of time; those of a live source grow in number."""

    @property
    def fps(self) -> float:
        """Moments a second."""
        ...

    def __len__(self) -> int:
        """How many there are."""
        ...

    def moment(self, number: int) -> Moment:
        """One of them, counted from 0.

        Raises:
            UserError: It cannot be read.
        """
        ...

    def close(self) -> None:
        """Closes what is open."""
        ...


def standing(track_id: int, place: NDArray[np.floating], height: float) -> TrackedPerson:
    """Somebody of whom place (2,) and height [m] are known, and nothing about how they move."""
    at = np.asarray(place, np.float64)
    return TrackedPerson(track_id, at, np.zeros(2), np.zeros((4, 4)), height, 1.0, 0.0, 0.0, None)


class Gathering:
    """Puts messages of the on-line system together to the moment that they are about."""

    def __init__(self) -> None:
        self._frame: CameraFrame | None = None
        self._pose: CameraPose | None = None
        self._told: TrackedPersons | None = None
        self._plan: Plan | None = None
        self._skeletons: dict[tuple[int, str], TrackSkeleton] = {}
        self._facing: dict[tuple[int, str], tuple[int, Arrow]] = {}

    def take(self, message: object) -> None:
        """Takes a message."""
        if isinstance(message, CameraFrame):
            self._frame = message
        elif isinstance(message, CameraPose):
            self._pose = message
        elif isinstance(message, TrackedPersons):
            self._told = message
        elif isinstance(message, Plan):
            self._plan = message
        elif isinstance(message, TrackSkeleton):
            self._skeletons[message.track_id, message.module] = message
        elif isinstance(message, OrientationResult) and self._pose is not None:
            arrow = Arrow(
                message.track_id, message.region, heading_of_camera(message.angle, self._pose.T_floor_camera)
            )
            self._facing[message.track_id, message.module] = message.stamp, arrow

    def moment(self) -> Moment | None:
        """What is known by now about the last image; None before the first."""
        frame, pose, told = self._frame, self._pose, self._told
        if frame is None or pose is None or pose.stamp != frame.stamp:
            return None
        persons = () if told is None or told.stamp != frame.stamp else told.persons
        known = {one.track_id for one in persons}
        self._skeletons = {
            key: one
            for key, one in self._skeletons.items()
            if key[0] in known and 0 <= frame.stamp - one.stamp <= BELIEVED_NS
        }
        self._facing = {
            key: (stamp, arrow)
            for key, (stamp, arrow) in self._facing.items()
            if key[0] in known and 0 <= frame.stamp - stamp <= BELIEVED_NS
        }
        return Moment(
            f"{frame.stamp / NS:.2f} s",
            frame.depth,
            frame.camera,
            pose.T_floor_camera,
            {},
            persons,
            tuple(self._skeletons.values()),
            tuple(arrow for _, arrow in self._facing.values()),
            self._plan if self._plan is not None and self._plan.stamp == frame.stamp else None,
        )


def heading_of_camera(angle: float, T_floor_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2,) float64 of length 1 on the floor: a heading about the camera's y axis, 0 = towards the camera [rad]."""
    ahead = T_floor_camera[:3, :3] @ np.array([np.sin(angle), 0.0, -np.cos(angle)])
    return np.asarray(ahead[:2] / max(float(np.hypot(ahead[0], ahead[1])), 1e-9), np.float64)


class LiveShow:
    """The last moments of a system that runs; `bus.subscribe(object, show.take)`.

    Attributes:
        fps: Moments a second, as fast as a page is drawn when it plays them again.
    """

    def __init__(self, fps: float = 30.0) -> None:
        self.fps = fps
        self._gathering = Gathering()
        self._moments: deque[Moment] = deque(maxlen=N_KEPT)
        self._lock = threading.Lock()
        self._is_new = True

    def take(self, message: object) -> None:
        """Takes a message; what comes later about the last image completes its moment."""
        with self._lock:
            self._gathering.take(message)
            if isinstance(message, CameraFrame):
                self._is_new = True
            elif isinstance(message, Plan | TrackSkeleton | OrientationResult):
                self._update()

    def _update(self) -> None:
        moment = self._gathering.moment()
        if moment is None:
            return
        if self._is_new:
            self._moments.append(moment)
            self._is_new = False
        else:
            # The image may be one that its source writes over.
            self._moments[-1] = replace(moment, depth=self._moments[-1].depth)

    def __len__(self) -> int:
        """How many are kept."""
        return len(self._moments)

    def moment(self, number: int) -> Moment:
        """One of those that are kept, the oldest first."""
        with self._lock:
            return self._moments[min(number, len(self._moments) - 1)]

    def close(self) -> None:
        """Does nothing."""
