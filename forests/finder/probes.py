"""What is measured at a place of the image that may be the top of a head: depths around it, at metric offsets.

This is the normalised depth template of Jafari, Mitzel and Leibe (ICRA 2014, section III-B) with two changes: offsets
run along the floor's up and across the line of sight, so that a tilted camera sees the same; and a coarse grid around
the fine one tells what a head stands on and what is beside it.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.finder.floor import Floor
from forests.frames import Pinhole

FINE = 16
"""Rows and columns of the fine grid."""
_FINE_STEP = 0.06
_COARSE_ROWS, _COARSE_COLUMNS = 12, 9
FAR_M, NOTHING_M, OUTSIDE_M = 1.0, 1.5, 2.5
"""Depths are cut to +-FAR_M; a pixel without depth, and a place outside the image, have values of their own [m]."""
UNKNOWN_HEIGHT = -9.0
"""Stands for the height where no floor is known [m]."""
HEIGHTS = (0.3, 2.3)
"""Of tops of people above the floor [m]."""
RANGE = (0.4, 8.0)
"""Depth of places that are looked at [m]."""
GAP_M = 0.1
"""What is above a contour is at least this much farther [m]."""
INTO_M = 0.06
"""The depth of a head is taken from its upper edge to this far below [m]."""


def _probe_table() -> NDArray[np.float32]:
    fine = (np.arange(FINE) - (FINE - 1) / 2) * _FINE_STEP
    down = 0.15 - np.arange(FINE) * _FINE_STEP
    rows = [(a, b) for b in down for a in fine]
    across = (np.arange(_COARSE_COLUMNS) - (_COARSE_COLUMNS - 1) / 2) * 0.25
    rows += [(a, b) for b in 0.4 - 0.2 * np.arange(_COARSE_ROWS) for a in across]
    return np.array(rows, np.float32)


PROBES = _probe_table()
"""(n_probes, 2) float32: (to the right, upwards) from the top [m]; the first FINE * FINE are the template."""
N_FEATURES = len(PROBES) + 2
"""The probes, then height above the floor and horizontal distance [m]."""


class View(NamedTuple):
    """An image and its floor, as the kernels take them.

    Attributes:
        depth: (height, width) uint16 [mm].
        fx, fy, cx, cy: Intrinsics [px].
        up: (3,) float64, unit vector upwards, camera frame.
        height: Of the camera above the floor [m]; NaN = unknown.
    """

    depth: NDArray[np.uint16]
    fx: float
    fy: float
    cx: float
    cy: float
    up: NDArray[np.float64]
    height: float


class Top(NamedTuple):
    """A place that may be the top of a head.

    Attributes:
        x, y, z: Camera frame [m].
        ahead_x, ahead_y, ahead_z: Unit vector, level, from the camera towards it.
        distance: Along it [m].
    """

    x: float
    y: float
    z: float
    ahead_x: float
    ahead_y: float
    ahead_z: float
    distance: float


def view_of(depth: NDArray[np.uint16], camera: Pinhole, floor: Floor | None) -> View:
    """An image for the kernels; without a floor the image's up is taken for up.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Its intrinsics.
        floor: The floor; None = unknown.
    """
    intrinsics = float(camera.fx), float(camera.fy), float(camera.cx), float(camera.cy)
    if floor is None:
        return View(depth, *intrinsics, np.array([0.0, -1.0, 0.0]), math.nan)
    return View(depth, *intrinsics, np.ascontiguousarray(floor.normal), float(floor.height))


def contour(view: View) -> NDArray[np.int32]:
    """Pixels on upper edges: what is above them is farther, absent, or outside the image.

    Args:
        view: The image.

    Returns:
        (n, 3) int32: column, row, depth of what the edge belongs to [mm]; in every few columns, such that a head 5 m
        away has three.
    """
    stride = max(1, round(0.04 * view.fx / 5.0))
    return np.asarray(_contour(view, stride))


def features_at(view: View, tops: NDArray[np.int32]) -> NDArray[np.float32]:
    """All features of places.

    Args:
        view: The image.
        tops: (n, 3) int32, as `contour` gives them.

    Returns:
        (n, N_FEATURES) float32 [m].
    """
    return np.asarray(_features_at(view, np.ascontiguousarray(tops), PROBES))


@njit(cache=True, nogil=True)
def _contour(view, stride):  # type: ignore[no-untyped-def]
    depth = view.depth
    rows, columns = depth.shape
    out = np.empty((rows * ((columns + stride - 1) // stride), 3), np.int32)
    n = 0
    for v in range(rows):
        for u in range(stride // 2, columns, stride):
            d = np.int64(depth[v, u])
            if d == 0:
                continue
            above = np.int64(depth[v - 1, u]) if v > 0 else np.int64(0)
            is_edge = above == 0 or above > d + 1000 * GAP_M
            if not is_edge or d < 1000 * RANGE[0] or d > 1000 * RANGE[1]:
                continue
            inner = _depth_below(depth, u, v, d, view.fy)
            x, y, z = (u - view.cx) / view.fx * inner, (v - view.cy) / view.fy * inner, inner
            height = (x * view.up[0] + y * view.up[1] + z * view.up[2]) * 1e-3 + view.height
            # Comparisons with an unknown height are false.
            if height < HEIGHTS[0] or height > HEIGHTS[1]:
                continue
            out[n, 0], out[n, 1], out[n, 2] = u, v, inner
            n += 1
    return out[:n].copy()


@njit(cache=True, nogil=True)
def _depth_below(depth, u, v, d, fy):  # type: ignore[no-untyped-def]
    """Mean depth [mm] of the column from the edge to INTO_M below, of pixels near the last of them that has depth."""
    last = min(depth.shape[0] - 1, v + int(fy * INTO_M * 1000.0 / d))
    inner = d
    for row in range(last, v, -1):
        if depth[row, u] > 0 and abs(np.int64(depth[row, u]) - d) < 300:
            inner = np.int64(depth[row, u])
            break
    total, count = np.int64(0), 0
    for row in range(v, last + 1):
        if abs(np.int64(depth[row, u]) - inner) < 150:
            total += np.int64(depth[row, u])
            count += 1
    return total // max(1, count) if count else inner


@njit(cache=True, nogil=True)
def top_at(view, u, v, d):  # type: ignore[no-untyped-def]
    """The `Top` of a pixel and its depth [mm]."""
    z = d * 1e-3
    x, y = (u - view.cx) / view.fx * z, (v - view.cy) / view.fy * z
    rise = x * view.up[0] + y * view.up[1] + z * view.up[2]
    ax, ay, az = x - rise * view.up[0], y - rise * view.up[1], z - rise * view.up[2]
    distance = max(1e-6, math.sqrt(ax * ax + ay * ay + az * az))
    return Top(x, y, z, ax / distance, ay / distance, az / distance, distance)


@njit(cache=True, nogil=True, inline="always")
def probe(depth, fx, fy, cx, cy, x, y, z, distance):  # type: ignore[no-untyped-def]
    """How much farther than a top is what the image shows where a probe is [m].

    Plain numbers, because numba counts references to the arrays of a tuple at every call.

    Depth is [mm], then come the intrinsics [px], the probe in the camera frame [m], and the level distance of the
    top [m].
    """
    if z < 0.05:
        return OUTSIDE_M
    u, v = fx * x / z + cx + 0.5, fy * y / z + cy + 0.5
    if u < 0 or v < 0 or u >= depth.shape[1] or v >= depth.shape[0]:
        return OUTSIDE_M
    d = depth[np.uint32(v), np.uint32(u)]
    if d == 0:
        return NOTHING_M
    # The offsets are square to `ahead`, so the point seen through the pixel is this much farther along it.
    return min(FAR_M, max(-FAR_M, distance * (d * 1e-3 / z - 1.0)))


@njit(cache=True, nogil=True, inline="always")
def height_of(view, top):  # type: ignore[no-untyped-def]
    """Height of a top above the floor [m]; UNKNOWN_HEIGHT without one."""
    height = top.x * view.up[0] + top.y * view.up[1] + top.z * view.up[2] + view.height
    return UNKNOWN_HEIGHT if math.isnan(height) else height


@njit(cache=True, nogil=True, inline="always")
def across(view, top):  # type: ignore[no-untyped-def]
    """Unit vector to the right of a top, as its camera sees it, level, camera frame: ahead x up."""
    up = view.up
    x = top.ahead_y * up[2] - top.ahead_z * up[1]
    y = top.ahead_z * up[0] - top.ahead_x * up[2]
    return x, y, top.ahead_x * up[1] - top.ahead_y * up[0]


@njit(cache=True, nogil=True)
def _features_at(view, tops, probes):  # type: ignore[no-untyped-def]
    out = np.empty((len(tops), len(probes) + 2), np.float32)
    depth, fx, fy, cx, cy, up = view.depth, view.fx, view.fy, view.cx, view.cy, view.up
    for i in range(len(tops)):
        top = top_at(view, tops[i, 0], tops[i, 1], tops[i, 2])
        rx, ry, rz = across(view, top)
        for k in range(len(probes)):
            a, b = probes[k, 0], probes[k, 1]
            x, y, z = top.x + a * rx + b * up[0], top.y + a * ry + b * up[1], top.z + a * rz + b * up[2]
            out[i, k] = probe(depth, fx, fy, cx, cy, x, y, z, top.distance)
        out[i, len(probes)] = height_of(view, top)
        out[i, len(probes) + 1] = top.distance
    return out
