"""How good the best threshold of one binned feature is."""

import numpy as np
from numba import njit

NO_GAIN = -1.0


@njit(cache=True, nogil=True)
def entropy_gain(
    bins: np.ndarray, columns: np.ndarray, total: np.ndarray, n_bins: int, min_samples: int,
    n_log_n: np.ndarray, counts: np.ndarray, left: np.ndarray,
) -> tuple[float, int]:  # fmt: skip
    """The greatest information gain over all thresholds between bins (equations 2-4), times the samples [nats].

    With T(n) = n log n, n H of counts c is T(n) - sum T(c): integers until the table is read.

    Args:
        bins: (m,) int32, bin * n_columns.
        columns: (m,) int32, class among the classes alive.
        total: (n_columns,) int32, samples by class.
        n_bins: Bins.
        min_samples: Fewest samples on either side.
        n_log_n: (m + 1 or more,) float64.
        counts: (n_bins * n_columns or more,) int32, scratch.
        left: (n_columns or more,) int32, scratch.

    Returns:
        (gain, last bin of the left side); NO_GAIN if no threshold leaves `min_samples` on both sides.
    """
    m, n_columns = len(bins), len(total)
    counts[: n_bins * n_columns] = 0
    for i in range(m):
        counts[bins[i] + columns[i]] += 1
    parent = -n_log_n[m]
    for c in range(n_columns):
        parent += n_log_n[total[c]]
        left[c] = 0
    best, best_bin, n_left = NO_GAIN, 0, 0
    for b in range(n_bins - 1):
        n_before = n_left
        children = 0.0
        for c in range(n_columns):
            count = left[c] + counts[b * n_columns + c]
            n_left += counts[b * n_columns + c]
            left[c] = count
            children += n_log_n[count] + n_log_n[total[c] - count]
        if n_left == n_before or n_left < min_samples or m - n_left < min_samples:
            continue
        gain = children - n_log_n[n_left] - n_log_n[m - n_left] - parent
        if gain > best:
            best, best_bin = gain, b
    return best, best_bin


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
