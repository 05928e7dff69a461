"""Where walks start: the middle of a box that a detector gave, a pixel, or a point."""

import numpy as np
from numba import int32, njit
from numpy.typing import ArrayLike, NDArray

from forests.boxes import Box
from forests.crops import foreground_box
from forests.frames import Pinhole

N_PROBES = 9
"""The depth of a box's middle is the median over a grid of so many by so many pixels."""
MIDDLE_SHARE = 0.5
"""Share of a box's width and height that the grid spans."""


def start_point(
    depth: NDArray[np.uint16], camera: Pinhole, start: ArrayLike | None = None, box: Box | None = None
) -> NDArray[np.float32] | None:
    """The start of a walk.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.
        start: A pixel (u, v) or a point (x, y, z) in the camera frame [m].
        box: Around the upper body or the person. Without box and start: around all that the image shows.

    Returns:
        (3,) float32, camera frame [m]; None if there is nothing near the start.

    Raises:
        ValueError: Both start and box, or one of another form.
    """
    if start is not None and box is not None:
        raise ValueError("start and box are both given; one says where to start")
    if start is not None:
        place = np.asarray(start, np.float32)
        if place.shape not in ((2,), (3,)) or not np.isfinite(place).all():
            raise ValueError(f"start={start!r} must be a finite pixel (u, v) or point (x, y, z) in metres")
        if len(place) == 3:
            if place[2] <= 0:
                raise ValueError(f"start={start!r} must lie before the camera")
            return place
        u, v = float(place[0]), float(place[1])
        return _lifted(depth, camera, u, v, 0.0, 0.0)
    if box is None:
        box = foreground_box(depth)
        if box[0] == box[2]:
            return None
    left, top, right, bottom = box
    if not (np.isfinite(box).all() and left < right and top < bottom):
        raise ValueError(f"box={box} must be (left, top, right, bottom) with left < right and top < bottom")
    u, v = (left + right - 1) / 2, (top + bottom - 1) / 2
    return _lifted(depth, camera, u, v, MIDDLE_SHARE * (right - left) / 2, MIDDLE_SHARE * (bottom - top) / 2)


def seen_box(box: Box | None, camera: Pinhole, edges: NDArray[np.float32]) -> Box | None:
    """The part of a box that an image shows; None of none.

    Args:
        box: In pixels.
        camera: Intrinsics.
        edges: (4,) float32, the image's left, top, right and bottom edge as slopes: x / z and y / z.
    """
    if box is None:
        return None
    left, right = (camera.fx * float(slope) + camera.cx + 0.5 for slope in edges[::2])
    top, bottom = (camera.fy * float(slope) + camera.cy + 0.5 for slope in edges[1::2])
    seen = (max(box[0], left), max(box[1], top), min(box[2], right), min(box[3], bottom))
    return seen if seen[0] < seen[2] and seen[1] < seen[3] else None


def _lifted(
    depth: NDArray[np.uint16], camera: Pinhole, u: float, v: float, half_width: float, half_height: float
) -> NDArray[np.float32] | None:
    millimetres = _median_depth(depth, u, v, half_width, half_height)
    if millimetres == 0:
        millimetres = _nearest_depth(depth, u, v)
    if millimetres == 0:
        return None
    z = millimetres * 1e-3
    return np.array([(u - camera.cx) * z / camera.fx, (v - camera.cy) * z / camera.fy, z], np.float32)


@njit(cache=True, nogil=True)
def _median_depth(depth: np.ndarray, u: float, v: float, half_width: float, half_height: float) -> int:
    """Median of the depths that are not 0 on a grid about (u, v); 0 if there is none."""
    height, width = depth.shape
    found = np.empty(N_PROBES * N_PROBES, np.uint16)
    n = 0
    for i in range(N_PROBES):
        row = round(v + half_height * (2 * i / (N_PROBES - 1) - 1))
        for j in range(N_PROBES):
            column = round(u + half_width * (2 * j / (N_PROBES - 1) - 1))
            if 0 <= row < height and 0 <= column < width and depth[row, column] != 0:
                found[n] = depth[row, column]
                n += 1
    return int32(np.sort(found[:n])[n // 2]) if n else int32(0)


@njit(cache=True, nogil=True)
def _nearest_depth(depth: np.ndarray, u: float, v: float) -> int:
    """Depth of the pixel nearest to (u, v) that is not 0; 0 if there is none."""
    height, width = depth.shape
    best, best_distance = int32(0), np.inf
    for row in range(height):
        for column in range(width):
            if depth[row, column] != 0:
                distance = (row - v) ** 2 + (column - u) ** 2
                if distance < best_distance:
                    best, best_distance = int32(depth[row, column]), distance
    return best
