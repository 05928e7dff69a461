"""Clusters of the offsets in a tree's leaves, by mean shift."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.growing import GrownTree
from forests.modes import WeightedPoints, find_modes

N_STARTS = 8
"""Mean shift starts from so many of a leaf's samples, evenly spread over them."""


def leaf_clusters(
    grown: GrownTree, offsets: NDArray[np.float32], n_clusters: int, bandwidth_m: float
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Clusters every leaf's offsets.

    Args:
        grown: A tree and where its samples ended.
        offsets: (n_samples, 3) float32, from the samples to the joint [m].
        n_clusters: Clusters kept a leaf.
        bandwidth_m: b of the kernel exp(-d^2 / b^2) [m].

    Returns:
        Means (n_leaves, n_clusters, 3) float32 of the offsets nearest to a mode [m]; shares (n_leaves, n_clusters)
        float32, falling, summing to 1, 0 where there is no further cluster; spreads (n_leaves, n_clusters) float32,
        standard deviations about the means [m].
    """
    n_leaves = len(grown.leaf_start) - 1
    mean = np.zeros((n_leaves, n_clusters, 3), np.float32)
    share = np.zeros((n_leaves, n_clusters), np.float32)
    spread = np.zeros((n_leaves, n_clusters), np.float32)
    _cluster_leaves(grown.leaf_start, grown.order, offsets, bandwidth_m, mean, share, spread)
    return mean, share, spread


@njit(cache=True, nogil=True)
def _cluster_leaves(
    leaf_start: np.ndarray, order: np.ndarray, offsets: np.ndarray, bandwidth_m: float,
    mean: np.ndarray, share: np.ndarray, spread: np.ndarray,
) -> None:  # fmt: skip
    modes = np.empty((N_STARTS, 5), np.float64)
    for leaf in range(len(leaf_start) - 1):
        members = order[leaf_start[leaf] : leaf_start[leaf + 1]]
        n = len(members)
        points = WeightedPoints(np.empty(n), np.empty(n), np.empty(n), np.ones(n))
        for i in range(n):
            points.x[i], points.y[i], points.z[i] = offsets[members[i]]
        n_modes = find_modes(points, bandwidth_m, N_STARTS, modes)
        keep_largest(points, modes[:n_modes], mean[leaf], share[leaf], spread[leaf])


@njit(cache=True, nogil=True)
def keep_largest(
    points: WeightedPoints, modes: np.ndarray, mean: np.ndarray, share: np.ndarray, spread: np.ndarray
) -> None:
    """Gives each point to its nearest mode and describes the largest groups, largest first.

    Args:
        points: (n,) points; their weights are not read.
        modes: (n_modes, 3 or more) float64, places [m].
        mean: (n_clusters, 3) float32, zeros, to fill [m].
        share: (n_clusters,) float32, zeros, to fill; the kept clusters' sum to 1. A leaf without points has one
            cluster, at 0.
        spread: (n_clusters,) float32, zeros, to fill [m].
    """
    n_modes = len(modes)
    count = np.zeros(n_modes, np.int64)
    total, squares = np.zeros((n_modes, 3), np.float64), np.zeros(n_modes, np.float64)
    for i in range(len(points.x)):
        best, least = 0, np.inf
        for mode in range(n_modes):
            dx, dy, dz = points.x[i] - modes[mode, 0], points.y[i] - modes[mode, 1], points.z[i] - modes[mode, 2]
            squared = dx * dx + dy * dy + dz * dz
            if squared < least:
                best, least = mode, squared
        count[best] += 1
        total[best, 0] += points.x[i]
        total[best, 1] += points.y[i]
        total[best, 2] += points.z[i]
        squares[best] += points.x[i] ** 2 + points.y[i] ** 2 + points.z[i] ** 2
    n_kept = 0
    for cluster in range(min(len(mean), n_modes)):
        largest = np.argmax(count)
        n = count[largest]
        if n == 0:
            break
        share[cluster] = n
        n_kept += n
        variance = squares[largest] / n
        for axis in range(3):
            mean[cluster, axis] = total[largest, axis] / n
            variance -= (total[largest, axis] / n) ** 2
        spread[cluster] = math.sqrt(max(variance, 0.0))
        count[largest] = 0
    if n_kept == 0:
        share[0] = 1.0
        return
    for cluster in range(len(share)):
        share[cluster] /= n_kept
