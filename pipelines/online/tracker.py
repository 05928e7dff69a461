"""Follows people over time: detections on the floor become tracks, which keep their numbers through short occlusions.

1. Every track is forecast with constant velocity to the time of the image.
2. Detections are assigned to tracks in three rounds, each by the assignment of least total cost: to those seen just
   now, to those lost for a while, who must also be of like height, then to those that are too young to be sure of.
3. Assigned tracks are corrected; sure detections that are left begin new tracks.
4. Tracks that were not seen for long end.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from pipelines.online import motion
from pipelines.online.messages import NS, Detection, Detections, TrackedPerson, TrackedPersons


@dataclass(frozen=True)
class TrackerSettings:
    """How people are followed.

    Attributes:
        noise_m: Standard deviation of a detected place along each axis at the camera [m].
        noise_per_m: What it grows by with each metre of distance [m].
        acceleration: Standard deviation of people's acceleration along each axis [m/s^2].
        speed: Standard deviation of people's velocity along each axis when first seen [m/s].
        gate: Squared distance, in standard deviations, beyond which a detection is not a track's.
        gate_m: Distance beyond which it never is, for a track that was seen in the last image [m].
        fastest: What that grows by with each second that a track was not seen [m/s].
        sure: Confidence from which a detection begins a track or continues a lost one; less sure ones only continue
            tracks seen just now.
        n_confirm: Detections after which a track is told of.
        confirm_share: Share of the images since its beginning in which a young track was detected, at least.
        mean_confidence: Mean confidence of its detections from which a track is told of.
        told_s: A track is told of until it was not seen for so long [s].
        lost_s: And ends when it was not seen for so long [s].
        slows_s: The velocity of who is not seen falls to a third in this time [s].
        height_m: A lost track takes a detection whose height differs by no more [m].
        weight_height_m: A difference of heights that counts as much as one standard deviation of place [m].
        memory: Share of what is believed of height and confidence that each detection renews.
    """

    noise_m: float = 0.05
    noise_per_m: float = 0.01
    acceleration: float = 2.0
    speed: float = 0.8
    gate: float = 12.0
    gate_m: float = 0.6
    fastest: float = 2.0
    sure: float = 0.75
    n_confirm: int = 3
    confirm_share: float = 0.5
    mean_confidence: float = 0.8
    told_s: float = 0.5
    lost_s: float = 4.0
    slows_s: float = 1.0
    height_m: float = 0.25
    weight_height_m: float = 0.15
    memory: float = 0.1

    def __post_init__(self) -> None:
        for name in ("noise_m", "acceleration", "speed", "gate", "gate_m", "lost_s", "slows_s", "weight_height_m"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)} must be above 0")
        for name in ("sure", "confirm_share", "mean_confidence", "memory"):
            if not 0 <= getattr(self, name) <= 1:
                raise ValueError(f"{name}={getattr(self, name)} must be in [0, 1]")
        if not (self.told_s <= self.lost_s and self.n_confirm >= 1):
            raise ValueError(
                f"told_s={self.told_s} must not exceed lost_s={self.lost_s}, n_confirm={self.n_confirm} must be "
                "at least 1"
            )


@dataclass(frozen=True)
class _Track:
    """What is known of a track beside its motion; times in ns."""

    track_id: int
    begun: int
    seen: int
    n_seen: int
    n_images: int
    height: float
    confidence: float
    is_confirmed: bool
    detection: Detection | None


class StaleMessageError(ValueError):
    """A message that is not later than the last one."""


class Tracker:
    """Follows people.

    Attributes:
        settings: How.
    """

    def __init__(self, settings: TrackerSettings = TrackerSettings()) -> None:
        self.settings = settings
        self._motion = motion.nothing()
        self._tracks: list[_Track] = []
        self._next_id = 1
        self._stamp: int | None = None

    def restart(self) -> None:
        """Ends all tracks, so that any time and place may follow; numbers are not used again."""
        self._motion, self._tracks, self._stamp = motion.nothing(), [], None

    def update(self, detections: Detections) -> TrackedPersons:
        """Takes everybody found in an image.

        Args:
            detections: Later than the last ones, in the same frame of reference.

        Returns:
            Everybody who is followed.

        Raises:
            StaleMessageError: They are not later than the last ones.
        """
        seconds = 0.0
        if self._stamp is not None:
            seconds = (detections.stamp - self._stamp) / NS
            if seconds <= 0:
                raise StaleMessageError(f"detections came {-seconds:.3f} s before the last ones; time must pass")
        self._stamp = detections.stamp
        self._forecast(seconds)
        people = detections.people
        of_track = self._assign(people)
        self._correct(people, of_track)
        self._begin([one for k, one in enumerate(people) if k not in set(of_track.values())])
        self._end()
        return TrackedPersons(detections.stamp, detections.frame_id, self._told())

    def _unseen(self) -> NDArray[np.float64]:
        """(n,) since each track was seen [s]."""
        assert self._stamp is not None
        return np.array([(self._stamp - track.seen) / NS for track in self._tracks], np.float64)

    def _forecast(self, seconds: float) -> None:
        if not self._tracks:
            return
        is_missed = np.array([track.detection is None for track in self._tracks])
        keeps = np.where(is_missed, np.exp(-seconds / self.settings.slows_s), 1.0)
        self._motion = motion.forecast(self._motion, seconds, self.settings.acceleration, keeps)
        self._tracks = [replace(t, n_images=t.n_images + 1, detection=None) for t in self._tracks]

    def _deviation(self, people: list[Detection]) -> NDArray[np.float64]:
        """(m,) of detected places along each axis [m]."""
        distance = np.array([one.distance for one in people], np.float64)
        return self.settings.noise_m + self.settings.noise_per_m * distance

    def _assign(self, people: tuple[Detection, ...]) -> dict[int, int]:
        """By row of a track, the number of its detection."""
        if not self._tracks or not people:
            return {}
        cost, height_off = self._costs(list(people))
        unseen = self._unseen()
        is_sure = np.array([one.confidence >= self.settings.sure for one in people])
        is_confirmed = np.array([track.is_confirmed for track in self._tracks])
        is_recent = unseen <= self.settings.told_s
        is_alike = ~(height_off > self.settings.height_m)
        of_track: dict[int, int] = {}
        for is_of, is_open, is_pair in (
            (is_confirmed & is_recent, np.ones(len(people), bool), True),
            (is_confirmed & ~is_recent, is_sure, is_alike),
            (~is_confirmed, is_sure, True),
        ):
            rows = np.flatnonzero(is_of)
            columns = np.flatnonzero(is_open & ~np.isin(np.arange(len(people)), list(of_track.values())))
            allowed = np.where(is_pair, cost, np.inf)[np.ix_(rows, columns)]
            of_track |= {int(rows[i]): int(columns[j]) for i, j in matched(allowed)}
        return of_track

    def _costs(self, people: list[Detection]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n, m) cost of giving a track a detection, inf = it cannot be; and the difference of their heights [m]."""
        settings, unseen = self.settings, self._unseen()
        place = np.array([one.place for one in people])
        off = np.linalg.norm(self._motion.place[:, None] - place[None], axis=2)
        variance = self._motion.place_variance[:, None] + self._deviation(people)[None] ** 2
        square = off**2 / variance
        heights = np.array([track.height for track in self._tracks])
        height_off = np.abs(heights[:, None] - np.array([one.height for one in people])[None])
        reach = settings.gate_m + settings.fastest * unseen[:, None]
        is_far = (square > settings.gate) | (off > reach)
        cost = square + np.log(variance) + np.nan_to_num((height_off / settings.weight_height_m) ** 2)
        return np.where(is_far, np.inf, cost), height_off

    def _correct(self, people: tuple[Detection, ...], of_track: dict[int, int]) -> None:
        if not of_track:
            return
        rows = np.array(sorted(of_track))
        given = [people[of_track[row]] for row in rows.tolist()]
        better = motion.corrected(
            self._motion.take(rows), np.array([one.place for one in given]), self._deviation(given)
        )
        for values, new in zip(self._motion, better, strict=True):
            values[rows] = new
        for row, one in zip(rows.tolist(), given, strict=True):
            self._tracks[row] = self._seen(self._tracks[row], one)

    def _seen(self, track: _Track, one: Detection) -> _Track:
        settings, memory = self.settings, max(self.settings.memory, 1.0 / (track.n_seen + 1))
        n_seen = track.n_seen + 1
        confidence = track.confidence + memory * (one.confidence - track.confidence)
        height = one.height if np.isnan(track.height) else track.height + memory * (one.height - track.height)
        is_confirmed = track.is_confirmed or (
            n_seen >= settings.n_confirm
            and n_seen >= settings.confirm_share * track.n_images
            and confidence >= settings.mean_confidence
        )
        assert self._stamp is not None
        return replace(
            track,
            seen=self._stamp,
            n_seen=n_seen,
            height=track.height if np.isnan(height) else height,
            confidence=confidence,
            is_confirmed=is_confirmed,
            detection=one,
        )

    def _begin(self, people: list[Detection]) -> None:
        new = [one for one in people if one.confidence >= self.settings.sure]
        if not new:
            return
        begun = motion.begun(np.array([one.place for one in new]), self._deviation(new), self.settings.speed)
        self._motion = motion.joined(self._motion, begun)
        assert self._stamp is not None
        for one in new:
            is_told = self.settings.n_confirm == 1 and one.confidence >= self.settings.mean_confidence
            self._tracks.append(
                _Track(self._next_id, self._stamp, self._stamp, 1, 1, one.height, one.confidence, is_told, one)
            )
            self._next_id += 1

    def _end(self) -> None:
        unseen = self._unseen()
        is_confirmed = np.array([track.is_confirmed for track in self._tracks], bool)
        share = np.array([track.n_seen / track.n_images for track in self._tracks])
        keeps = np.where(is_confirmed, unseen <= self.settings.lost_s, share >= self.settings.confirm_share)
        self._motion = self._motion.take(np.flatnonzero(keeps))
        self._tracks = [track for track, is_kept in zip(self._tracks, keeps, strict=True) if is_kept]

    def _told(self) -> tuple[TrackedPerson, ...]:
        unseen = self._unseen().tolist()
        told = []
        for row, (track, unseen_s) in enumerate(zip(self._tracks, unseen, strict=True)):
            if track.is_confirmed and unseen_s <= self.settings.told_s:
                told.append(
                    TrackedPerson(
                        track.track_id,
                        self._motion.place[row].copy(),
                        self._motion.velocity[row].copy(),
                        self._motion.covariance(row),
                        track.height,
                        track.confidence,
                        (track.seen - track.begun) / NS + unseen_s,
                        unseen_s,
                        track.detection,
                    )
                )
        return tuple(told)


def matched(cost: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Pairs of rows and columns, as many as can be, of least total cost.

    Args:
        cost: (n, m); inf = the two cannot be a pair.

    Returns:
        (row, column) of each pair, by row.
    """
    is_possible = np.isfinite(cost)
    if not is_possible.any():
        return []
    # A pair more is worth any difference of costs.
    spread = float(np.ptp(cost[is_possible])) + 1.0
    filled = np.where(is_possible, cost, cost[is_possible].max() + spread * (min(cost.shape) + 1))
    rows, columns = linear_sum_assignment(filled)
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if is_possible[i, j]]
