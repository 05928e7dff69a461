"""What a source of images is, and those that lie on disk: corpora, folders of depth files, recordings of ROS."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Protocol

import numpy as np

from forests.frames import Intrinsics
from pipelines.corpus import Corpus
from pipelines.corpus.header import HEADER_NAME
from pipelines.errors import UserError
from pipelines.online.messages import NS, CameraFrame, Notice
from pipelines.online.sources.bag import BagSource, is_bag
from pipelines.predicting.images import Request, recorded_requests
from pipelines.recordings.plain import GivenCamera

CAMERA = "camera"
"""Name of the frame of reference of cameras that have none."""
BETWEEN_CLIPS_S = 30.0
"""Time that passes between two clips, so that nobody of the first is sought in the second [s]."""


class Source(Protocol):
    """Images in order of time.

    Attributes:
        is_live: Whether they come of themselves, so that they wait for nobody.
    """

    @property
    def is_live(self) -> bool:
        """See above."""
        ...

    def frames(self) -> Iterator[CameraFrame | Notice]:
        """The images; in their place, why one cannot be used."""
        ...


@dataclass(frozen=True)
class CorpusSource:
    """The frames of a corpus; those of a clip follow one another, others have nothing to do with one another.

    Attributes:
        path: The corpus.
        sensor: Whose noise is added; None = none.
        fps: Images a second of frames that belong to no clip.
        knows_pose: Whether the camera's pose is told.
    """

    path: Path
    sensor: str | None = None
    fps: float = 30.0
    knows_pose: bool = True
    is_live: ClassVar[bool] = False

    def frames(self) -> Iterator[CameraFrame | Notice]:
        """The frames of whole scenes in order of number, those of the first camera alone.

        Raises:
            UserError: No corpus of whole scenes, or no such sensor.
        """
        corpus = Corpus.open(self.path)
        corpus.check_sensor(self.sensor)
        if not corpus.header.has_rooms:
            raise UserError(
                f"{self.path} shows single people without their surroundings; play whole scenes (rooms)"
            )
        for number, stamp in zip(*self._order(corpus), strict=True):
            scene = corpus.scene(int(number), self.sensor)
            camera = scene.camera
            pose = np.asarray(scene.T_world_camera, np.float64) if self.knows_pose else None
            yield CameraFrame(
                int(stamp), CAMERA, scene.depth, Intrinsics(camera.fx, camera.fy, camera.cx, camera.cy), pose
            )

    def _order(self, corpus: Corpus) -> tuple[np.ndarray, np.ndarray]:
        """(n,) numbers of frames and (n,) their stamps [ns]."""
        numbers = corpus.indices
        if "clip" not in corpus.header.fields:
            return numbers, (np.arange(len(numbers)) / self.fps * NS).astype(np.int64)
        split, clip, step, view = (
            corpus.arrays(name).astype(np.int64) for name in ("split", "clip", "time", "view")
        )
        is_first = view == 0
        numbers, step = numbers[is_first], step[is_first]
        begins = np.flatnonzero(np.diff(split[is_first] * (clip.max() + 1) + clip[is_first], prepend=-1))
        clip_of = np.cumsum(np.isin(np.arange(len(numbers)), begins)) - 1
        fps = float(corpus.header.config["scene"].get("fps", 0.0)) or self.fps
        lengths = np.maximum.reduceat(step, begins) / fps + BETWEEN_CLIPS_S
        begin_s = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
        return numbers, np.rint((begin_s[clip_of] + step / fps) * NS).astype(np.int64)


@dataclass(frozen=True)
class FolderSource:
    """Depth files in order of their names.

    Attributes:
        requests: The files.
        fps: Images a second.
    """

    requests: tuple[Request, ...]
    fps: float = 30.0
    is_live: ClassVar[bool] = False

    def frames(self) -> Iterator[CameraFrame | Notice]:
        """The images."""
        for k, request in enumerate(self.requests):
            try:
                image = request.read()
            except (UserError, OSError) as error:
                yield Notice("unreadable files", f"{request.source} is left out: {error}")
                continue
            camera = image.camera
            intrinsics = Intrinsics(camera.fx, camera.fy, camera.cx, camera.cy)
            yield CameraFrame(round(k / self.fps * NS), CAMERA, image.depth, intrinsics)


@dataclass(frozen=True)
class PlayOptions:
    """How a source is played.

    Attributes:
        fps: Images a second where they have no stamps.
        sensor: Whose noise is added to generated frames; None = none.
        camera: Of depth files, or instead of that of a recording; None = a layout or a CameraInfo tells.
        layout: Of depth files; None = found.
        topic: Of the images of a recording; None = found.
        knows_pose: Whether the pose of the camera is taken where it is told.
    """

    fps: float = 30.0
    sensor: str | None = None
    camera: GivenCamera | None = None
    layout: str | None = None
    topic: str | None = None
    knows_pose: bool = True


def open_source(path: Path, options: PlayOptions) -> Source:
    """The source that a path is: a corpus, a recording of ROS, or a folder of depth files.

    Raises:
        UserError: It is none of these.
    """
    if (path / HEADER_NAME).is_file():
        return CorpusSource(path, options.sensor, options.fps, options.knows_pose)
    if options.sensor is not None:
        raise UserError(f"--sensor is for generated corpora, and {path} is none")
    if is_bag(path):
        given = None if options.camera is None else options.camera.values
        camera = None if given is None else Intrinsics(given.fx, given.fy, given.cx, given.cy)
        return BagSource(path, options.topic, camera, options.knows_pose)
    if not path.exists():
        raise UserError(f"there is no file or folder {path}")
    return FolderSource(
        tuple(recorded_requests((path,), options.layout, options.camera, is_whole=True)), options.fps
    )
