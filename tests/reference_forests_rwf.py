"""Slow, obvious twins of the random walk's kernels: one walk after the other, one decision at a time."""

import math

import numpy as np

from forests.crops import NOTHING
from forests.features import FEATURE_LIMIT_MM
from forests.hashing import hash4, splitmix64, unit_float
from forests.rwf.walk import FARTHEST_M, FARTHEST_PX, NEAREST_M

ONE = np.float32


def read(depth, column, row):
    """Depth at a pixel of the image, coordinates plus one half [mm]."""
    height, width = depth.shape
    if not (0 <= column < width and 0 <= row < height):
        return int(NOTHING)
    value = int(depth[int(row), int(column)])
    return value if value else int(NOTHING)


def decide(node, depth, column, row, z, fx, fy):
    """Whether a point goes to the right child."""

    def probe(offset):
        return read(depth, column + fx / z * offset[0], row + fy / z * offset[1])

    own = int(z * ONE(1000) + ONE(0.5))
    second = own if not node["v"].any() else probe(node["v"])
    difference = np.clip(probe(node["u"]) - second, -FEATURE_LIMIT_MM, FEATURE_LIMIT_MM)
    return difference > node["threshold"]


def place(depth, point, intrinsics, gate):
    """(column, row, point): the point's pixel plus one half, and the point moved along its ray into the gate."""
    fx, fy, cx, cy = intrinsics
    z = max(point[2], ONE(NEAREST_M))
    pixel = [math.floor(f * x / z + c + ONE(0.5)) for f, x, c in ((fx, point[0], cx), (fy, point[1], cy))]
    column, row = (ONE(min(max(p, -FARTHEST_PX), FARTHEST_PX)) + ONE(0.5) for p in pixel)
    surface = read(depth, column, row)
    kept = z
    if surface != NOTHING:
        measured = ONE(surface) * ONE(1e-3)
        kept = min(max(z, measured + gate[0]), measured + gate[1])
    kept = ONE(min(max(kept, ONE(NEAREST_M)), ONE(FARTHEST_M)))
    return column, row, np.array([point[0] * (kept / z), point[1] * (kept / z), kept], np.float32)


def walk(depth, intrinsics, tables, plan, joint, seed, number, start):
    """(n_steps + 1, 3): the start in the gate, and where each step of walk `number` leads."""
    key = np.uint64(hash4(seed, 0x3A1C, joint, number))
    step = plan.step_m[joint]
    column, row, point = place(depth, np.float32(start), intrinsics, plan.gate_m[joint])
    path = [point]
    for _ in range(plan.n_steps):
        key = np.uint64(splitmix64(key))
        node = tables.root[joint, int(key & np.uint64(0xFFFF)) % tables.root.shape[1]]
        while tables.nodes[node]["leaf"] < 0:
            right = decide(tables.nodes[node], depth, column, row, point[2], *intrinsics[:2])
            node = tables.nodes[node]["left"] + int(right)
        leaf = tables.nodes[node]["leaf"]
        cluster = int(np.argmax(tables.cumulative[leaf] >= unit_float(key)))
        column, row, point = place(
            depth, point + step * tables.direction[leaf, cluster], intrinsics, plan.gate_m[joint]
        )
        path.append(point)
        step = ONE(step * plan.decay[joint])
    return np.array(path)
