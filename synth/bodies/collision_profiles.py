"""Profiles: a segment's radius over height and direction about its bone, and how deep a point lies in one."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

N_HEIGHTS = 14
N_DIRECTIONS = 24


class Profiles(NamedTuple):
    """Radius tables of all segments, for kernels.

    Attributes:
        link: (n_segments,) index of the link whose frame a profile lives in.
        low: (n_segments,) lowest z [m].
        high: (n_segments,) highest z [m].
        centre: (n_segments, n_heights, 2) x and y of the axis [m].
        radius: (n_segments, n_heights, n_directions) [m].
        bound: (n_segments,) greatest distance of the skin from the frame's z axis [m].
    """

    link: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    centre: NDArray[np.float64]
    radius: NDArray[np.float64]
    bound: NDArray[np.float64]


def fill_profile(profiles: Profiles, i: int, local: NDArray[np.float64]) -> None:
    """Mean radius of the points in each cell of height and direction; empty cells take their neighbours'."""
    low, high = np.quantile(local[:, 2], [0.005, 0.995])
    profiles.low[i], profiles.high[i] = low, high
    step = max(high - low, 1e-6) / (N_HEIGHTS - 1)
    row = np.clip(np.rint((local[:, 2] - low) / step), 0, N_HEIGHTS - 1).astype(int)
    for h in range(N_HEIGHTS):
        slab = local[np.abs(row - h) <= (0 if np.count_nonzero(row == h) >= 6 else 2)]
        slab = slab if len(slab) >= 6 else local
        profiles.centre[i, h] = 0.5 * (slab[:, :2].min(axis=0) + slab[:, :2].max(axis=0))
        offset = slab[:, :2] - profiles.centre[i, h]
        turn = np.arctan2(offset[:, 1], offset[:, 0]) / (2 * np.pi) * N_DIRECTIONS
        col = np.rint(turn).astype(int) % N_DIRECTIONS
        count = np.bincount(col, minlength=N_DIRECTIONS)
        total = np.bincount(col, weights=np.hypot(offset[:, 0], offset[:, 1]), minlength=N_DIRECTIONS)
        known = np.flatnonzero(count)
        profiles.radius[i, h] = np.interp(
            np.arange(N_DIRECTIONS), known, total[known] / count[known], period=N_DIRECTIONS
        )

    profiles.bound[i] = float((np.hypot(*profiles.centre[i].T) + profiles.radius[i].max(axis=1)).max())


@njit(cache=True, nogil=True)
def depth_in_profile(profiles: Profiles, i: int, x: float, y: float, z: float) -> float:
    """How deep a point of the segment's frame lies inside its profile [m]; negative outside."""
    low = profiles.low[i]
    high = profiles.high[i]
    n_heights = profiles.radius.shape[1]
    n_directions = profiles.radius.shape[2]
    ends = min(z - low, high - z)
    if ends <= 0.0:
        return ends
    at = (z - low) / (high - low) * (n_heights - 1)
    h = min(int(at), n_heights - 2)
    f = at - h
    dx = x - (1.0 - f) * profiles.centre[i, h, 0] - f * profiles.centre[i, h + 1, 0]
    dy = y - (1.0 - f) * profiles.centre[i, h, 1] - f * profiles.centre[i, h + 1, 1]
    turn = np.arctan2(dy, dx) / (2.0 * np.pi) * n_directions
    if turn < 0.0:
        turn += n_directions
    d = int(turn)
    e = turn - d
    d %= n_directions
    d1 = (d + 1) % n_directions
    lower = (1.0 - e) * profiles.radius[i, h, d] + e * profiles.radius[i, h, d1]
    upper = (1.0 - e) * profiles.radius[i, h + 1, d] + e * profiles.radius[i, h + 1, d1]
    return min(ends, (1.0 - f) * lower + f * upper - np.sqrt(dx * dx + dy * dy))


@njit(cache=True, nogil=True)
def worst_depth(
    profiles: Profiles,
    T_world_link: NDArray[np.float64],
    points: NDArray[np.float32],
    allowed: NDArray[np.float64],
) -> tuple[float, int, int]:
    """Largest depth beyond the allowed one [m], and the point and segment where."""
    worst = -1.0
    worst_point = 0
    worst_segment = 0
    for i in range(profiles.link.shape[0]):
        T = T_world_link[profiles.link[i]]
        low = profiles.low[i]
        high = profiles.high[i]
        bound2 = profiles.bound[i] ** 2
        for p in range(points.shape[0]):
            if allowed[p, i] < 0.0:
                continue
            dx = points[p, 0] - T[0, 3]
            dy = points[p, 1] - T[1, 3]
            dz = points[p, 2] - T[2, 3]
            z = T[0, 2] * dx + T[1, 2] * dy + T[2, 2] * dz
            if z < low or z > high:
                continue
            x = T[0, 0] * dx + T[1, 0] * dy + T[2, 0] * dz
            y = T[0, 1] * dx + T[1, 1] * dy + T[2, 1] * dz
            if x * x + y * y > bound2:
                continue
            excess = depth_in_profile(profiles, i, x, y, z) - allowed[p, i]
            if excess > worst:
                worst = excess
                worst_point = p
                worst_segment = i
    return worst, worst_point, worst_segment
