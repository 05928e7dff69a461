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


MIN_CELL_POINTS = 6
"""A height with fewer points borrows from its neighbours."""


def fill_profile(profiles: Profiles, i: int, local: NDArray[np.float64]) -> None:
    """Fits profile i, in place, to skin points in the segment's frame.

    Args:
        profiles: The tables.
        i: Segment.
        local: (n, 3) points [m].
    """
    order = np.sort(local[:, 2])
    margin = int(0.005 * len(order))
    low, high = float(order[margin]), float(order[-1 - margin])
    profiles.low[i], profiles.high[i] = low, high
    _fill(local, low, high, profiles.centre[i], profiles.radius[i])
    profiles.bound[i] = float((np.hypot(*profiles.centre[i].T) + profiles.radius[i].max(axis=1)).max())


@njit(cache=True, nogil=True)
def _fill(
    local: NDArray[np.float64],
    low: float,
    high: float,
    centre: NDArray[np.float64],
    radius: NDArray[np.float64],
) -> None:
    """Mean radius of the points in each cell of height and direction; empty cells take their neighbours'."""
    n_heights, n_directions = radius.shape
    step = max(high - low, 1e-6) / (n_heights - 1)
    row = np.empty(local.shape[0], dtype=np.int64)
    n_of_row = np.zeros(n_heights, dtype=np.int64)
    for p in range(local.shape[0]):
        row[p] = min(max(int(np.rint((local[p, 2] - low) / step)), 0), n_heights - 1)
        n_of_row[row[p]] += 1
    near = np.empty(local.shape[0], dtype=np.int64)
    total = np.empty(n_directions)
    count = np.empty(n_directions, dtype=np.int64)
    for h in range(n_heights):
        reach = 0
        wanted = min(MIN_CELL_POINTS, local.shape[0])
        while np.sum(n_of_row[max(h - reach, 0) : h + reach + 1]) < wanted:
            reach += 1
        n_near = 0
        for p in range(local.shape[0]):
            if abs(row[p] - h) <= reach:
                near[n_near] = p
                n_near += 1
        for k in range(2):
            least, most = np.inf, -np.inf
            for p in near[:n_near]:
                least = min(least, local[p, k])
                most = max(most, local[p, k])
            centre[h, k] = 0.5 * (least + most)
        total[:] = 0.0
        count[:] = 0
        for p in near[:n_near]:
            x = local[p, 0] - centre[h, 0]
            y = local[p, 1] - centre[h, 1]
            d = int(np.rint(np.arctan2(y, x) / (2.0 * np.pi) * n_directions)) % n_directions
            total[d] += np.sqrt(x * x + y * y)
            count[d] += 1
        _spread_round(total, count, radius[h])


@njit(cache=True, nogil=True)
def _spread_round(total: NDArray[np.float64], count: NDArray[np.int64], out: NDArray[np.float64]) -> None:
    """Means of the cells of a ring; between known cells linear in the direction."""
    n = total.shape[0]
    for d in range(n):
        before = 0
        while count[(d - before) % n] == 0:
            before += 1
        after = 0
        while count[(d + after) % n] == 0:
            after += 1
        i = (d - before) % n
        j = (d + after) % n
        share = before / (before + after) if before + after > 0 else 0.0
        out[d] = (1.0 - share) * total[i] / count[i] + share * total[j] / count[j]


@njit(cache=True, nogil=True)
def spread_points(points: NDArray[np.float64], n: int) -> NDArray[np.int64]:
    """Indices of at most n points spread evenly: farthest point sampling from the first."""
    if points.shape[0] <= n:
        return np.arange(points.shape[0])
    chosen = np.zeros(n, dtype=np.int64)
    nearest = np.full(points.shape[0], np.inf)
    for k in range(1, n):
        best = -1.0
        for p in range(points.shape[0]):
            distance = 0.0
            for axis in range(3):
                distance += (points[p, axis] - points[chosen[k - 1], axis]) ** 2
            nearest[p] = min(nearest[p], distance)
            if nearest[p] > best:
                best = nearest[p]
                chosen[k] = p
    return chosen


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
