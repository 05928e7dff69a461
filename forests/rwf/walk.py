"""The kernels of a walk: where walkers read the image, how they come down a tree, where their votes gather."""

import math

import numpy as np
from numba import float32, int32, njit, uint64

from forests.crops import NOTHING
from forests.hashing import hash4
from forests.modes import quick_climb, quick_sums
from forests.rwf.descend import descend
from forests.rwf.model import WalkPlan
from forests.rwf.tables import WEIGHT_ONE, WalkTables

NEAREST_M = 0.2
FARTHEST_M = 30.0
"""A walk's depth stays between these [m]."""
FARTHEST_PX = 30000.0
"""A walk's pixel stays within this of the origin [px]: a sample's column is an int16."""
N_STARTS, N_LAST_STARTS = 6, 24
"""Votes whose density is looked at after a step, and after the last one; evenly spread over all votes. The densest
climbs to a mode."""
APART = 1.0
"""Votes nearer to a mode than this do not climb to another one, in bandwidths."""
_WALK_STREAM = 0x3A1C
_UNIT_BITS = 21
"""Bits of a hash that place the first walker along one axis."""
_STRIDES = tuple(round(2**_UNIT_BITS / 1.2207440846057596**power) for power in (1, 2, 3))
"""From one walker to the next along the axes, round and round: walkers cover the cube evenly (the R sequence of three
dimensions, Roberts 2018), and one hash places all of them."""
_HALF_WIDTH = 3.0**0.5
"""Of a uniform distribution, in standard deviations."""


@njit(cache=True, nogil=True, inline="always")
def read_depth(depth: np.ndarray, column: float, row: float) -> int:
    """Depth at a pixel [mm]; NOTHING outside the image and where nothing is. Coordinates plus one half."""
    height, width = depth.shape
    if column < 0.0 or row < 0.0 or column >= width or row >= height:
        return int32(NOTHING)
    value = int32(depth[int32(row), int32(column)])
    return value if value != 0 else int32(NOTHING)


@njit(cache=True, nogil=True, inline="always")
def gated(z: float, surface: int, snap: float, farthest: float) -> float:
    """Depth of a point: on the surface or behind it, where there is one [m].

    A point that would lie less than `snap` behind the surface is put on it, and none lies farther than `farthest`
    behind it.
    """
    if surface != NOTHING:
        measured = float32(surface) * float32(1e-3)
        behind = min(z - measured, farthest)
        z = measured if behind < snap else float32(measured + behind)
    return float32(min(max(z, float32(NEAREST_M)), float32(FARTHEST_M)))


@njit(cache=True, nogil=True, inline="always")
def pixel_of(x: float, z: float, f: float, c: float) -> float:
    """Pixel of a point along one axis, rounded to a pixel centre, plus one half [px]."""
    place = math.floor(f * x / z + c + float32(0.5))
    return float32(min(max(place, float32(-FARTHEST_PX)), float32(FARTHEST_PX))) + float32(0.5)


