"""What is known of every track: the last answers of each module, smoothed skeletons, and what the planner asks."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from forests.smoothing import SmoothingConfig
from pipelines.online.messages import (
    NS,
    Notice,
    OrientationResult,
    Result,
    SkeletonResult,
    TrackedPerson,
    TrackedPersons,
    TrackSkeleton,
)
from pipelines.online.planner import TrackStates
from pipelines.online.smoothing import SkeletonFilter

FORGOTTEN_NS = 5 * NS
"""Answers about a track that was not told of for so long come too late [ns]."""
FACING_NS = NS
"""An orientation is believed for so long [ns]."""
WALKS_MPS = 0.4
"""Who moves faster faces where they go [m/s]."""


@dataclass
class _Page:
    """A track: when it was told of first and last [ns], and by module the last answer and the filter."""

    first: int
    last: int
    results: dict[str, Result] = field(default_factory=dict)
    filters: dict[str, SkeletonFilter] = field(default_factory=dict)


class TrackBook:
    """Puts answers to the tracks that they belong to, however late, doubled or out of order they come.

    An answer is taken if its track is known and was there when the image was taken, and if it is newer than the last
    answer of the same module about the same track.
    """

    def __init__(self, smoothing: SmoothingConfig | None = None) -> None:
        self._smoothing = smoothing
        self._pages: dict[int, _Page] = {}
        self._stamp: int | None = None

    def clear(self) -> None:
        """Forgets all tracks."""
        self._pages.clear()
        self._stamp = None

    def turn(self, persons: TrackedPersons) -> None:
        """Takes the tracks of an image, later than those before."""
        self._stamp = persons.stamp
        for person in persons.persons:
            page = self._pages.setdefault(person.track_id, _Page(persons.stamp, persons.stamp))
            page.last = persons.stamp
        for track_id in [k for k, page in self._pages.items() if persons.stamp - page.last > FORGOTTEN_NS]:
            del self._pages[track_id]

    def refusal(self, result: Result) -> Notice | None:
        """Why an answer cannot be taken; None = it can."""
        page = self._pages.get(result.track_id)
        name = f"an answer of {result.module} about track {result.track_id}"
        if page is None:
            return Notice("answers about tracks that are gone", f"{name} came after the track was gone")
        if not page.first <= result.stamp <= (self._stamp or 0):
            return Notice("answers of other times", f"{name} is of a time at which the track was not followed")
        last = page.results.get(result.module)
        if last is not None and result.stamp <= last.stamp:
            return Notice("answers out of order", f"{name} came after one of the same or a later image")
        return None

    def take(
        self, result: Result, T_floor_camera: NDArray[np.float64], frame_id: str
    ) -> TrackSkeleton | Notice | None:
        """Puts an answer to its track.

        Args:
            result: In the camera's frame of reference.
            T_floor_camera: (4, 4) float64, the camera of the image in the frame of reference of the tracks.
            frame_id: Name of the latter.

        Returns:
            The track's skeleton if the answer was one; a notice if it was refused.
        """
        refusal = self.refusal(result)
        if refusal is not None:
            return refusal
        page = self._pages[result.track_id]
        page.results[result.module] = result
        if not isinstance(result, SkeletonResult):
            return None
        smoother = page.filters.setdefault(result.module, SkeletonFilter(self._smoothing))
        return smoother.update(result, T_floor_camera, frame_id)

    def last(self, track_id: int, module: str) -> Result | None:
        """The last answer of a module about a track."""
        page = self._pages.get(track_id)
        return None if page is None else page.results.get(module)

    def states(
        self, persons: TrackedPersons, T_floor_camera: NDArray[np.float64], modules: tuple[str, ...]
    ) -> TrackStates:
        """What the planner asks of the tracks of an image, whom `turn` was told of.

        Args:
            persons: The tracks.
            T_floor_camera: (4, 4) float64, the camera in their frame of reference.
            modules: Names, in the order of the columns of `stale`.
        """
        eye = T_floor_camera[:2, 3]
        off = eye - np.array([person.place for person in persons.persons]).reshape(-1, 2)
        velocity = np.array([person.velocity for person in persons.persons]).reshape(-1, 2)
        distance = np.linalg.norm(off, axis=1)
        to_camera = off / np.maximum(distance, 1e-6)[:, None]
        approach = (velocity * to_camera).sum(axis=1)
        speed = np.linalg.norm(velocity, axis=1)
        walking = np.where(speed > WALKS_MPS, approach / np.maximum(speed, 1e-6), np.nan)
        facing = [self._facing(person, persons.stamp) for person in persons.persons]
        found = [person.detection for person in persons.persons]
        stale = [self._stale(person, persons.stamp, modules) for person in persons.persons]
        return TrackStates(
            distance,
            approach,
            np.where(np.isnan(facing), walking, facing),
            np.array([0.0 if one is None else one.visible for one in found], np.float64),
            np.array([one is not None for one in found], bool),
            np.array(stale, np.float64).reshape(len(stale), len(modules)),
        )

    def _facing(self, person: TrackedPerson, stamp: int) -> float:
        """Cosine of the angle to the camera by the last orientation of the body, NaN = not known."""
        for result in self._pages[person.track_id].results.values():
            is_body = isinstance(result, OrientationResult) and result.region == "body"
            if is_body and stamp - result.stamp <= FACING_NS:
                assert isinstance(result, OrientationResult)
                return float(np.cos(result.angle))
        return float("nan")

    def _stale(self, person: TrackedPerson, stamp: int, modules: tuple[str, ...]) -> list[float]:
        page = self._pages[person.track_id]
        return [
            (stamp - (page.results[name].stamp if name in page.results else page.first - NS)) / NS
            for name in modules
        ]
