"""The kernels of a walk: where a point reads the image, how it comes down a tree, where it steps."""

import math
from typing import NamedTuple

import numpy as np
from numba import float32, int32, njit, uint64
from numpy.typing import NDArray

from forests.crops import NOTHING
from forests.features import difference
from forests.hashing import hash4, splitmix64, unit_float

NEAREST_M = 0.2
FARTHEST_M = 30.0
"""A walk's depth stays between these [m]."""
FARTHEST_PX = 30000.0
"""A walk's pixel stays within this of the origin [px]: a sample's column is an int16."""
_WALK_STREAM = 0x3A1C


class WalkTables(NamedTuple):
    """All experts' trees behind one another, as the walk reads them.

    Attributes:
        nodes: (n_nodes,) of NODE_DTYPE; `left` and `leaf` count from the start of the whole arrays.
        root: (n_joints, n_trees) int32, node numbers.
        levels: (n_joints, n_trees) int32, decisions on the longest way down.
        direction: (n_leaves, n_clusters, 3) float32, cluster centres of unit vectors to the joint.
        cumulative: (n_leaves, n_clusters) float32, shares of the clusters, summed up; the last is 1 or more.
    """

    nodes: NDArray
    root: NDArray[np.int32]
    levels: NDArray[np.int32]
    direction: NDArray[np.float32]
    cumulative: NDArray[np.float32]


class WalkPlan(NamedTuple):
    """How the experts walk.

    Attributes:
        order: (n_joints,) int32, joints in the order of their walks.
        start_from: (n_joints,) int32, the joint whose estimate a walk starts from, walked before; -1 = the start
            point.
        step_m: (n_joints,) float32, length of the first step [m].
        decay: (n_joints,) float32, length of a step over that of the step before.
        n_arriving: (n_joints,) int32, first steps that the estimate does not count.
        gate_m: (n_joints, 2) float32, least and greatest depth of a walk's point behind the measured depth [m].
        n_walks: Walks of a joint, side by side.
        n_steps: Steps of a walk.
        n_clusters: Cluster centres of a leaf that a step is drawn from, the largest.
    """

    order: NDArray[np.int32]
    start_from: NDArray[np.int32]
    step_m: NDArray[np.float32]
    decay: NDArray[np.float32]
    n_arriving: NDArray[np.int32]
    gate_m: NDArray[np.float32]
    n_walks: int
    n_steps: int
    n_clusters: int


@njit(cache=True, nogil=True, inline="always")
def read_depth(depth: np.ndarray, column: float, row: float) -> int:
    """Depth at a pixel [mm]; NOTHING outside the image and where nothing is. Coordinates plus one half."""
    height, width = depth.shape
    if column < 0.0 or row < 0.0 or column >= width or row >= height:
        return int32(NOTHING)
    value = int32(depth[int32(row), int32(column)])
    return value if value != 0 else int32(NOTHING)


@njit(cache=True, nogil=True, inline="always")
def gated(z: float, surface: int, nearest: float, farthest: float) -> float:
    """Depth of a point, kept within the gate behind the measured depth, if there is any [m]."""
    if surface != NOTHING:
        measured = float32(surface) * float32(1e-3)
        z = float32(min(max(z, measured + nearest), measured + farthest))
    return float32(min(max(z, float32(NEAREST_M)), float32(FARTHEST_M)))


@njit(cache=True, nogil=True, inline="always")
def pixel_of(x: float, z: float, f: float, c: float) -> float:
    """Pixel of a point along one axis, rounded to a pixel centre, plus one half [px]."""
    place = math.floor(f * x / z + c + float32(0.5))
    return float32(min(max(place, float32(-FARTHEST_PX)), float32(FARTHEST_PX))) + float32(0.5)


@njit(cache=True, nogil=True, inline="always")
def child_of(
    nodes: np.ndarray, number: int, depth: np.ndarray, column: float, row: float, z: float, fx: float, fy: float
) -> int:
    """The node that follows; a leaf follows itself. A probe without offset reads the point's own depth."""
    node = nodes[number]
    fx_z, fy_z = fx / z, fy / z
    first = read_depth(depth, column + fx_z * node.u[0], row + fy_z * node.u[1])
    if node.v[0] == 0.0 and node.v[1] == 0.0:
        second = int32(z * float32(1e3) + float32(0.5))
    else:
        second = int32(read_depth(depth, column + fx_z * node.v[0], row + fy_z * node.v[1]))
    return node.left + int32(difference(first, second) > node.threshold)


