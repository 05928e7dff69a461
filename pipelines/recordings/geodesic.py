"""Part labels of recorded people: every point of the surface takes the bone that is nearest along the surface."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.recordings.bones import Bones
from synth.camera import Camera

MAX_GAP_MM = 60
"""Neighbouring pixels whose depths differ by more do not touch."""
SEED_STEP_M = 0.02
"""Along a bone, one point in so many looks for the surface over it."""

Intrinsics = tuple[float, float, float, float]


def label_parts(depth: NDArray[np.uint16], bones: Bones, camera: Camera) -> NDArray[np.uint8]:
    """Part labels of a person's pixels.

    Points of each bone seed the pixel that is nearest to them within the bone's reach, at that distance; labels
    then spread along the surface (8 neighbours, steps in space, no step across a gap), the nearest first. Regions
    that no seed reaches take the nearest bone in space. Rafi et al. 2015, section 4.

    Args:
        depth: (height, width) uint16, the person alone [mm].
        bones: At least one bone.
        camera: Intrinsics.

    Returns:
        (height, width) uint8 part labels, not 0 wherever there is depth.

    Raises:
        ValueError: There is no bone.
    """
    if not len(bones.start):
        raise ValueError("there is no bone to label by")
    intrinsics = (camera.fx, camera.fy, camera.cx, camera.cy)
    points = _lift(depth, intrinsics)
    distance = np.full(depth.shape, np.inf)
    bone = np.full(depth.shape, -1, np.int16)
    _seed(points, bones, intrinsics, distance, bone)
    _spread(depth, points, distance, bone)
    return _name(depth, points, bones, bone)


@njit(cache=True, nogil=True)
def _lift(depth: NDArray[np.uint16], intrinsics: Intrinsics) -> NDArray[np.float64]:
    """(height, width, 3) points [m]; 0 where there is nothing."""
    fx, fy, cx, cy = intrinsics
    out = np.zeros((depth.shape[0], depth.shape[1], 3))
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            z = depth[v, u] * 1e-3
            out[v, u, 0] = (u - cx) * z / fx
            out[v, u, 1] = (v - cy) * z / fy
            out[v, u, 2] = z
    return out


@njit(cache=True, nogil=True)
def _seed(
    points: np.ndarray, bones: Bones, intrinsics: Intrinsics, distance: np.ndarray, bone: np.ndarray
) -> None:  # fmt: skip
    """Writes number and distance of the bones at the pixels that are nearest to their points."""
    fx, fy, cx, cy = intrinsics
    height, width = bone.shape
    for b in range(len(bones.start)):
        start, along = bones.start[b], bones.end[b] - bones.start[b]
        n = int(np.ceil(np.sqrt((along * along).sum()) / SEED_STEP_M)) + 1
        for k in range(n):
            x, y, z = start + along * (k / max(n - 1, 1))
            if z <= 0.0:
                continue
            u, v, r = fx * x / z + cx, fy * y / z + cy, bones.reach[b] * max(fx, fy) / z
            best, best_row, best_column = bones.reach[b] ** 2, -1, -1
            for row in range(max(0, int(v - r)), min(height, int(v + r) + 2)):
                for column in range(max(0, int(u - r)), min(width, int(u + r) + 2)):
                    if points[row, column, 2] == 0.0:
                        continue
                    dx, dy, dz = points[row, column, 0] - x, points[row, column, 1] - y, points[row, column, 2] - z
                    gap = dx * dx + dy * dy + dz * dz
                    if gap < best:
                        best, best_row, best_column = gap, row, column
            if best_row >= 0 and np.sqrt(best) < distance[best_row, best_column]:
                distance[best_row, best_column] = np.sqrt(best)
                bone[best_row, best_column] = b


@njit(cache=True, nogil=True)
def _push(heap: np.ndarray, keys: np.ndarray, n: int, key: float, pixel: int) -> None:
    """Adds to a binary heap of n."""
    i = n
    while i > 0 and keys[(i - 1) >> 1] > key:
        heap[i], keys[i] = heap[(i - 1) >> 1], keys[(i - 1) >> 1]
        i = (i - 1) >> 1
    heap[i], keys[i] = pixel, key


@njit(cache=True, nogil=True)
def _pop(heap: np.ndarray, keys: np.ndarray, n: int) -> None:
    """Removes the first of a binary heap of n."""
    pixel, key = heap[n - 1], keys[n - 1]
    i = 0
    while True:
        child = 2 * i + 1
        if child >= n - 1:
            break
        if child + 1 < n - 1 and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        heap[i], keys[i] = heap[child], keys[child]
        i = child
    heap[i], keys[i] = pixel, key


@njit(cache=True, nogil=True)
def _spread(depth: np.ndarray, points: np.ndarray, distance: np.ndarray, bone: np.ndarray) -> None:
    """Dijkstra's algorithm from all seeds at once."""
    height, width = depth.shape
    # A pixel is pushed at most once by itself and once by each neighbour.
    capacity = 9 * np.count_nonzero(depth) + 1
    heap, keys = np.empty(capacity, np.int64), np.empty(capacity)
    n = 0
    for pixel in range(depth.size):
        if bone[pixel // width, pixel % width] >= 0:
            _push(heap, keys, n, distance[pixel // width, pixel % width], pixel)
            n += 1
    while n:
        pixel, key = heap[0], keys[0]
        _pop(heap, keys, n)
        n -= 1
        v, u = pixel // width, pixel % width
        if key > distance[v, u]:
            continue
        for row in range(max(0, v - 1), min(height, v + 2)):
            for column in range(max(0, u - 1), min(width, u + 2)):
                if depth[row, column] == 0 or abs(np.int64(depth[row, column]) - depth[v, u]) > MAX_GAP_MM:
                    continue
                dx = points[row, column, 0] - points[v, u, 0]
                dy = points[row, column, 1] - points[v, u, 1]
                dz = points[row, column, 2] - points[v, u, 2]
                reached = key + np.sqrt(dx * dx + dy * dy + dz * dz)
                if reached < distance[row, column]:
                    distance[row, column] = reached
                    bone[row, column] = bone[v, u]
                    _push(heap, keys, n, reached, row * width + column)
                    n += 1


@njit(cache=True, nogil=True)
def _share(bones: Bones, b: int, point: np.ndarray) -> tuple[float, float, int]:
    """Where on a bone a point is nearest, as a share of its length; the squared distance [m^2]; the side of it."""
    start, along = bones.start[b], bones.end[b] - bones.start[b]
    length = (along * along).sum()
    share = 0.0
    if length > 0.0:
        share = min(max(((point - start) * along).sum() / length, 0.0), 1.0)
    gap = point - start - along * share
    side = 1 if (gap * bones.left).sum() > 0.0 else 0
    return share, (gap * gap).sum(), side


@njit(cache=True, nogil=True)
def _name(depth: np.ndarray, points: np.ndarray, bones: Bones, bone: np.ndarray) -> NDArray[np.uint8]:
    """(height, width) uint8: the part along each pixel's bone."""
    out = np.zeros(depth.shape, np.uint8)
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            if depth[v, u] == 0:
                continue
            point = points[v, u]
            b = int(bone[v, u])
            if b < 0:
                best = np.inf
                for other in range(len(bones.start)):
                    gap = _share(bones, other, point)[1]
                    if gap < best:
                        best, b = gap, other
            share, _, side = _share(bones, b, point)
            stretch = 0
            while stretch < 3 and share >= bones.cuts[b, stretch]:
                stretch += 1
            out[v, u] = bones.parts[b, side, stretch]
    return out
