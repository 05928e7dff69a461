"""Skeletons of a sequence, smoothed: a filter a track, for forests of either kind."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from forests.smoothing import SkeletonSmoother

FORGOTTEN_S = 0.5
"""A joint, or a person, that was not found for so long is not guessed at any more."""


class TrackSmoother:
    """Smooths the people of a sequence, each apart.

    Attributes:
        fps: Frames a second.
    """

    def __init__(self, fps: float) -> None:
        self.fps = fps
        self._tracks: dict[str, _Track] = {}

    def smoothed(self, track: str, tick: int, estimate: JointEstimate) -> JointEstimate:
        """The estimate with its joints, the first proposals, smoothed; a joint not found goes on for a while.

        Args:
            track: Whose it is.
            tick: Its place in time, in frames; where it is not later than the track's last, the track begins anew.
            estimate: As the forest answered.
        """
        state = self._tracks.setdefault(track, _Track(len(estimate.joints), tick))
        joints = state.update(estimate, (tick - state.tick) / self.fps)
        state.tick = tick
        proposals = estimate.proposals.copy()
        proposals[:, 0] = joints
        return replace(estimate, proposals=proposals)


class _Track:
    def __init__(self, n_joints: int, tick: int) -> None:
        self.tick = tick
        self._smoother = SkeletonSmoother()
        self._unseen_s = np.full(n_joints, np.inf)

    def update(self, estimate: JointEstimate, seconds: float) -> NDArray[np.float32]:
        if not 0.0 < seconds <= FORGOTTEN_S:
            self._smoother.reset()
            self._unseen_s[:] = np.inf
        joints = self._smoother.update(estimate.joints, trust(estimate), seconds)
        is_found = np.isfinite(estimate.joints).all(axis=1)
        self._unseen_s = np.where(is_found, 0.0, self._unseen_s + seconds)
        joints[self._unseen_s > FORGOTTEN_S] = np.nan
        return joints


def trust(estimate: JointEstimate) -> NDArray[np.float32]:
    """(n_joints,) in 0..1, how far each joint is believed: its probability, 1 where the model tells none.

    The confidence of a regression forest is no share, so that it does not serve here.
    """
    return np.nan_to_num(estimate.probability, nan=1.0)
