"""Where walks start: the middle of a box that a detector gave, a pixel, or a point."""

import numpy as np
from numba import int32, njit
from numpy.typing import ArrayLike, NDArray

from forests.crops import foreground_box
from forests.frames import Pinhole, is_known

Box = tuple[float, float, float, float]
"""(left, top, right, bottom) [px], right and bottom excluded."""

N_PROBES = 9
"""The depth of a box's middle is the median over a grid of so many by so many pixels."""
MIDDLE_SHARE = 0.5
"""Share of a box's width and height that the grid spans."""
HEAD_M = 0.15
"""A head is sought so far to the left and right of the foreground's middle [m]."""
UPPER_M = 0.6
"""Height and width of a box around head, shoulders and torso [m]."""


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


def upper_body_box(joints: NDArray[np.float32], camera: Pinhole, margin_m: float) -> Box | None:
    """A box around joints in the image, as a detector of upper bodies gives.

    Args:
        joints: (n, 3) float32, camera frame [m], before the camera; NaN = unknown.
        camera: Intrinsics.
        margin_m: Added on each side, at the joints' mean depth [m].

    Returns:
        The box around the joints that are known; None if none is.
    """
    joints = joints[is_known(joints)]
    if not len(joints):
        return None
    z = np.maximum(joints[:, 2], 0.1)
    u = camera.fx * joints[:, 0] / z + camera.cx
    v = camera.fy * joints[:, 1] / z + camera.cy
    margin = camera.fx * margin_m / float(z.mean())
    return (
        float(u.min()) - margin,
        float(v.min()) - margin,
        float(u.max()) + margin + 1,
        float(v.max()) + margin + 1,
    )


def upper_foreground_box(depth: NDArray[np.uint16], camera: Pinhole) -> Box | None:
    """A box like that of `upper_body_box`, of a person who is cut out, where no detector gives one.

    The columns about the foreground's middle show where the head ends; from there down to the waist the middle is
    found anew. Arms held up or out do not move it much, furniture that is not cut away does.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.

    Returns:
        The box; None if the image shows nothing.
    """
    v, u = np.nonzero(depth)
    if not len(v):
        return None
    z = depth[v, u].astype(np.float64) * 1e-3
    middle, distance = float(np.median(u)), float(np.median(z))
    for _ in range(2):
        top = int(v[np.abs(u - middle) <= HEAD_M * camera.fx / distance].min(initial=int(v.max())))
        is_upper = (v >= top) & (v <= top + UPPER_M * camera.fy / distance)
        middle, distance = float(np.median(u[is_upper])), float(np.median(z[is_upper]))
    half = UPPER_M / 2 * camera.fx / distance
    return middle - half, float(top), middle + half + 1, top + UPPER_M * camera.fy / distance
