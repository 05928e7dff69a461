"""Signed distances from points to the solids of an object.

Each solid's distance is exact (formulas as in Quilez, "Distance functions", iquilezles.org). That of the union is
the smallest of them: exact outside, inside a lower bound on the depth to the union's surface.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from synth.occluders.model import BOX, CAPSULE, CYLINDER, Solids

FASTMATH = {"contract", "arcp", "nsz", "reassoc"}


class PlacedSolids(NamedTuple):
    """Solids posed in the world, as the kernels eat them.

    Attributes:
        kind: (n,) uint8.
        T_solid_world: (n, 3, 4) float64, upper rows of the transforms.
        size: (n, 3) float64 [m].
        centre: (n, 3) float64, world [m].
        radius: (n,) float64, of the bounding sphere round the centre [m].
    """

    kind: NDArray[np.uint8]
    T_solid_world: NDArray[np.float64]
    size: NDArray[np.float64]
    centre: NDArray[np.float64]
    radius: NDArray[np.float64]


def solid_distances(
    solids: Solids, T_world_object: ArrayLike, points: ArrayLike, max_distance: float = np.inf
) -> NDArray[np.float64]:
    """Distance of every point to the union of an object's solids.

    Args:
        solids: The object's volume.
        T_world_object: (4, 4) pose of the object.
        points: (n, 3) world frame [m].
        max_distance: Points farther than this get this value, which saves time [m].

    Returns:
        (n,) float64 signed distance [m], negative inside.
    """
    xyz = _checked_points(points)
    placed = place(solids, T_world_object)
    out = np.empty(len(xyz))
    _union_distances(xyz, placed, float(max_distance), out)
    return out


def nearest_point(
    solids: Solids, T_world_object: ArrayLike, points: ArrayLike, max_distance: float = np.inf
) -> tuple[float, int]:
    """The point that is nearest to, or deepest in, an object's solids.

    Faster than the smallest of `solid_distances`, because a point stops counting once another is nearer. Of
    points that are equally near, any may be returned.

    Args:
        solids: The object's volume.
        T_world_object: (4, 4) pose of the object.
        points: (n, 3) world frame [m].
        max_distance: Points farther than this are not looked at [m].

    Returns:
        (signed distance [m], index of the point); (max_distance, -1) if no point is nearer than max_distance.
    """
    xyz = _checked_points(points)
    placed = place(solids, T_world_object)
    distance, index = _nearest(xyz, placed, float(max_distance))
    return float(distance), int(index)


def is_any_nearer(placed: PlacedSolids, points: ArrayLike, distance: float) -> bool:
    """Whether any point is nearer to the union of posed solids than a signed distance.

    Faster than `nearest_point`: it ends at the first such point, and a point outside a solid's box, grown by the
    distance, or shrunk if that is negative, is not looked at.

    Args:
        placed: The solids.
        points: (n, 3) world frame [m].
        distance: [m], negative inside.
    """
    return bool(_any_nearer(_checked_points(points), placed, float(distance)))


def bounding_radii(solids: Solids) -> NDArray[np.float64]:
    """(n,) radius of the sphere round each solid's centre that holds it [m]."""
    size = solids.size
    box = np.linalg.norm(size, axis=1)
    cylinder = np.hypot(size[:, 0], size[:, 2])
    capsule = size[:, 0] + size[:, 2]
    return np.where(solids.kind == BOX, box, np.where(solids.kind == CYLINDER, cylinder, capsule))


