"""Slow, obvious twins of the random walk's kernels: one walker after the other, one decision at a time."""

import math

import numpy as np

from forests.crops import NOTHING
from forests.features import FEATURE_LIMIT_MM
from forests.hashing import hash4
from forests.rwf.tables import WEIGHT_ONE
from forests.rwf.walk import FARTHEST_M, FARTHEST_PX, NEAREST_M

ONE = np.float32


def read(depth, column, row):
    """Depth at a pixel of the image, coordinates plus one half [mm]."""
    height, width = depth.shape
    if not (0 <= column < width and 0 <= row < height):
        return int(NOTHING)
    value = int(depth[int(row), int(column)])
    return value if value else int(NOTHING)


def decide(node, unit, depth, column, row, z, fx, fy):
    """Whether a point goes to the right child."""

    def probe(offset):
        return read(depth, column + unit * fx / z * ONE(offset[0]), row + unit * fy / z * ONE(offset[1]))

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
        behind = min(z - measured, gate[1])
        kept = measured if behind < gate[0] else measured + behind
    kept = ONE(min(max(kept, ONE(NEAREST_M)), ONE(FARTHEST_M)))
    return column, row, np.array([point[0] * (kept / z), point[1] * (kept / z), kept], np.float32)


def walker(depth, intrinsics, plan, joint, seed, step, number, centre):
    """(column, row, point) of one walker about the estimate."""
    key = int(hash4(seed, 0x3A1C, joint, step))
    stride = [round(2**21 * 0.8191725133961645**power) for power in (1, 2, 3)]
    bits = [((key >> (21 * axis)) + number * stride[axis]) % 2**21 for axis in range(3)]
    share = np.array([ONE(b) * ONE(2 / 2**21) - ONE(1) for b in bits], np.float32)
    half_width = plan.scatter_m[joint] * ONE(3**0.5)
    gates = plan.gate_m[joint]
    return place(depth, np.float32(centre) + half_width * share, intrinsics, gates[(number + step) % len(gates)])


def votes(depth, intrinsics, tables, plan, joint, seed, step, centre):
    """(n, 4): the votes of one step, x, y, z and weight."""
    found = []
    for number in range(plan.n_walks[joint]):
        column, row, point = walker(depth, intrinsics, plan, joint, seed, step, number, centre)
        node = tables.root[joint, (number + step) % tables.root.shape[1]]
        while tables.nodes[node]["next"] >= 0:
            right = decide(tables.nodes[node], tables.probe_m, depth, column, row, point[2], *intrinsics[:2])
            node = tables.nodes[node]["next"] + int(right)
        for *offset, weight in tables.vote[-1 - tables.nodes[node]["next"]].astype(np.float32):
            if weight > 0:
                found.append((*(point + tables.offset_m * np.array(offset, np.float32)), weight / ONE(WEIGHT_ONE)))
    return np.array(found, np.float32)


def density(found, bandwidth_m, place):
    """Share of the votes' weight at a place: sum w exp(-d^2 / b^2) over sum w."""
    squared = ((found[:, :3].astype(np.float64) - place) ** 2).sum(axis=1)
    return (found[:, 3] * np.exp(-squared / bandwidth_m**2)).sum() / found[:, 3].astype(np.float64).sum()


def climb(found, bandwidth_m, place):
    """The mode of the votes that mean shift reaches from a place."""
    place = np.float64(place)
    for _ in range(1000):
        squared = ((found[:, :3] - place) ** 2).sum(axis=1)
        weight = found[:, 3] * np.exp(-squared / bandwidth_m**2)
        place = (weight[:, None] * found[:, :3]).sum(axis=0) / weight.sum()
    return place
