"""Smooth curves over time."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import correlate1d, minimum_filter1d

Array = NDArray[np.float64]
_SIGMAS = 3.0
"""Where a bell is cut off."""
_SIGMAS_BELOW = 1.6
"""Where it is cut off that stays below something."""


def eased(share: ArrayLike) -> Array:
    """Goes from 0 to 1 without speed and acceleration at both ends (minimum jerk: Flash & Hogan 1985).

    Args:
        share: Of the way in time; below 0 gives 0, above 1 gives 1.
    """
    u = np.clip(np.asarray(share, np.float64), 0.0, 1.0)
    return np.asarray(u**3 * (10.0 - 15.0 * u + 6.0 * u * u))


def travelled(share: Array, start: Array, end: Array, leaving: Array, arriving: Array) -> Array:
    """A way with given speeds at its ends: half cubic, whose acceleration is there at once, half quintic.

    Args:
        share: Of the way in time, 0..1.
        start: Where it begins.
        end: Where it ends.
        leaving: Speed at the beginning, a whole time's way.
        arriving: Speed at the end, likewise.
    """
    u = np.asarray(share, np.float64)
    way = end - start
    cubic = u * leaving + u**2 * (3.0 * way - 2.0 * leaving - arriving) + u**3 * (leaving + arriving - 2.0 * way)
    quintic = (
        u * leaving
        + u**3 * (10.0 * way - 6.0 * leaving - 4.0 * arriving)
        - u**4 * (15.0 * way - 8.0 * leaving - 7.0 * arriving)
        + u**5 * (6.0 * way - 3.0 * leaving - 3.0 * arriving)
    )
    return np.asarray(start + 0.5 * (cubic + quintic))


def bump(share: ArrayLike) -> Array:
    """Goes from 0 to 1 and back to 0, smoothly; 0 outside of 0..1."""
    u = np.clip(np.asarray(share, np.float64), 0.0, 1.0)
    return np.asarray(64.0 * (u * (1.0 - u)) ** 3)


def smoothed(values: Array, sigma: float, rate: float, cut: float = _SIGMAS) -> Array:
    """A weighted mean over time with a bell of a standard deviation; the ends are held.

    Args:
        values: (n,) or (n, m).
        sigma: [s].
        rate: Samples a second.
        cut: Where the bell ends, in standard deviations.
    """
    width = sigma * rate
    reach = int(np.ceil(cut * width))
    if reach < 1:
        return np.array(values, np.float64)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    return np.asarray(correlate1d(np.asarray(values, np.float64), bell / bell.sum(), axis=0, mode="nearest"))


def smooth_below(values: Array, sigma: float, rate: float) -> Array:
    """(n,) a smooth curve that is nowhere above some values: their least within the bell's reach, smoothed."""
    reach = int(np.ceil(_SIGMAS_BELOW * sigma * rate))
    return smoothed(minimum_filter1d(values, 2 * reach + 1, mode="nearest"), sigma, rate, _SIGMAS_BELOW)


def drift(n: int, rate: float, rng: np.random.Generator, slowest: float = 0.08, fastest: float = 0.45) -> Array:
    """(n,) slow aimless movement with a standard deviation of about 1: three sines of drawn frequencies [Hz]."""
    seconds = np.arange(n) / rate
    frequency = rng.uniform(slowest, fastest, 3)
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)
    return np.asarray(np.sin(2.0 * np.pi * frequency * seconds[:, None] + phase).sum(axis=1) * np.sqrt(2.0 / 3.0))