@njit(cache=True, nogil=True)
def walk_joint(
    depth: np.ndarray, intrinsics: np.ndarray, tables: WalkTables, plan: WalkPlan, joint: int, seed: int,
    start: np.ndarray, votes: np.ndarray, ends: np.ndarray,
) -> int:  # fmt: skip
    """Walks towards one joint: walkers gather about the estimate and vote, and it moves to where most votes are.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        intrinsics: (4,) float32, (fx, fy, cx, cy) [px].
        tables: The experts.
        plan: How to walk.
        joint: Which expert.
        seed: Of the walkers' places.
        start: (3,) float32, where the walk starts, camera frame [m].
        votes: (n_walks[joint] * n_steps * n_clusters or more, 4) float32 to fill: x, y, z [m], weight.
        ends: (n_ends, 4) float32 to fill: modes of the votes, camera frame [m], and the share of the votes' weight
            that is there, falling; NaN and 0 where there are no more.

    Returns:
        Number of votes that count in the end.
    """
    n_trees, n_clusters = tables.root.shape[1], tables.vote.shape[1]
    unit, one = tables.offset_m, float32(1.0 / WEIGHT_ONE)
    n_walks = plan.n_walks[joint]
    point, number = np.empty((n_walks, 3), np.float32), np.empty(n_walks, np.int32)
    column, row = np.empty(n_walks, np.float32), np.empty(n_walks, np.float32)
    ends[0, :3] = start
    n_votes = 0
    for step in range(plan.n_steps):
        _place_walkers(depth, intrinsics, plan, joint, seed, step, ends[0], point, column, row)
        for walk in range(n_walks):
            number[walk] = tables.root[joint, (walk + step) % n_trees]
        descend(depth, intrinsics, tables, point, column, row, number)
        if step <= plan.n_arriving[joint]:
            n_votes = 0
        for walk in range(n_walks):
            for cluster in range(n_clusters):
                vote = tables.vote[number[walk], cluster]
                if vote[3] == 0:
                    break
                for axis in range(3):
                    votes[n_votes, axis] = point[walk, axis] + float32(vote[axis]) * unit
                votes[n_votes, 3] = float32(vote[3]) * one
                n_votes += 1
        is_last = step == plan.n_steps - 1
        n_ends, n_starts = (len(ends), N_LAST_STARTS) if is_last else (1, N_STARTS)
        gather(votes[:n_votes], plan.bandwidth_m[joint], n_starts, ends[:n_ends])
    return n_votes


@njit(cache=True, nogil=True, inline="always")
def _place_walkers(
    depth: np.ndarray, intrinsics: np.ndarray, plan: WalkPlan, joint: int, seed: int, step: int, centre: np.ndarray,
    point: np.ndarray, column: np.ndarray, row: np.ndarray,
) -> None:  # fmt: skip
    """Puts the walkers about the estimate, in the gate, and projects them."""
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    gate = plan.gate_m[joint]
    half_width = plan.scatter_m[joint] * float32(_HALF_WIDTH)
    key = uint64(hash4(seed, _WALK_STREAM, joint, step))
    for walk in range(len(point)):
        for axis in range(3):
            place = (key >> uint64(_UNIT_BITS * axis)) + uint64(walk) * uint64(_STRIDES[axis])
            share = float32(place & uint64(2**_UNIT_BITS - 1)) * float32(2.0 / 2**_UNIT_BITS) - float32(1.0)
            point[walk, axis] = centre[axis] + half_width * share
        snap, farthest = gate[(walk + step) % len(gate)]
        place_point(depth, point[walk], fx, fy, cx, cy, snap, farthest, column, row, walk)


