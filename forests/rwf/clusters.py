"""Cluster centres of the directions in a tree's leaves, by mean shift on the unit sphere."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.growing import DIRECTION_ONE, GrownTree

N_STARTS = 12
"""Mean shift starts from so many of a leaf's samples, evenly spread over them."""
N_ITERATIONS = 12


def leaf_clusters(
    grown: GrownTree, directions: NDArray[np.int16], n_clusters: int, bandwidth: float
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Clusters every leaf's directions.

    Args:
        grown: A tree and where its samples ended.
        directions: (n_samples, 3) int16, DIRECTION_ONE a unit.
        n_clusters: Centres kept a leaf.
        bandwidth: Standard deviation of the kernel, as a chord of the unit sphere.

    Returns:
        Centres (n_leaves, n_clusters, 3) float32, means of the unit vectors nearest to a mode, so that a
        scattered cluster's is shorter than 1; shares (n_leaves, n_clusters) float32, falling, summing to 1, 0
        where there is no further cluster.
    """
    n_leaves = len(grown.leaf_start) - 1
    centre = np.zeros((n_leaves, n_clusters, 3), np.float32)
    share = np.zeros((n_leaves, n_clusters), np.float32)
    _cluster_leaves(grown.leaf_start, grown.order, directions, bandwidth, centre, share)
    return centre, share


@njit(cache=True, nogil=True)
def _cluster_leaves(
    leaf_start: np.ndarray, order: np.ndarray, directions: np.ndarray, bandwidth: float,
    centre: np.ndarray, share: np.ndarray,
) -> None:  # fmt: skip
    modes = np.empty((N_STARTS, 3), np.float64)
    for leaf in range(len(leaf_start) - 1):
        members = order[leaf_start[leaf] : leaf_start[leaf + 1]]
        unit = np.empty((len(members), 3), np.float64)
        for i in range(len(members)):
            for axis in range(3):
                unit[i, axis] = directions[members[i], axis] / DIRECTION_ONE
        n_modes = find_modes(unit, bandwidth, modes)
        keep_largest(unit, modes[:n_modes], centre[leaf], share[leaf])


@njit(cache=True, nogil=True)
def find_modes(unit: np.ndarray, bandwidth: float, modes: np.ndarray) -> int:
    """Mean shift with a von Mises-Fisher kernel from samples evenly spread over the leaf.

    Args:
        unit: (n, 3) float64, unit vectors.
        bandwidth: Standard deviation of the kernel, as a chord.
        modes: (n_starts, 3) float64 to fill with unit vectors at least a bandwidth apart.

    Returns:
        Number of modes found.
    """
    n = len(unit)
    n_starts = min(n, len(modes))
    concentration = 1.0 / (bandwidth * bandwidth)
    n_modes = 0
    for start in range(n_starts):
        x, y, z = unit[start * n // n_starts]
        for _ in range(N_ITERATIONS):
            sx, sy, sz = 0.0, 0.0, 0.0
            for i in range(n):
                cosine = unit[i, 0] * x + unit[i, 1] * y + unit[i, 2] * z
                # Floored: denormal numbers cost ten times as much.
                weight = math.exp(max(concentration * (cosine - 1.0), -60.0))
                sx += weight * unit[i, 0]
                sy += weight * unit[i, 1]
                sz += weight * unit[i, 2]
            length = math.sqrt(sx * sx + sy * sy + sz * sz)
            if length < 1e-12:
                break
            x, y, z = sx / length, sy / length, sz / length
        is_new = True
        for mode in range(n_modes):
            dx, dy, dz = modes[mode, 0] - x, modes[mode, 1] - y, modes[mode, 2] - z
            is_new &= dx * dx + dy * dy + dz * dz > bandwidth * bandwidth
        if is_new:
            modes[n_modes, 0], modes[n_modes, 1], modes[n_modes, 2] = x, y, z
            n_modes += 1
    return n_modes


@njit(cache=True, nogil=True)
def keep_largest(unit: np.ndarray, modes: np.ndarray, centre: np.ndarray, share: np.ndarray) -> None:
    """Gives each sample to its nearest mode and writes the means of the largest groups, largest first.

    Args:
        unit: (n, 3) float64, unit vectors.
        modes: (n_modes, 3) float64, unit vectors.
        centre: (n_clusters, 3) float32 to fill.
        share: (n_clusters,) float32 to fill; the kept clusters' sum to 1. A leaf without samples stands still.
    """
    n_modes = len(modes)
    count = np.zeros(n_modes, np.int64)
    total = np.zeros((n_modes, 3), np.float64)
    for i in range(len(unit)):
        best, best_cosine = 0, -2.0
        for mode in range(n_modes):
            cosine = unit[i, 0] * modes[mode, 0] + unit[i, 1] * modes[mode, 1] + unit[i, 2] * modes[mode, 2]
            if cosine > best_cosine:
                best, best_cosine = mode, cosine
        count[best] += 1
        for axis in range(3):
            total[best, axis] += unit[i, axis]
    n_kept = 0
    for cluster in range(min(len(centre), n_modes)):
        largest = np.argmax(count)
        if count[largest] == 0:
            break
        share[cluster] = count[largest]
        n_kept += count[largest]
        for axis in range(3):
            centre[cluster, axis] = total[largest, axis] / count[largest]
        count[largest] = 0
    if n_kept == 0:
        share[0] = 1.0
        return
    for cluster in range(len(share)):
        share[cluster] /= n_kept