@njit(cache=True, nogil=True)
def walk_joint(
    depth: np.ndarray, intrinsics: np.ndarray, tables: WalkTables, plan: WalkPlan, joint: int, seed: int,
    points: np.ndarray, moments: np.ndarray,
) -> None:  # fmt: skip
    """Walks towards one joint, all walks in lockstep.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        intrinsics: (4,) float32, (fx, fy, cx, cy) [px].
        tables: The experts.
        plan: How to walk.
        joint: Which expert.
        seed: Of the walks.
        points: (n_walks, 3) float32, where the walks start, camera frame [m]; where they end, on return.
        moments: (6,) float64 to fill: means of x, y, z and of their squares over all steps that count.
    """
    fx, fy, cx, cy = intrinsics[0], intrinsics[1], intrinsics[2], intrinsics[3]
    n_trees = tables.root.shape[1]
    n_walks = len(points)
    nearest, farthest = plan.gate_m[joint, 0], plan.gate_m[joint, 1]
    column, row = np.empty(n_walks, np.float32), np.empty(n_walks, np.float32)
    number, key = np.empty(n_walks, np.int32), np.empty(n_walks, np.uint64)
    moments[:] = 0.0
    for walk in range(n_walks):
        key[walk] = hash4(seed, _WALK_STREAM, joint, walk)
        place_point(depth, points[walk], fx, fy, cx, cy, nearest, farthest, column, row, walk)
    step = plan.step_m[joint]
    for step_number in range(plan.n_steps):
        levels = 0
        for walk in range(n_walks):
            key[walk] = splitmix64(key[walk])
            tree = int32(key[walk] & uint64(0xFFFF)) % n_trees
            number[walk] = tables.root[joint, tree]
            levels = max(levels, tables.levels[joint, tree])
        for _ in range(levels):
            for walk in range(n_walks):
                number[walk] = child_of(
                    tables.nodes, number[walk], depth, column[walk], row[walk], points[walk, 2], fx, fy
                )
        for walk in range(n_walks):
            leaf = tables.nodes[number[walk]].leaf
            drawn = unit_float(key[walk])
            cluster = 0
            while tables.cumulative[leaf, cluster] < drawn:
                cluster += 1
            for axis in range(3):
                points[walk, axis] += step * tables.direction[leaf, cluster, axis]
            place_point(depth, points[walk], fx, fy, cx, cy, nearest, farthest, column, row, walk)
            if step_number >= plan.n_arriving[joint]:
                for axis in range(3):
                    place = np.float64(points[walk, axis])
                    moments[axis] += place
                    moments[axis + 3] += place * place
        step *= plan.decay[joint]
    moments /= n_walks * (plan.n_steps - plan.n_arriving[joint])


@njit(cache=True, nogil=True, inline="always")
def place_point(
    depth: np.ndarray, point: np.ndarray, fx: float, fy: float, cx: float, cy: float,
    nearest: float, farthest: float, column: np.ndarray, row: np.ndarray, walk: int,
) -> None:  # fmt: skip
    """Projects a point and moves it along its ray into the gate."""
    z = max(point[2], float32(NEAREST_M))
    column[walk] = pixel_of(point[0], z, fx, cx)
    row[walk] = pixel_of(point[1], z, fy, cy)
    kept = gated(z, read_depth(depth, column[walk], row[walk]), nearest, farthest)
    point[0] *= kept / z
    point[1] *= kept / z
    point[2] = kept


@njit(cache=True, nogil=True)
def walk_skeleton(
    depth: np.ndarray, intrinsics: np.ndarray, tables: WalkTables, plan: WalkPlan, start: np.ndarray, seed: int,
    joints: np.ndarray, spread: np.ndarray,
) -> None:  # fmt: skip
    """Walks to every joint in the plan's order.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        intrinsics: (4,) float32, (fx, fy, cx, cy) [px].
        tables: The experts.
        plan: How to walk.
        start: (3,) float32, camera frame [m].
        seed: Of the walks.
        joints: (n_joints, 3) float32 to fill, expectations of the walks, camera frame [m].
        spread: (n_joints,) float32 to fill, standard deviations of the walks' steps [m].
    """
    points = np.empty((plan.n_walks, 3), np.float32)
    moments = np.empty(6, np.float64)
    for joint in plan.order:
        parent = plan.start_from[joint]
        for axis in range(3):
            points[:, axis] = start[axis] if parent < 0 else joints[parent, axis]
        walk_joint(depth, intrinsics, tables, plan, joint, seed, points, moments)
        variance = 0.0
        for axis in range(3):
            joints[joint, axis] = moments[axis]
            variance += max(moments[axis + 3] - moments[axis] * moments[axis], 0.0)
        spread[joint] = math.sqrt(variance)