@njit(cache=True, nogil=True)
def gather(votes: np.ndarray, bandwidth_m: float, n_starts: int, ends: np.ndarray) -> None:
    """The densest modes of weighted votes.

    Args:
        votes: (n, 4) float32, x, y, z [m] and weight, above 0.
        bandwidth_m: b of the kernel [m].
        n_starts: Votes that may climb, at most.
        ends: (n_ends, 4) float32 to fill: places [m], and densities as shares of all weight, falling; NaN and 0
            where there are no more.
    """
    n = len(votes)
    cells = np.empty((4, n), np.float32)
    scale, total = float32(1.0) / float32(bandwidth_m), 0.0
    for i in range(n):
        for axis in range(3):
            cells[axis, i] = votes[i, axis] * scale
        cells[3, i] = votes[i, 3]
        total += votes[i, 3]
    n_starts = min(n, n_starts)
    density = np.empty(n_starts, np.float64)
    for k in range(n_starts):
        at = k * n // n_starts
        density[k] = quick_sums(cells, cells[0, at], cells[1, at], cells[2, at])[0]
    modes = np.empty((len(ends) + 1, 4), np.float64)
    n_modes = 0
    for _ in range(n_starts):
        best = np.argmax(density)
        if density[best] < 0.0 or n_modes == len(ends):
            break
        density[best] = -1.0
        n_modes = quick_climb(cells, best * n // n_starts, modes, n_modes)
        for k in range(n_starts):
            at = k * n // n_starts
            gap = 0.0
            for axis in range(3):
                gap += (cells[axis, at] - modes[n_modes - 1, axis]) ** 2
            if gap < APART**2:
                density[k] = -1.0
    for end in range(len(ends)):
        if end >= n_modes:
            ends[end, :3] = np.nan
            ends[end, 3] = 0.0
            continue
        best = np.argmax(modes[:n_modes, 3])
        for axis in range(3):
            ends[end, axis] = modes[best, axis] * bandwidth_m
        ends[end, 3] = modes[best, 3] / total
        modes[best, 3] = -1.0


@njit(cache=True, nogil=True, inline="always")
def place_point(
    depth: np.ndarray, point: np.ndarray, fx: float, fy: float, cx: float, cy: float,
    snap: float, farthest: float, column: np.ndarray, row: np.ndarray, walk: int,
) -> None:  # fmt: skip
    """Projects a point and moves it along its ray into the gate."""
    z = max(point[2], float32(NEAREST_M))
    column[walk] = pixel_of(point[0], z, fx, cx)
    row[walk] = pixel_of(point[1], z, fy, cy)
    kept = gated(z, read_depth(depth, column[walk], row[walk]), snap, farthest)
    point[0] *= kept / z
    point[1] *= kept / z
    point[2] = kept


@njit(cache=True, nogil=True)
def walk_skeleton(
    depth: np.ndarray, intrinsics: np.ndarray, tables: WalkTables, plan: WalkPlan, start: np.ndarray, seed: int,
    edges: np.ndarray, ends: np.ndarray, said: np.ndarray,
) -> None:  # fmt: skip
    """Walks to every joint in the plan's order.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        intrinsics: (4,) float32, (fx, fy, cx, cy) [px].
        tables: The experts.
        plan: How to walk.
        start: (3,) float32, camera frame [m].
        seed: Of the walkers' places.
        edges: (4,) float32, the image's left, top, right and bottom edge as slopes: x / z and y / z.
        ends: (n_joints, n_ends, 4) float32 to fill, as of `walk_joint`.
        said: (n_joints, 3) float32 to fill, what `describe_votes` says of the votes about the first ends.
    """
    votes = np.empty((plan.n_walks.max() * plan.n_steps * tables.vote.shape[1], 4), np.float32)
    for joint in plan.order:
        parent = plan.start_from[joint]
        place = start if parent < 0 else ends[parent, 0, :3]
        n = walk_joint(depth, intrinsics, tables, plan, joint, seed, place, votes, ends[joint])
        describe_votes(votes[:n], ends[joint, 0], edges, said[joint])


@njit(cache=True, nogil=True)
def describe_votes(votes: np.ndarray, place: np.ndarray, edges: np.ndarray, out: np.ndarray) -> None:
    """Says how sure votes are.

    Args:
        votes: (n, 4) float32, x, y, z [m] and weight, above 0.
        place: (3 or more,) float32, where they lead [m].
        edges: (4,) float32, the image's left, top, right and bottom edge as slopes: x / z and y / z.
        out: (3,) float32 to fill: their standard deviation about the place [m], their mean weight, and the share of
            their weight that lies outside the image.
    """
    total, squares, outside = 0.0, 0.0, 0.0
    for i in range(len(votes)):
        x, y, z, weight = votes[i, 0], votes[i, 1], votes[i, 2], votes[i, 3]
        squared = (x - place[0]) ** 2 + (y - place[1]) ** 2 + (z - place[2]) ** 2
        is_inside = x >= edges[0] * z and y >= edges[1] * z and x <= edges[2] * z and y <= edges[3] * z
        total += weight
        squares += weight * squared
        outside += 0.0 if is_inside else weight
    out[0], out[1], out[2] = math.sqrt(squares / total), total / len(votes), outside / total