def _checked_points(points: ArrayLike) -> NDArray[np.float64]:
    xyz = np.ascontiguousarray(points, dtype=np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3:
        raise ValueError(f"points have shape {xyz.shape}, must be (n, 3)")
    return xyz


def place(solids: Solids, T_world_object: ArrayLike) -> PlacedSolids:
    """Poses an object's solids in the world.

    Args:
        solids: The object's volume.
        T_world_object: (4, 4) pose of the object.
    """
    T_world_solid = np.asarray(T_world_object, dtype=np.float64) @ solids.T_object_solid
    centre = np.ascontiguousarray(T_world_solid[:, :3, 3])
    T_solid_world = np.empty((len(centre), 3, 4))
    R = T_world_solid[:, :3, :3].transpose(0, 2, 1)
    T_solid_world[:, :, :3] = R
    T_solid_world[:, :, 3] = -(R @ centre[:, :, None])[:, :, 0]
    return PlacedSolids(solids.kind, T_solid_world, solids.size, centre, bounding_radii(solids))


@njit(cache=True, nogil=True, fastmath=FASTMATH, inline="always")
def _distance(kind, size, x, y, z):  # type: ignore[no-untyped-def]
    """Signed distance [m] of a point, in the solid's frame, to one solid."""
    if kind == BOX:
        qx = abs(x) - size[0]
        qy = abs(y) - size[1]
        qz = abs(z) - size[2]
        inside = min(max(qx, qy, qz), 0.0)
        qx, qy, qz = max(qx, 0.0), max(qy, 0.0), max(qz, 0.0)
        return np.sqrt(qx * qx + qy * qy + qz * qz) + inside
    rho2 = x * x + y * y
    qz = abs(z) - size[2]
    if kind == CYLINDER:
        qr = np.sqrt(rho2) - size[0]
        inside = min(max(qr, qz), 0.0)
        qr, qz = max(qr, 0.0), max(qz, 0.0)
        return np.sqrt(qr * qr + qz * qz) + inside
    qz = max(qz, 0.0)
    return np.sqrt(rho2 + qz * qz) - size[0]


@njit(cache=True, nogil=True, fastmath=FASTMATH, inline="always")
def point_distance(point, placed, bound):  # type: ignore[no-untyped-def]
    """Distance of one point to the union, or `bound` if it is not below it."""
    px, py, pz = point[0], point[1], point[2]
    best = bound
    for k in range(len(placed.kind)):
        dx = px - placed.centre[k, 0]
        dy = py - placed.centre[k, 1]
        dz = pz - placed.centre[k, 2]
        reach = best + placed.radius[k]
        if reach <= 0.0 or dx * dx + dy * dy + dz * dz >= reach * reach:
            continue
        T = placed.T_solid_world[k]
        x = T[0, 0] * px + T[0, 1] * py + T[0, 2] * pz + T[0, 3]
        y = T[1, 0] * px + T[1, 1] * py + T[1, 2] * pz + T[1, 3]
        z = T[2, 0] * px + T[2, 1] * py + T[2, 2] * pz + T[2, 3]
        best = min(best, _distance(placed.kind[k], placed.size[k], x, y, z))
    return best


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def _bounds(placed, margin):  # type: ignore[no-untyped-def]
    """Corners of the axis-aligned box round all bounding spheres, grown by the margin."""
    low = np.full(3, np.inf)
    high = np.full(3, -np.inf)
    for k in range(len(placed.radius)):
        for axis in range(3):
            low[axis] = min(low[axis], placed.centre[k, axis] - placed.radius[k] - margin)
            high[axis] = max(high[axis], placed.centre[k, axis] + placed.radius[k] + margin)
    return low, high


@njit(cache=True, nogil=True, fastmath=FASTMATH, inline="always")
def _is_outside(point, low, high):  # type: ignore[no-untyped-def]
    x, y, z = point[0], point[1], point[2]
    return x < low[0] or x > high[0] or y < low[1] or y > high[1] or z < low[2] or z > high[2]


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def _union_distances(points, placed, max_distance, out):  # type: ignore[no-untyped-def]
    low, high = _bounds(placed, max_distance)
    for i in range(len(points)):
        out[i] = max_distance
        if not _is_outside(points[i], low, high):
            out[i] = point_distance(points[i], placed, max_distance)


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def _nearest(points, placed, max_distance):  # type: ignore[no-untyped-def]
    best = max_distance
    best_idx = -1
    # A first look at every 16th point gives a bound that lets the second pass skip most of the others.
    for stride in (16, 1):
        low, high = _bounds(placed, best)
        for i in range(0, len(points), stride):
            if _is_outside(points[i], low, high):
                continue
            distance = point_distance(points[i], placed, best)
            if distance < best:
                best = distance
                best_idx = i
    return best, best_idx


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def solid_boxes(placed):  # type: ignore[no-untyped-def]
    """(n, 3), (n, 3) corners of an axis-aligned box round each solid; a cylinder counts as the box round it."""
    low = np.empty((len(placed.kind), 3))
    high = np.empty((len(placed.kind), 3))
    for k in range(len(placed.kind)):
        for axis in range(3):
            half = placed.size[k, 0] if placed.kind[k] == CAPSULE else 0.0
            for j in range(3):
                half += abs(placed.T_solid_world[k, j, axis]) * placed.size[k, j]
            low[k, axis] = placed.centre[k, axis] - half
            high[k, axis] = placed.centre[k, axis] + half
    return low, high


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def _any_nearer(points, placed, distance):  # type: ignore[no-untyped-def]
    low, high = solid_boxes(placed)
    x, y, z = _inside_all(points, low, high, distance)
    for k in range(len(low)):
        x0, y0, z0 = low[k, 0] - distance, low[k, 1] - distance, low[k, 2] - distance
        x1, y1, z1 = high[k, 0] + distance, high[k, 1] + distance, high[k, 2] + distance
        # Counted first, which needs no branches and is done for several points at once; most solids have none.
        n_near = 0
        for i in range(len(x)):
            n_near += (x[i] >= x0) & (x[i] <= x1) & (y[i] >= y0) & (y[i] <= y1) & (z[i] >= z0) & (z[i] <= z1)
        if n_near == 0:
            continue
        T = placed.T_solid_world[k]
        for i in range(len(x)):
            px, py, pz = x[i], y[i], z[i]
            if px < x0 or px > x1 or py < y0 or py > y1 or pz < z0 or pz > z1:
                continue
            qx = T[0, 0] * px + T[0, 1] * py + T[0, 2] * pz + T[0, 3]
            qy = T[1, 0] * px + T[1, 1] * py + T[1, 2] * pz + T[1, 3]
            qz = T[2, 0] * px + T[2, 1] * py + T[2, 2] * pz + T[2, 3]
            if _distance(placed.kind[k], placed.size[k], qx, qy, qz) < distance:
                return True
    return False


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def _inside_all(points, low, high, margin):  # type: ignore[no-untyped-def]
    """x, y and z of the points in the box round boxes (n, 3), each grown by a margin."""
    least = np.full(3, np.inf)
    most = np.full(3, -np.inf)
    for k in range(len(low)):
        for axis in range(3):
            least[axis] = min(least[axis], low[k, axis] - margin)
            most[axis] = max(most[axis], high[k, axis] + margin)
    kept = np.empty((3, len(points)))
    n = 0
    for i in range(len(points)):
        if not _is_outside(points[i], least, most):
            for axis in range(3):
                kept[axis, n] = points[i, axis]
            n += 1
    return kept[0, :n], kept[1, :n], kept[2, :n]
