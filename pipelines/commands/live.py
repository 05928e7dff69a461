"""undergrowth live: people followed over time in depth images, and analysed as a planner chooses."""

import itertools
import logging
import math
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from forests.finder.floor import FloorPrior
from pipelines.errors import UserError
from pipelines.online.detecting import PersonDetector
from pipelines.online.messages import CameraFrame, Notice
from pipelines.online.modules.inline import InlineModules
from pipelines.online.modules.jobs import Modules, ModuleSettings
from pipelines.online.modules.processes import ProcessModules
from pipelines.online.notices import Notices
from pipelines.online.planner import PlannerSettings
from pipelines.online.statistics import Statistics
from pipelines.online.system import OnlineSystem, SystemSettings
from pipelines.online.tracker import TrackerSettings
from pipelines.online.wires.wire import Wire
from pipelines.playing.live import is_live_source, open_live_source
from pipelines.playing.pace import paced
from pipelines.playing.sources import PlayOptions, Source, open_source
from pipelines.recordings.plain import GivenCamera
from pipelines.settings import defaults_from

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class LiveSettings:
    """Follows everybody in depth images, and has modules analyse whom a planner chooses.

    Attributes:
        source: A corpus of whole scenes (rooms, clips), a recording of ROS 1 or 2 (.bag, .mcap, .db3 or a folder), a
            folder of depth files; or what runs: ros1:/TOPIC, ros2:/TOPIC, usb:, usb:realsense, usb:openni.
        config: TOML file with defaults for all other settings.
        walks: A random walk forest: finds nine joints of the upper body.
        skeleton: A regression forest: finds the whole skeleton.
        orientation: An exported orientation net (.onnx) of bodies: which way they face, and their posture.
        head: An exported orientation net (.onnx) of heads: where they look.
        record: MCAP file to write, with everything that was told.
        camera_name: Name of the camera in the topics of the recording.
        view: Serve a page that shows everything, on this port of this machine; 0 = none.
        realtime: Play images at the speed at which they were taken, and leave out those that come too late. Without,
            every image waits for all answers about the last.
        processes: Run each module in a process of its own. Without, all run one after the other.
        frames: Play so many images at most; 0 = all.
        loops: Play the source so many times.
        fps: Images a second of sources that have no stamps.
        sensor: Name of a sensor model whose noise is added to the depth of generated frames.
        camera: Camera preset of depth files that no layout describes.
        intrinsics: fx fy cx cy of the images [px], instead of a preset or of a recording's CameraInfo.
        layout: Name of a known layout of depth files, or a .toml file.
        topic: Topic of the depth images of a recording.
        knows_pose: Take the pose of the camera where the source tells it; the world's plane z = 0 must be the floor.
        pitch: Angle of the camera's axis below the horizon, if it is known and its pose is not told [rad].
        height: Height of the camera above the floor, likewise [m].
        tracker: How people are followed.
        planner: How they are chosen.
    """

    source: Annotated[Path, tyro.conf.Positional]
    config: Path | None = None
    walks: Path | None = None
    skeleton: Path | None = None
    orientation: Path | None = None
    head: Path | None = None
    record: Path | None = None
    camera_name: str = "rgbd_front_top"
    view: int = 0
    realtime: bool = False
    processes: bool = True
    frames: int = 0
    loops: int = 1
    fps: float = 30.0
    sensor: str | None = None
    camera: str | None = None
    intrinsics: tuple[float, float, float, float] | None = None
    layout: str | None = None
    topic: str | None = None
    knows_pose: bool = True
    pitch: float | None = None
    height: float | None = None
    tracker: TrackerSettings = field(default_factory=TrackerSettings)
    planner: PlannerSettings = field(default_factory=PlannerSettings)

    def __post_init__(self) -> None:
        if not (self.frames >= 0 and self.loops >= 1):
            raise ValueError(f"frames={self.frames} must be at least 0, loops={self.loops} at least 1")
        if not (math.isfinite(self.fps) and self.fps > 0):
            raise ValueError(f"fps={self.fps} must be above 0")

    @classmethod
    def from_toml(cls, path: Path) -> "LiveSettings":
        """The settings that a TOML file gives; `source` must still be given."""
        return defaults_from(cls, path, source=Path())

    def run(self) -> int:
        """Plays the source.

        Raises:
            UserError: The source or a model cannot be used, or no image could.
        """
        statistics, notices = Statistics(), Notices()
        with ExitStack() as stack:
            source, wire = self._opened(stack)
            modules = self._modules()
            stack.callback(modules.close)
            system = OnlineSystem(self._detector(), modules, SystemSettings(self.tracker, self.planner))
            system.bus.subscribe(object, statistics.take)
            system.bus.subscribe(Notice, notices.take)
            if self.record is not None:
                from pipelines.online.ros.record import Recorder

                recorder = stack.enter_context(Recorder(self.record, self.camera_name))
                system.bus.subscribe(object, recorder.take)
            if wire is not None:
                from pipelines.online.wires.publishing import Publisher

                system.bus.subscribe(object, Publisher(wire, system.bus, self.camera_name).take)
            if self.view:
                from pipelines.viewer.moments import LiveShow
                from pipelines.viewer.page import Page

                show = LiveShow(self.fps)
                page = Page(show, self.view)
                stack.callback(page.close)
                system.bus.subscribe(object, show.take)
                system.bus.subscribe(object, page.take)
                page.start()
                log.info("%s shows it", page.address)
            self._play(system, source)
        for sentence in [*statistics.sentences(), *notices.summary()]:
            log.info("%s", sentence)
        if self.record is not None:
            log.info("%s", self.record)
        if not statistics.n_images:
            raise UserError(f"no image of {self.source} could be used; the warnings say why")
        return 0

    def _opened(self, stack: ExitStack) -> tuple[Source, Wire | None]:
        """The source and, of one that runs on ROS, where results are published."""
        if is_live_source(self.source):
            return open_live_source(self.source, self._options(), stack)
        return open_source(self.source, self._options()), None

    def _play(self, system: OnlineSystem, source: Source) -> None:
        waits = not (self.realtime or source.is_live)
        try:
            for item in self._items(source):
                if isinstance(item, Notice):
                    system.bus.publish(item)
                    continue
                system.step(item)
                if waits:
                    system.finish()
        except KeyboardInterrupt:
            if not source.is_live:
                raise
            log.info("interrupted")  # How else would it end?
        system.finish()

    def _items(self, source: Source) -> Iterator[CameraFrame | Notice]:
        again = itertools.chain.from_iterable(source.frames() for _ in range(self.loops))
        chosen = itertools.islice(again, self.frames or None)
        return paced(chosen) if self.realtime and not source.is_live else chosen

    def _options(self) -> PlayOptions:
        is_given = self.camera is not None or self.intrinsics is not None
        camera = GivenCamera(self.camera or "", self.intrinsics) if is_given else None
        return PlayOptions(self.fps, self.sensor, camera, self.layout, self.topic, self.knows_pose)

    def _detector(self) -> PersonDetector:
        return PersonDetector(prior=FloorPrior(self.pitch, self.height))

    def _modules(self) -> Modules:
        """The modules, ready to be asked.

        Raises:
            UserError: A model cannot be used.
        """
        settings = tuple(
            ModuleSettings(name, kind, str(path), cost_s=cost_s)
            for name, kind, path, cost_s in (
                ("walks", "walks", self.walks, 0.002),
                ("skeleton", "skeleton", self.skeleton, 0.015),
                ("orientation", "orientation", self.orientation, 0.001),
                ("head", "orientation", self.head, 0.001),
            )
            if path is not None
        )
        try:
            if not self.processes:
                return InlineModules(settings)
            modules = ProcessModules(settings)
            modules.wait_ready()
        except (ValueError, RuntimeError) as error:
            raise UserError(str(error)) from None
        return modules
