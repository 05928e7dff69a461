"""Joints over time: a constant-velocity Kalman filter a joint that trusts confident estimates more."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

_FARTHEST_SIGMAS = 3.0
"""An estimate farther from the forecast than this counts as if it were so much noisier."""
_LEAST_CONFIDENCE = 1e-3
FORGOTTEN_S = 0.5
"""A joint, or a person, that was not found for so long is not guessed at any more [s]."""


@dataclass(frozen=True)
class SmoothingConfig:
    """How estimates are smoothed.

    Attributes:
        noise_m: Standard deviation of an estimate of confidence 1, along each axis [m].
        acceleration: Standard deviation of a joint's acceleration along each axis [m/s^2].
        speed: Standard deviation of a joint's speed when it is first seen, along each axis [m/s].
        fading_s: A joint that is not found goes on as it moved, and comes to move as the whole body does: what its
            speed differs by falls to a third within about this [s]. Bodies go on, while arms and legs swing back.
    """

    noise_m: float = 0.03
    acceleration: float = 4.0
    speed: float = 0.5
    fading_s: float = 0.1

    def __post_init__(self) -> None:
        for name in ("noise_m", "acceleration", "speed", "fading_s"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)} must be above 0")


class SkeletonSmoother:
    """Smooths the joints of one person, frame after frame.

    Attributes:
        config: How.
    """

    def __init__(self, config: SmoothingConfig = SmoothingConfig()) -> None:
        self.config = config
        self.reset()

    def reset(self) -> None:
        """Forgets the person."""
        self._place: NDArray[np.float64] | None = None

    def update(self, joints: ArrayLike, confidence: ArrayLike, seconds: float) -> NDArray[np.float32]:
        """Takes a frame's estimates and gives smoothed ones.

        Args:
            joints: (n_joints, 3) [m]; NaN = not found: the joint goes on, more and more as the whole body does. Of a
                moving camera, in a frame of reference that stands.
            confidence: (n_joints,), up to 1; the noise of an estimate is inverse to it.
            seconds: Since the last frame [s]; of the first frame, not looked at.

        Returns:
            (n_joints, 3) float32, likewise [m]; NaN until a joint was found once.

        Raises:
            ValueError: Other shapes, another number of joints than before, or time that does not pass.
        """
        found = np.asarray(joints, np.float64)
        trust = np.asarray(confidence, np.float64)
        if found.ndim != 2 or found.shape[1] != 3 or trust.shape != found.shape[:1]:
            raise ValueError(f"joints {found.shape} and confidence {trust.shape} must be (n, 3) and (n,)")
        if self._place is None:
            self._place = np.full(found.shape, np.nan)
            self._speed = np.zeros(found.shape)
            self._covariance = np.zeros((len(found), 2, 2))
        elif found.shape != self._place.shape:
            raise ValueError(f"{len(found)} joints given after {len(self._place)}; call reset for another person")
        elif not seconds > 0:
            raise ValueError(f"seconds={seconds} must be above 0")
        else:
            self._forecast(seconds)
        noise = (self.config.noise_m / np.maximum(trust, _LEAST_CONFIDENCE)) ** 2
        is_found = np.isfinite(found[:, 2])
        is_known = np.isfinite(self._place[:, 2])
        self._correct(found, noise, np.logical_and(is_found, is_known))
        self._fade(np.logical_and(~is_found, is_known), is_known, seconds)
        self._begin(found, noise, np.logical_and(is_found, ~is_known))
        return self._place.astype(np.float32)

    def _forecast(self, seconds: float) -> None:
        assert self._place is not None
        self._place += self._speed * seconds
        motion = np.array([[1.0, seconds], [0.0, 1.0]])
        push = np.array([seconds**2 / 2, seconds]) * self.config.acceleration
        self._covariance = motion @ self._covariance @ motion.T + np.outer(push, push)

    def _correct(self, found: NDArray[np.float64], noise: NDArray[np.float64], is_used: NDArray[np.bool_]) -> None:
        assert self._place is not None
        off = np.where(is_used[:, None], found - self._place, 0.0)
        expected = self._covariance[:, 0, 0] + noise
        excess = (off**2).sum(axis=1) / (3 * expected * _FARTHEST_SIGMAS**2)
        gain = self._covariance[:, :, 0] / (expected * np.maximum(excess, 1.0))[:, None] * is_used[:, None]
        self._place += gain[:, :1] * off
        self._speed += gain[:, 1:] * off
        self._covariance -= gain[:, :, None] * self._covariance[:, :1, :]

    def _fade(self, is_lost: NDArray[np.bool_], is_known: NDArray[np.bool_], seconds: float) -> None:
        """Lets joints that are not found come to move as the whole body does."""
        if is_lost.any():
            body = self._speed[is_known].mean(axis=0)
            self._speed[is_lost] = body + (self._speed[is_lost] - body) * np.exp(-seconds / self.config.fading_s)

    def _begin(self, found: NDArray[np.float64], noise: NDArray[np.float64], is_new: NDArray[np.bool_]) -> None:
        assert self._place is not None
        self._place[is_new] = found[is_new]
        self._speed[is_new] = 0.0
        self._covariance[is_new] = 0.0
        self._covariance[is_new, 0, 0] = noise[is_new]
        self._covariance[is_new, 1, 1] = self.config.speed**2


class PersonSmoother:
    """Smooths the joints of one person, and guesses at nothing that was not found for `FORGOTTEN_S`."""

    def __init__(self, config: SmoothingConfig = SmoothingConfig()) -> None:
        self._smoother = SkeletonSmoother(config)
        self._unseen: NDArray[np.float64] = np.empty(0)

    def update(self, joints: ArrayLike, probability: ArrayLike, seconds: float) -> NDArray[np.float32]:
        """Takes estimates and gives smoothed ones.

        Args:
            joints: (n_joints, 3) [m]; NaN = not found: the joint goes on as it moved, for a while.
            probability: (n_joints,) that an estimate is right; NaN = not told, which counts as 1.
            seconds: Since the last estimates [s]; where none were for long, or time has jumped back, all begins anew.

        Returns:
            (n_joints, 3) float32 [m]; NaN = not known.
        """
        found = np.asarray(joints, np.float64)
        if not 0.0 < seconds <= FORGOTTEN_S or len(self._unseen) != len(found):
            self._smoother.reset()
            self._unseen = np.full(len(found), np.inf)
        places = self._smoother.update(found, np.nan_to_num(np.asarray(probability), nan=1.0), seconds)
        self._unseen = np.where(np.isfinite(found).all(axis=1), 0.0, self._unseen + seconds)
        places[self._unseen > FORGOTTEN_S] = np.nan
        return places
