"""Slow, obvious twins of the finder's kernels, and simple scenes made by casting rays."""

import math

import numpy as np

from forests.finder.floor import Floor
from forests.finder.probes import FAR_M, GAP_M, HEIGHTS, NOTHING_M, OUTSIDE_M, PROBES, RANGE, UNKNOWN_HEIGHT
from forests.frames import Intrinsics

CAMERA = Intrinsics(182.0, 182.0, 127.5, 105.5)
SIZE = (212, 256)


def rays(camera=CAMERA, size=SIZE):
    v, u = np.mgrid[: size[0], : size[1]]
    return np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(size)], axis=-1)


def cast(floor, ellipsoids=(), levels=(), wall=None, far=8.0):
    """(height, width) uint16 depth [mm] of a floor, ellipsoids, level rectangles and a wall, all in the floor frame.

    Ellipsoids are (centre, radii), level rectangles (x0, x1, y0, y1, z), the wall is x = wall.
    """
    T = floor.T_floor_camera
    start, way = T[:3, 3], rays() @ T[:3, :3].T
    depth = np.full(SIZE, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for x0, x1, y0, y1, z in (*levels, (-99, 99, -99, 99, 0.0)):
            t = (z - start[2]) / way[..., 2]
            x, y = start[0] + t * way[..., 0], start[1] + t * way[..., 1]
            is_hit = (t > 0.1) & (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
            depth = np.where(is_hit, np.minimum(depth, t), depth)
        if wall is not None:
            t = (wall - start[0]) / way[..., 0]
            depth = np.where(t > 0.1, np.minimum(depth, t), depth)
        for centre, radii in ellipsoids:
            o, d = (start - np.array(centre)) / radii, way / radii
            a, b, c = (d * d).sum(axis=-1), (d * o).sum(axis=-1), float(o @ o) - 1.0
            t = (-b - np.sqrt(b * b - a * c)) / a
            depth = np.where(t > 0.1, np.fmin(depth, t), depth)
    return np.where(depth < far, np.round(1000 * np.where(depth < far, depth, 0)), 0).astype(np.uint16)


def figure(x, y, tall=1.75):
    """Ellipsoids of a person who stands at (x, y) of the floor frame and looks along -x."""
    s = tall / 1.75
    return [
        ((x, y, 1.63 * s), (0.095 * s, 0.075 * s, 0.12 * s)),
        ((x, y, 1.45 * s), (0.06 * s, 0.06 * s, 0.12 * s)),
        ((x, y, 1.38 * s), (0.09 * s, 0.20 * s, 0.07 * s)),
        ((x, y, 1.17 * s), (0.12 * s, 0.17 * s, 0.30 * s)),
        ((x, y, 0.95 * s), (0.12 * s, 0.16 * s, 0.16 * s)),
        *(((x, y + side * 0.24 * s, 1.1 * s), (0.05 * s, 0.05 * s, 0.32 * s)) for side in (-1, 1)),
        *(((x, y + side * 0.09 * s, 0.46 * s), (0.075 * s, 0.075 * s, 0.47 * s)) for side in (-1, 1)),
    ]


def standing(pitch=0.15, height=1.4):
    return Floor.of_camera(pitch, height)


def slow_contour(depth, camera, floor, stride):
    """{(column, row)} of upper edges, without the filter of heights where there is no floor."""
    found = set()
    for u in range(stride // 2, depth.shape[1], stride):
        for v in range(depth.shape[0]):
            d = int(depth[v, u])
            above = int(depth[v - 1, u]) if v else 0
            if d and (not above or above > d + 1000 * GAP_M) and 1000 * RANGE[0] <= d <= 1000 * RANGE[1]:
                found.add((u, v))
    return found


def slow_feature(depth, camera, floor, top, k):
    """One feature of a pixel and its depth [m], by whole vectors."""
    u, v, d = (int(value) for value in top)
    z = d / 1000
    point = np.array([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z])
    up = np.array([0.0, -1.0, 0.0]) if floor is None else floor.normal
    if k == len(PROBES):
        return UNKNOWN_HEIGHT if floor is None else up @ point + floor.height
    level = point - (up @ point) * up
    distance = np.linalg.norm(level)
    if k > len(PROBES):
        return distance
    ahead = level / distance
    probe = point + PROBES[k, 0] * np.cross(ahead, up) + PROBES[k, 1] * up
    if probe[2] < 0.05:
        return OUTSIDE_M
    column = math.floor(camera.fx * probe[0] / probe[2] + camera.cx + 0.5)
    row = math.floor(camera.fy * probe[1] / probe[2] + camera.cy + 0.5)
    if not (0 <= row < depth.shape[0] and 0 <= column < depth.shape[1]):
        return OUTSIDE_M
    if depth[row, column] == 0:
        return NOTHING_M
    seen = probe * (depth[row, column] / 1000 / probe[2])
    return float(np.clip((seen - point) @ ahead, -FAR_M, FAR_M))


def slow_height(camera, floor, top):
    z = top[2] / 1000
    point = np.array([(top[0] - camera.cx) / camera.fx * z, (top[1] - camera.cy) / camera.fy * z, z])
    return floor.normal @ point + floor.height


def is_tall(height):
    return HEIGHTS[0] <= height <= HEIGHTS[1]


def slow_score(features, trees):
    """Sum of the trees' answers over the features of one place; -inf once it is too low."""
    total = np.float32(0)
    for t in range(len(trees.feature)):
        node = 0
        for _ in range(3):
            is_left = features[trees.feature[t, node]] <= trees.threshold[t, node]
            node = 2 * node + (1 if is_left else 2)
        total = np.float32(total + trees.answer[t, node - 7])
        if total < trees.floor_of[t]:
            return -np.inf
    return float(total)
