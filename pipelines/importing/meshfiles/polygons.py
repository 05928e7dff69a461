"""Cuts polygons into triangles: convex ones as fans, others by ear clipping."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def triangulated(vertices: Array, polygons: Sequence[Sequence[int]]) -> Ints:
    """(m, 3) triangles that cover polygons, which wind as the polygons do.

    Args:
        vertices: (n, 3).
        polygons: Vertex indices of each; those with fewer than three are left out.

    Raises:
        ValueError: An index names no vertex.
    """
    by_size: dict[int, list[Sequence[int]]] = {}
    place: dict[int, list[int]] = {}
    for k, polygon in enumerate(polygons):
        if len(polygon) >= 3:
            by_size.setdefault(len(polygon), []).append(polygon)
            place.setdefault(len(polygon), []).append(k)
    faces, order = [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)]
    for size, group in by_size.items():
        corners = np.array(group, dtype=np.int64)
        check_indices(corners, len(vertices))
        made = _fans(vertices, corners)
        faces.append(made.reshape(-1, 3))
        order.append(np.repeat(place[size], size - 2))
    return np.concatenate(faces)[np.argsort(np.concatenate(order), kind="stable")]


def cut(vertices: Array, rings: Sequence[Sequence[int]]) -> Ints:
    """(m, 3) triangles of one polygon with holes by ear clipping.

    Args:
        vertices: (n, 3).
        rings: Vertex indices of its outline, then of each hole.

    Raises:
        ValueError: An index names no vertex.
    """
    import mapbox_earcut

    around = np.array([k for ring in rings for k in ring], dtype=np.int64)
    check_indices(around, len(vertices))
    normal = _normals(vertices[np.array(rings[0])][None])[0]
    if not normal.any():
        return np.empty((0, 3), np.int64)  # no area at all
    axis = np.eye(3)[np.abs(normal).argmin()]
    u = np.cross(normal, axis)
    flat = vertices[around] @ np.stack([u, np.cross(normal, u)]).T
    flat = np.ascontiguousarray(flat - flat.mean(axis=0))
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    found = mapbox_earcut.triangulate_float64(flat, ends).reshape(-1, 3).astype(np.int64)
    faces = around[found]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    is_turned = np.cross(b - a, c - a) @ normal < 0.0
    faces[is_turned] = faces[is_turned][:, ::-1]
    return faces


def check_indices(indices: Ints, n: int) -> None:
    """Checks that indices name one of n vertices.

    Raises:
        ValueError: One does not.
    """
    if indices.size and (indices.min() < 0 or indices.max() >= n):
        bad = indices.max() if indices.max() >= n else indices.min()
        raise ValueError(f"a face names vertex {bad}, but there are {n} (counted from 0)")


def strip(corners: Ints) -> Ints:
    """(n - 2, 3) triangles of a strip of n vertices, every second one turned."""
    faces = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    faces[1::2] = faces[1::2][:, [1, 0, 2]]
    return faces


def fan(corners: Ints) -> Ints:
    """(n - 2, 3) triangles of a fan of n vertices."""
    return np.stack([np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]], axis=1)


def _fans(vertices: Array, corners: Ints) -> Ints:
    """(k, n - 2, 3) triangles of k polygons of n corners; concave ones are cut instead of fanned."""
    n = corners.shape[1]
    faces = np.stack([np.repeat(corners[:, :1], n - 2, axis=1), corners[:, 1:-1], corners[:, 2:]], axis=2)
    if n == 3:
        return faces
    points = vertices[corners]
    normal = _normals(points)
    edge = np.roll(points, -1, axis=1) - points
    turn = np.einsum("kni,ki->kn", np.cross(np.roll(edge, 1, axis=1), edge), normal)
    size = np.linalg.norm(edge, axis=2).max(axis=1) ** 2
    for row in np.flatnonzero((turn < -1e-6 * size[:, None]).any(axis=1)):
        made = cut(vertices, [corners[row]])
        if len(made) == n - 2:  # else it crosses itself, and no way to cut it is right
            faces[row] = made
    return faces


def _normals(points: Array) -> Array:
    """(k, 3) unit normals of polygons (k, n, 3) by Newell's sums; zero for those without area."""
    local = points - points[:, :1]
    normal = np.cross(local, np.roll(local, -1, axis=1)).sum(axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
