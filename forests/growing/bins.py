"""The values of one candidate feature in bins, and the thresholds between them."""

import numpy as np
from numba import int32, njit

from forests.features import FEATURE_LIMIT_MM

_N_RANGE_SAMPLES = 16
"""The least and the greatest of so many values span about the inner 90 % of all, without sorting."""


_SAMPLES_PER_BIN = 8
"""Finer thresholds than so many samples a bin cost time and gain nothing."""


@njit(cache=True, nogil=True, inline="always")
def n_inner_bins(n_samples: int, n_thresholds: int) -> int:
    """Bins between the two extreme ones: a threshold less than `n_thresholds`, fewer for few samples."""
    return max(min(n_thresholds - 1, n_samples // _SAMPLES_PER_BIN), 2)


@njit(cache=True, nogil=True, inline="always")
def inner_range(values: np.ndarray) -> tuple[int, int]:
    """(low, high) [mm] of about the inner 90 % of the values that are not cut; (0, 0) if all looked at are."""
    low, high = int32(FEATURE_LIMIT_MM), int32(-FEATURE_LIMIT_MM)
    n = len(values)
    n_seen = min(n, _N_RANGE_SAMPLES)
    for k in range(n_seen):
        value = values[k * n // n_seen]
        is_inner = abs(value) < FEATURE_LIMIT_MM
        low = min(low, value if is_inner else int32(FEATURE_LIMIT_MM))
        high = max(high, value if is_inner else int32(-FEATURE_LIMIT_MM))
    if low > high:
        return int32(0), int32(0)
    return low, high


@njit(cache=True, nogil=True, inline="always")
def bin_scale(low: int, high: int, n_inner: int) -> np.float32:
    """Bins a millimetre, float32."""
    return np.float32(n_inner) / np.float32(high - low + 1)


@njit(cache=True, nogil=True, inline="always")
def inner_bin(value: int, low: int, high: int, scale: float) -> int:
    """Bin of a value that is not cut, 0..n_inner-1; values outside the range lie in the outermost bins."""
    return int32(np.float32(int32(min(max(value, low), high) - low)) * scale)


@njit(cache=True, nogil=True)
def bin_values(values: np.ndarray, low: int, high: int, n_inner: int, stride: int, bins: np.ndarray) -> None:
    """Bins values: 0 = cut at the lower limit, 1..n_inner, n_inner + 1 = cut at the upper limit.

    Args:
        values: (m,) int32 [mm].
        low: Of the inner range [mm], int32.
        high: Of the inner range [mm], int32.
        n_inner: Bins between the two extreme ones.
        stride: Factor of the bin's number, so that it is the place of the bin's row.
        bins: (m,) int32 to fill, bin * stride.
    """
    scale = bin_scale(low, high, n_inner)
    for i in range(len(values)):
        value = values[i]
        number = inner_bin(value, low, high, scale) + int32(1)
        if value == -FEATURE_LIMIT_MM:
            number = int32(0)
        if value == FEATURE_LIMIT_MM:
            number = int32(n_inner + 1)
        bins[i] = int32(number * stride)


@njit(cache=True, nogil=True)
def bin_threshold(number: int, low: int, high: int, n_inner: int) -> int:
    """The greatest value [mm] of bin `number` or a lower one: what lies above goes to the right child."""
    if number == 0:
        return -FEATURE_LIMIT_MM
    scale = bin_scale(low, high, n_inner)
    if inner_bin(high, low, high, scale) + 1 <= number:
        return FEATURE_LIMIT_MM - 1
    value = int32(low)
    while value < high and inner_bin(int32(value + 1), low, high, scale) + 1 <= number:
        value = int32(value + 1)
    return value
