"""Everybody in one image, on the floor: the finder's answers in the frame of reference that tracks live in."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from forests.finder.find import FoundPerson, PeopleFinder
from forests.finder.floor import Floor, FloorPrior, NoFloorError, find_floor
from pipelines.online.messages import NS, CameraFrame, Detection, Detections

FLOOR, LEVEL = "floor", "level"
"""Frames of reference where the image tells none: under the camera, on the floor that was found; in the camera, where
none was found."""
_LEVEL = Floor(np.array([0.0, -1.0, 0.0]), 0.0)
TYPICAL_HEIGHT_M = 1.7
"""Of a person whose height above the floor is not known."""


@dataclass(frozen=True)
class DetectorSettings:
    """How people are found.

    Attributes:
        score: Logarithm of the odds from which a place is told of; less sure ones than the finder's own bound serve
            to continue tracks.
        check_every: Images between two looks at where the floor is, for a camera whose pose is not told.
        moved_rad: A floor whose tilt differs by more, twice in a row, tells that the camera has moved [rad].
        moved_m: The same for its height [m].
        gap_s: After so long without an image the camera may stand anywhere: the floor is found anew [s].
    """

    score: float = -0.5
    check_every: int = 30
    moved_rad: float = 0.05
    moved_m: float = 0.08
    gap_s: float = 5.0


class Seen(NamedTuple):
    """What was found in an image.

    Attributes:
        detections: The people.
        T_floor_camera: (4, 4) float64, the camera in the frame of reference of their places.
        floor: The floor; None = none is known.
        is_moved: Whether that frame of reference is another than that of the image before.
    """

    detections: Detections
    T_floor_camera: NDArray[np.float64]
    floor: Floor | None
    is_moved: bool


class Detector(Protocol):
    """What finds everybody in the images of one camera, one after the other."""

    def detect(self, frame: CameraFrame) -> Seen:
        """Finds everybody in an image."""
        ...


class PersonDetector:
    """Finds everybody in images of one camera.

    Attributes:
        finder: Finds people.
        settings: How.
        prior: What is known of the camera's tilt and height.
    """

    def __init__(
        self,
        finder: PeopleFinder | None = None,
        settings: DetectorSettings = DetectorSettings(),
        prior: FloorPrior | None = None,
    ) -> None:
        self.finder = PeopleFinder() if finder is None else finder
        self.settings = settings
        self.prior = prior
        self._floor: Floor | None = None
        self._other: Floor | None = None
        self._n_since = 0
        self._stamp: int | None = None
        self._frame_id: str | None = None

    def detect(self, frame: CameraFrame) -> Seen:
        """Finds everybody in an image.

        Raises:
            ValueError: Its depth is no depth image.
        """
        floor, is_moved = self._floor_of(frame)
        found = self.finder.find(frame.depth, frame.camera, floor or self.prior, self.settings.score)
        if frame.T_world_camera is not None:
            frame_id, T_floor_camera = frame.world_frame_id, frame.T_world_camera
        elif found.floor is not None:
            frame_id, T_floor_camera = FLOOR, found.floor.T_floor_camera
        else:
            frame_id, T_floor_camera = LEVEL, _LEVEL.T_floor_camera
        is_moved |= self._frame_id not in (None, frame_id)
        self._frame_id = frame_id
        people = tuple(detection_of(one, T_floor_camera, frame.camera.fy) for one in found)
        return Seen(Detections(frame.stamp, frame_id, people), T_floor_camera, found.floor, is_moved)

    def _floor_of(self, frame: CameraFrame) -> tuple[Floor | None, bool]:
        """The floor, as far as it is known before people are sought, and whether the camera has moved."""
        if frame.T_world_camera is not None:
            return floor_of_pose(frame.T_world_camera), False
        since, self._stamp = self._stamp, frame.stamp
        if since is not None and not 0 <= frame.stamp - since <= self.settings.gap_s * NS:
            self._floor = self._other = None
        self._n_since += 1
        if self._floor is not None and self._n_since < self.settings.check_every and self._other is None:
            return self._floor, False
        self._n_since = 0
        is_moved = self._look(frame)
        return self._floor, is_moved

    def _look(self, frame: CameraFrame) -> bool:
        """Looks for the floor anew; whether it is another, which must be found twice in a row to be believed."""
        try:
            found = find_floor(frame.depth, frame.camera, self.prior)
        except NoFloorError:
            self._other = None
            return False
        if self._floor is None or self._is_same(self._floor, found):
            self._floor, self._other = self._floor or found, None
            return False
        if self._other is None or not self._is_same(self._other, found):
            self._other = found
            return False
        self._floor, self._other = found, None
        return True

    def _is_same(self, one: Floor, other: Floor) -> bool:
        tilt = float(np.arccos(np.clip(one.normal @ other.normal, -1, 1)))
        return tilt <= self.settings.moved_rad and abs(one.height - other.height) <= self.settings.moved_m


def floor_of_pose(T_world_camera: NDArray[np.float64]) -> Floor:
    """The floor z = 0 of the world, as a camera at that pose sees it.

    Args:
        T_world_camera: (4, 4) float64.

    Raises:
        ValueError: The camera looks straight up or down.
    """
    normal = T_world_camera[2, :3] / np.linalg.norm(T_world_camera[2, :3])
    return Floor(normal, float(T_world_camera[2, 3]))


def detection_of(person: FoundPerson, T_floor_camera: NDArray[np.float64], fy: float) -> Detection:
    """A found person as a message."""
    place = T_floor_camera[:3, :3] @ person.axis + T_floor_camera[:3, 3]
    whole = TYPICAL_HEIGHT_M if np.isnan(person.height) else max(person.height, 0.5)
    seen = (person.box[3] - person.box[1]) * person.axis[2] / fy
    return Detection(
        place[:2],
        person.height,
        person.confidence,
        person.distance,
        float(np.clip(seen / whole, 0.0, 1.0)),
        person.box,
        person.upper_body,
        person.axis,
    )
