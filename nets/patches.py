"""Patches: pieces of depth images around a person, of a fixed size in metres, told relative to the distance."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.boxes import Box
from forests.frames import Pinhole

MISSING = np.int16(-32768)
"""Relative depth of a pixel where nothing is."""
FARTHEST_MM = 30_000
SAME_SURFACE_MM = 40
"""Pixels of one footprint are averaged if they lie so near to the one in its middle [mm]."""
TOP_M = 0.1
"""The patch of a body begins so far above the box [m]."""
TRUNK_M = 0.6
"""The distance of a body is that of what lies so far below the top of its box [m]."""
TRUNK_HALF_M = 0.15
"""And so far to the left and right of its middle [m]."""
HEAD_HALF_M = 0.12
"""The distance of a head is that of what lies so far from the middle of its box [m]."""

ENOUGH_PIXELS = 1024
"""A median of about so many pixels is good enough."""


class Window(NamedTuple):
    """Where a patch is cut.

    Attributes:
        u: Column of the patch's middle [px].
        v: Row of the patch's middle [px].
        distance: Of the person, along the optical axis [m].
    """

    u: float
    v: float
    distance: float


class Patch(NamedTuple):
    """What is cut.

    Attributes:
        relative: (height, width) int16, depth minus the person's distance [mm]; MISSING where nothing is.
        kind: (height, width) uint8, of the pixel in the image: 0 nothing or not told, 1 person, 2 object.
    """

    relative: NDArray[np.int16]
    kind: NDArray[np.uint8]


def body_window(depth: NDArray[np.uint16], camera: Pinhole, box: Box, height_m: float) -> Window:
    """The window of a body: as high as told, from just above its box, around the middle of the box.

    The legs may be hidden, so that the box's lower edge is not asked.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.
        box: left, top, right, bottom [px].
        height_m: Height of the window [m].

    Raises:
        ValueError: An empty box, or one in which the image shows nothing.
    """
    _check(box)
    u, top = (box[0] + box[2]) / 2.0, box[1]
    distance = _median_in(depth, box)
    for _ in range(2):
        half = TRUNK_HALF_M * camera.fx / distance
        trunk = (u - half, top, u + half + 1.0, top + TRUNK_M * camera.fy / distance)
        distance = _median_in(depth, trunk, distance)
    v = top + (height_m / 2.0 - TOP_M) * camera.fy / distance
    return Window(u, v, distance)


def head_window(depth: NDArray[np.uint16], camera: Pinhole, box: Box) -> Window:
    """The window of a head: around the middle of its box; otherwise as `body_window`."""
    _check(box)
    u, v = (box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0
    distance = _median_in(depth, box)
    half_u, half_v = HEAD_HALF_M * camera.fx / distance, HEAD_HALF_M * camera.fy / distance
    return Window(u, v, _median_in(depth, (u - half_u, v - half_v, u + half_u, v + half_v), distance))


def _check(box: Box) -> None:
    if not (all(map(math.isfinite, box)) and box[0] < box[2] and box[1] < box[3]):
        raise ValueError(
            f"box {tuple(box)} is empty: it must be (left, top, right, bottom) with right > left, bottom > top"
        )


def _median_in(depth: NDArray[np.uint16], box: Box, otherwise: float | None = None) -> float:
    """Median depth of what lies in a box [m]; of large ones, of some rows and columns."""
    height, width = depth.shape
    left, top = max(0, math.ceil(box[0])), max(0, math.ceil(box[1]))
    right, bottom = min(width, math.ceil(box[2])), min(height, math.ceil(box[3]))
    area = max(0, right - left) * max(0, bottom - top)
    step = max(1, math.isqrt(area // ENOUGH_PIXELS))
    inside = depth[top : max(top, bottom) : step, left : max(left, right) : step]
    inside = inside[inside > 0]
    if len(inside):
        return float(np.median(inside)) * 1e-3
    if otherwise is None:
        raise ValueError(f"the image shows nothing in the box {tuple(round(edge) for edge in box)}")
    return otherwise


def cut_patch(
    depth: NDArray[np.uint16],
    camera: Pinhole,
    window: Window,
    size: tuple[int, int],
    pixel_m: float,
    kind: NDArray[np.uint8] | None = None,
) -> Patch:
    """Cuts a patch; pixels outside the image are missing.

    Each pixel of the patch is the mean over its footprint in the image, of what lies on the surface in the middle.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.
        window: Where.
        size: (height, width) of the patch.
        pixel_m: Side of its pixels at the window's distance [m].
        kind: (height, width) uint8, what the image shows by pixel; None = not told.
    """
    kinds = np.zeros(depth.shape, np.uint8) if kind is None else np.ascontiguousarray(kind)
    out = Patch(np.empty(size, np.int16), np.empty(size, np.uint8))
    step_u, step_v = pixel_m * camera.fx / window.distance, pixel_m * camera.fy / window.distance
    fill_patch(
        np.ascontiguousarray(depth),
        kinds,
        window.u,
        window.v,
        step_u,
        step_v,
        round(window.distance * 1e3),
        out.relative,
        out.kind,
    )
    return out


@njit(cache=True, nogil=True)
def fill_patch(depth, kinds, u, v, step_u, step_v, distance_mm, relative, kind):  # type: ignore[no-untyped-def]
    """Kernel of `cut_patch`; fills `relative` and `kind`."""
    n_rows, n_columns = depth.shape
    height, width = relative.shape
    for r in range(height):
        at_v = v + (r - (height - 1) / 2.0) * step_v
        row = int(np.floor(at_v + 0.5))
        top = min(row, int(np.ceil(at_v - step_v / 2.0)))
        bottom = max(row + 1, int(np.ceil(at_v + step_v / 2.0)))
        for c in range(width):
            at_u = u + (c - (width - 1) / 2.0) * step_u
            column = int(np.floor(at_u + 0.5))
            left = min(column, int(np.ceil(at_u - step_u / 2.0)))
            right = max(column + 1, int(np.ceil(at_u + step_u / 2.0)))
            middle, sort = 0, np.uint8(0)
            if 0 <= row < n_rows and 0 <= column < n_columns:
                middle, sort = int(depth[row, column]), kinds[row, column]
            total, n = 0, 0
            for y in range(max(0, top), min(n_rows, bottom)):
                for x in range(max(0, left), min(n_columns, right)):
                    value = int(depth[y, x])
                    if value == 0:
                        continue
                    if middle == 0:
                        middle, sort = value, kinds[y, x]
                    if abs(value - middle) <= SAME_SURFACE_MM:
                        total += value
                        n += 1
            if n == 0:
                relative[r, c] = MISSING
                kind[r, c] = 0
            else:
                mean = (total + n // 2) // n - distance_mm
                relative[r, c] = max(-FARTHEST_MM, min(FARTHEST_MM, mean))
                kind[r, c] = sort
