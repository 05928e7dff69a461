"""How good the best threshold of one binned feature is."""

import numpy as np
from numba import njit, uint32

NO_GAIN = -1.0


LOG_ONE = 1 << 24
"""A nat in the fixed-point table of n log n: sums of integers need no order, so loops over classes vectorise."""


@njit(cache=True, nogil=True)
def n_log_n_table(n: int) -> np.ndarray:
    """(n + 1,) int64: k log k in units of 1 / LOG_ONE nat; 0 at 0."""
    table = np.zeros(n + 1, np.int64)
    for k in range(1, n + 1):
        table[k] = np.int64(np.round(k * np.log(k) * LOG_ONE))
    return table


@njit(cache=True, nogil=True)
def entropy_gain(
    bins: np.ndarray, columns: np.ndarray, total: np.ndarray, n_bins: int, min_samples: int,
    n_log_n: np.ndarray, counts: np.ndarray, left: np.ndarray,
) -> tuple[float, int]:  # fmt: skip
    """The greatest information gain over all thresholds between bins (equations 2-4), times the samples [nat].

    With T(n) = n log n, n H of counts c is T(n) - sum T(c).

    Args:
        bins: (m,) int32, bin * n_columns.
        columns: (m,) int32, class among the classes alive.
        total: (n_columns,) uint32, samples by class. Unsigned: an index that may be negative costs a check.
        n_bins: Bins.
        min_samples: Fewest samples on either side.
        n_log_n: (m + 1 or more,) of `n_log_n_table`.
        counts: (n_bins * n_columns or more,) uint32, scratch.
        left: (n_columns or more,) uint32, scratch.

    Returns:
        (gain, last bin of the left side); NO_GAIN if no threshold leaves `min_samples` on both sides.
    """
    m, n_columns = len(bins), len(total)
    counts[: n_bins * n_columns] = 0
    for i in range(m):
        counts[bins[i] + columns[i]] += uint32(1)
    parent = -n_log_n[m]
    for c in range(n_columns):
        parent += n_log_n[total[c]]
        left[c] = 0
    best, best_bin, n_left = np.int64(-LOG_ONE), 0, np.int64(0)
    for b in range(n_bins - 1):
        row = counts[b * n_columns : (b + 1) * n_columns]
        n_here, children = np.int64(0), np.int64(0)
        for c in range(n_columns):
            count = uint32(left[c] + row[c])
            n_here += row[c]
            left[c] = count
            children += n_log_n[count] + n_log_n[uint32(total[c] - count)]
        n_left += n_here
        if n_here == 0 or n_left < min_samples or m - n_left < min_samples:
            continue
        gain = children - n_log_n[n_left] - n_log_n[m - n_left] - parent
        if gain > best:
            best, best_bin = gain, b
    return best / LOG_ONE, best_bin


@njit(cache=True, nogil=True)
def direction_gain(
    bins: np.ndarray, directions: np.ndarray, n_bins: int, min_samples: int, sums: np.ndarray
) -> tuple[float, int]:
    """The greatest fall of the summed squared deviation over all thresholds between bins.

    The squares cancel: with sums S of directions it is |S_left|^2 / n_left + |S_right|^2 / n_right - |S|^2 / n.

    Args:
        bins: (m,) int32, bin * 4.
        directions: (m, 3) int32.
        n_bins: Bins.
        min_samples: Fewest samples on either side.
        sums: (n_bins * 4 or more,) int64, scratch: x, y, z and count a bin.

    Returns:
        (fall, last bin of the left side); NO_GAIN if no threshold leaves `min_samples` on both sides.
    """
    m = len(bins)
    sums[: n_bins * 4] = 0
    for i in range(m):
        row = bins[i]
        sums[row] += directions[i, 0]
        sums[row + 1] += directions[i, 1]
        sums[row + 2] += directions[i, 2]
        sums[row + 3] += 1
    x, y, z = 0, 0, 0
    for b in range(n_bins):
        x += sums[4 * b]
        y += sums[4 * b + 1]
        z += sums[4 * b + 2]
    parent = _squared(x, y, z) / m
    best, best_bin = NO_GAIN, 0
    left_x, left_y, left_z, n_left = 0, 0, 0, 0
    for b in range(n_bins - 1):
        left_x += sums[4 * b]
        left_y += sums[4 * b + 1]
        left_z += sums[4 * b + 2]
        n_left += sums[4 * b + 3]
        if n_left < min_samples or m - n_left < min_samples:
            continue
        right = _squared(x - left_x, y - left_y, z - left_z) / (m - n_left)
        gain = _squared(left_x, left_y, left_z) / n_left + right - parent
        if gain > best:
            best, best_bin = gain, b
    return best, best_bin


@njit(cache=True, nogil=True, inline="always")
def _squared(x: int, y: int, z: int) -> float:
    return float(x) * float(x) + float(y) * float(y) + float(z) * float(z)
