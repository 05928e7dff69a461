"""Slow twins of prediction: one pixel at a time, all votes, float64, the kernel's exact exponential."""

import numpy as np

from forests.frames import Pinhole
from forests.oarf.model import ForestTree, OARFModel


def read(depth: np.ndarray, column: float, row: float) -> int:
    """Depth at a place rounded to the nearest pixel [mm]; 65535 where nothing is and outside."""
    u, v = int(np.floor(column + 0.5)), int(np.floor(row + 0.5))
    if not (0 <= u < depth.shape[1] and 0 <= v < depth.shape[0]):
        return 65535
    return int(depth[v, u]) or 65535


def leaf_of(tree: ForestTree, depth: np.ndarray, camera: Pinhole, column: int, row: int) -> int:
    """The leaf that a pixel reaches, by the definition of a node."""
    z = depth[row, column] * 1e-3
    at = 0
    while tree.nodes["leaf"][at] < 0:
        (ux, uy), (vx, vy) = tree.nodes["u"][at], tree.nodes["v"][at]
        one = read(depth, column + camera.fx / z * ux, row + camera.fy / z * uy)
        two = read(depth, column + camera.fx / z * vx, row + camera.fy / z * vy)
        at = tree.nodes["left"][at] + (np.clip(one - two, -2000, 2000) > tree.nodes["threshold"][at])
    return int(tree.nodes["leaf"][at])


def point_of(depth: np.ndarray, camera: Pinhole, column: int, row: int) -> np.ndarray:
    """(3,) a pixel in the camera frame [m]."""
    z = depth[row, column] * 1e-3
    return np.array([(column - camera.cx) * z / camera.fx, (row - camera.cy) * z / camera.fy, z])


def votes_of(
    model: OARFModel, depth: np.ndarray, camera: Pinhole, pixels: list[tuple[int, int]]
) -> list[list[tuple[np.ndarray, float, int]]]:
    """By joint the votes (place [m], weight, layer) of pixels (column, row)."""
    votes: list[list[tuple[np.ndarray, float, int]]] = [[] for _ in model.labels.joints]
    tables = [tree.leaves.unpacked() for tree in model.trees]
    for column, row in pixels:
        q = point_of(depth, camera, column, row)
        for tree, table in zip(model.trees, tables, strict=True):
            leaf = leaf_of(tree, depth, camera, column, row)
            for layer, joint, k in np.ndindex(table.weight.shape[1:]):
                offset, weight = table.vote[leaf, layer, joint, k], table.weight[leaf, layer, joint, k]
                if weight > 0 and np.linalg.norm(offset) <= model.tuning.max_offset_m[joint]:
                    votes[joint].append((q + offset, weight * q[2] ** 2, layer))
    return votes


def densities(at: np.ndarray, places: np.ndarray, weights: np.ndarray, bandwidth: float) -> np.ndarray:
    """(n,) equation 6 at (n, 3) places."""
    squares = ((at[:, None] - places[None]) ** 2).sum(axis=2)
    return (weights * np.exp(-squares / bandwidth**2)).sum(axis=1)


def best_mode(places: np.ndarray, weights: np.ndarray, bandwidth: float, n_starts: int = 10) -> np.ndarray:
    """(3,) the densest mode: mean shift over all votes from those of them where the density is highest."""
    density = densities(places, places, weights, bandwidth)
    modes = []
    for start in np.argsort(-density, kind="stable")[:n_starts]:
        x = places[start]
        for _ in range(500):
            kernel = weights * np.exp(-((x - places) ** 2).sum(axis=1) / bandwidth**2)
            following = (kernel[:, None] * places).sum(axis=0) / kernel.sum()
            step = np.linalg.norm(following - x)
            x = following
            if step < 1e-7:
                break
        modes.append(x)
    found = np.array(modes)
    return found[densities(found, places, weights, bandwidth).argmax()]
