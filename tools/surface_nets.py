"""Polygonises a scalar field that is symmetric about y = 0: surface nets on the half y >= 0, thinned, mirrored.

Surface nets after Gibson (1998), "Constrained elastic surface nets", in the dual form with one vertex a cell.
"""

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

_EDGES = [(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit]


def surface_nets(
    field: NDArray[np.float32], origin: NDArray[np.float64], step: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Zero level of a field as quads split into triangles, outward where the field grows.

    Args:
        field: (nx, ny, nz) samples, negative inside, positive on the grid's border.
        origin: (3,) position of sample (0, 0, 0).
        step: Grid spacing.

    Returns:
        Vertices (n, 3) and faces (m, 3).
    """
    nx, ny, nz = field.shape
    corner = [
        field[i : nx - 1 + i, j : ny - 1 + j, k : nz - 1 + k] for k in (0, 1) for j in (0, 1) for i in (0, 1)
    ]
    inside = [c < 0 for c in corner]
    count = np.sum(inside, axis=0)
    cells = np.argwhere((count > 0) & (count < 8))
    values = np.stack([c[tuple(cells.T)] for c in corner], axis=1).astype(np.float64)
    total, crossings = np.zeros((len(cells), 3)), np.zeros(len(cells))
    for a, b in _EDGES:
        va, vb = values[:, a], values[:, b]
        crossed = (va < 0) != (vb < 0)
        t = np.where(crossed, va / np.where(crossed, va - vb, 1.0), 0.0)
        pa = np.array([a & 1, a >> 1 & 1, a >> 2 & 1], dtype=float)
        pb = np.array([b & 1, b >> 1 & 1, b >> 2 & 1], dtype=float)
        total += np.where(crossed[:, None], pa + t[:, None] * (pb - pa), 0.0)
        crossings += crossed
    vertices = origin + step * (cells + total / crossings[:, None])
    index = np.full((nx - 1, ny - 1, nz - 1), -1, dtype=np.int64)
    index[tuple(cells.T)] = np.arange(len(cells))
    faces = []
    for axis in range(3):
        low = field.take(range(field.shape[axis] - 1), axis=axis) < 0
        high = field.take(range(1, field.shape[axis]), axis=axis) < 0
        for first, flip in ((low & ~high, False), (~low & high, True)):
            at = np.argwhere(first)
            u, v = [k for k in range(3) if k != axis]
            at = at[(at[:, u] > 0) & (at[:, v] > 0)]
            du, dv = np.eye(3, dtype=int)[u], np.eye(3, dtype=int)[v]
            quad = np.stack([index[tuple((at - s).T)] for s in (du + dv, dv, 0 * du, du)], axis=1)
            if flip != (axis == 1):
                quad = quad[:, ::-1]
            faces += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
    return vertices, np.concatenate(faces)


def thinned(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], n_faces: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Fewer triangles by quadric error (Garland & Heckbert 1997), open borders kept."""
    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces))
    mesh = mesh.simplify_quadric_decimation(n_faces, boundary_weight=100.0)
    mesh.remove_degenerate_triangles()
    mesh.remove_unreferenced_vertices()
    return np.asarray(mesh.vertices).copy(), np.asarray(mesh.triangles).astype(np.int64)


def without_pinches(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], border: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_]]:
    """Splits inner edges that join two border vertices: their mirror images would share the edge."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    for a, b in unique[(counts == 2) & border[unique].all(axis=1)]:
        middle = len(vertices)
        vertices = np.vstack([vertices, 0.5 * (vertices[a] + vertices[b]) + (0.0, 0.002, 0.0)])
        border = np.append(border, False)
        touching = np.flatnonzero((faces == a).any(axis=1) & (faces == b).any(axis=1))
        second = faces[touching].copy()
        first = faces[touching].copy()
        first[first == a] = middle
        second[second == b] = middle
        faces[touching] = first
        faces = np.vstack([faces, second])
    return vertices, faces, border


def mirrored(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Closes a half surface (y >= 0, border on y = 0) by its mirror image.

    Returns:
        Vertices (first the half's, then the images of those off the plane), faces, and mirror (n,) index of each
        vertex's image.
    """
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    border = np.zeros(len(vertices), dtype=bool)
    border[unique[counts == 1].ravel()] = True
    vertices = vertices.copy()
    vertices[border, 1] = 0.0
    vertices[~border, 1] = np.maximum(vertices[~border, 1], 1e-4)
    faces = faces[~border[faces].all(axis=1)]  # slivers that lie in the plane
    vertices, faces, border = without_pinches(vertices, faces, border)
    used, faces = np.unique(faces, return_inverse=True)
    faces, vertices, border = faces.reshape(-1, 3), vertices[used], border[used]
    image = np.arange(len(vertices))
    image[~border] = len(vertices) + np.arange((~border).sum())
    full = np.concatenate([vertices, vertices[~border] * (1.0, -1.0, 1.0)])
    mirror = np.concatenate([image, np.flatnonzero(~border)])
    return full, np.concatenate([faces, image[faces][:, ::-1]]), mirror
