"""Angles on a circle: differences, sectors, the peak of a posterior over sectors, the von Mises distribution."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def wrapped(angle: ArrayLike) -> Array:
    """The same angles within -pi..pi, pi excluded [rad]."""
    return np.asarray((np.asarray(angle, np.float64) + np.pi) % (2.0 * np.pi) - np.pi)


def angular_error(given: ArrayLike, true: ArrayLike) -> Array:
    """How far angles are apart the shorter way round, 0..pi [rad]; NaN where one is."""
    return np.abs(wrapped(np.asarray(given, np.float64) - np.asarray(true, np.float64)))


def bin_of(angle: ArrayLike, n_bins: int) -> NDArray[np.int64]:
    """Number of the sector that an angle lies in; the middle of the first is 0, so that it is that of frontal views.

    Args:
        angle: (...) [rad], finite.
        n_bins: Equal sectors of the circle.
    """
    place = np.asarray(angle, np.float64) / (2.0 * np.pi) * n_bins
    return np.asarray(np.floor(place + 0.5).astype(np.int64) % n_bins)


def bin_centre(number: ArrayLike, n_bins: int) -> Array:
    """Middle of a sector, within -pi..pi [rad]."""
    return wrapped(np.asarray(number, np.float64) * (2.0 * np.pi / n_bins))


def interpolated_peak(posterior: NDArray[np.floating]) -> Array:
    """The peak of the parabola through the likeliest sector and its two neighbours (Beyer et al. 2015, section 5).

    Args:
        posterior: (n, n_bins) probabilities.

    Returns:
        (n,) angles [rad].
    """
    n, n_bins = posterior.shape
    best = posterior.argmax(axis=1)
    rows = np.arange(n)
    here = posterior[rows, best].astype(np.float64)
    before = posterior[rows, (best - 1) % n_bins].astype(np.float64)
    after = posterior[rows, (best + 1) % n_bins].astype(np.float64)
    bend = before - 2.0 * here + after
    is_peak = bend < 0.0
    shift = np.where(is_peak, 0.5 * (before - after) / np.where(is_peak, bend, 1.0), 0.0)
    return wrapped((best + shift) * (2.0 * np.pi / n_bins))


def mean_direction(angles: NDArray[np.floating], axis: int = 0) -> Array:
    """The direction of the mean of unit vectors along an axis [rad]."""
    return np.asarray(np.arctan2(np.sin(angles).mean(axis=axis), np.cos(angles).mean(axis=axis)))


def von_mises_log_density(error: ArrayLike, concentration: ArrayLike) -> Array:
    """Logarithm of the density of the von Mises distribution (Beyer et al. 2015, equation 1) [1/rad].

    Args:
        error: (...) angle minus mean [rad].
        concentration: (...) kappa, at least 0.
    """
    from scipy.special import i0e

    kappa = np.asarray(concentration, np.float64)
    return np.asarray(kappa * (np.cos(error) - 1.0) - np.log(2.0 * np.pi * i0e(kappa)))


def von_mises_within(reach: float, concentration: ArrayLike, n_steps: int = 256) -> Array:
    """(...) share of a von Mises distribution that lies within `reach` of its mean.

    Args:
        reach: 0..pi [rad].
        concentration: (...) kappa.
        n_steps: Of the trapezoidal rule.
    """
    at = np.linspace(0.0, reach, n_steps + 1)
    # Narrow peaks need steps that are denser there.
    at = reach * (at / reach) ** 3 if reach > 0.0 else at
    kappa = np.asarray(concentration, np.float64)[..., None]
    density = np.exp(von_mises_log_density(at, kappa))
    return np.asarray(np.minimum(1.0, 2.0 * np.trapezoid(density, at, axis=-1)))
