"""Smoothing and averaging over triangle meshes, for `make_template.py`."""

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy import sparse


def neighbours(n: int, faces: NDArray[np.int64]) -> sparse.csr_matrix:
    """(n, n) row-normalised adjacency."""
    e = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    a = sparse.coo_matrix((np.ones(2 * len(e)), (np.r_[e[:, 0], e[:, 1]], np.r_[e[:, 1], e[:, 0]])), shape=(n, n))
    a = (a.tocsr() > 0).astype(float)
    return sparse.diags(1.0 / np.maximum(np.asarray(a.sum(axis=1)).ravel(), 1)) @ a


def largest_piece(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Drops specks that hang free of the body."""
    _, piece = sparse.csgraph.connected_components(neighbours(len(vertices), faces))
    main = np.bincount(piece).argmax()
    kept = np.flatnonzero(piece == main)
    index = np.full(len(vertices), -1)
    index[kept] = np.arange(len(kept))
    return vertices[kept], index[faces[(piece[faces] == main).all(axis=1)]]


def is_closed(faces: NDArray[np.int64]) -> bool:
    """Whether every edge has two faces."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())


def taubin(vertices: NDArray[np.float64], faces: NDArray[np.int64], n_rounds: int) -> NDArray[np.float64]:
    """Smooths without shrinking (Taubin 1995); the border stays in its plane."""
    mean = neighbours(len(vertices), faces)
    in_plane = np.abs(vertices[:, 1]) < 1e-6
    for _ in range(n_rounds):
        for factor in (0.5, -0.53):
            vertices = vertices + factor * (mean @ vertices - vertices)
            vertices[in_plane, 1] = 0.0
    return vertices


def softened(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], share: NDArray[np.float64], n_rounds: int
) -> NDArray[np.float64]:
    """Levels the seams out where share is 1; the border stays in its plane."""
    mean = neighbours(len(vertices), faces)
    in_plane = np.abs(vertices[:, 1]) < 1e-6
    for _ in range(n_rounds):
        vertices = vertices + 0.5 * share[:, None] * (mean @ vertices - vertices)
        vertices[in_plane, 1] = 0.0
    return vertices


def mean_value_matrix(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> sparse.csr_matrix:
    """(n, n) averages over neighbours with mean value weights (Floater 2003), which keep linear fields."""
    n = len(vertices)
    total = sparse.csr_matrix((n, n))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        v, j, k = faces[:, a], faces[:, b], faces[:, c]
        u, w = vertices[j] - vertices[v], vertices[k] - vertices[v]
        ru, rw = np.linalg.norm(u, axis=1), np.linalg.norm(w, axis=1)
        cosine = np.clip((u * w).sum(axis=1) / np.maximum(ru * rw, 1e-12), -0.98, 1.0)
        half_tan = np.tan(0.5 * np.arccos(cosine))
        for to, r in ((j, ru), (k, rw)):
            total = total + sparse.coo_matrix((half_tan / np.maximum(r, 1e-4), (v, to)), shape=(n, n)).tocsr()
    sums = np.asarray(total.sum(axis=1)).ravel()
    alone = sparse.diags((sums == 0).astype(float))
    return (sparse.diags(1.0 / np.where(sums > 0, sums, 1.0)) @ total + alone).tocsr()


def relaxed(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    fine: tuple[NDArray[np.float64], NDArray[np.int64]],
    n_rounds: int,
) -> NDArray[np.float64]:
    """Moves vertices along the fine surface toward their neighbours' centre, for rounder triangles."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(fine[0].astype(np.float32)), o3d.core.Tensor(fine[1].astype(np.uint32)))
    edges, counts = np.unique(
        np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0, return_counts=True
    )
    free = np.ones(len(vertices), dtype=bool)
    free[edges[counts == 1].ravel()] = False
    mean = neighbours(len(vertices), faces)
    for _ in range(n_rounds):
        moved = vertices + 0.35 * (mean @ vertices - vertices)
        onto = scene.compute_closest_points(o3d.core.Tensor(moved.astype(np.float32)))["points"].numpy()
        vertices = np.where(free[:, None], onto, vertices)
    return vertices


def _angle_at(p: NDArray[np.float64], q: NDArray[np.float64], r: NDArray[np.float64]) -> float:
    """Angle of the corner p of the triangle p, q, r [rad]."""
    u, v = q - p, r - p
    return float(np.arccos(np.clip(u @ v / max(np.sqrt((u @ u) * (v @ v)), 1e-15), -1.0, 1.0)))


def flipped(vertices: NDArray[np.float64], faces: NDArray[np.int64], n_rounds: int) -> NDArray[np.int64]:
    """Swaps inner edges whose opposite angles sum to more than 180 degrees (Delaunay), where the surface is flat.

    Args:
        vertices: (n, 3) [m].
        faces: (m, 3).
        n_rounds: How often all edges are looked at.
    """
    faces = faces.copy()
    for _ in range(n_rounds):
        owner: dict[tuple[int, int], tuple[int, int]] = {}
        for f, (a, b, c) in enumerate(faces.tolist()):
            owner |= {(a, b): (f, c), (b, c): (f, a), (c, a): (f, b)}
        touched = np.zeros(len(faces), dtype=bool)
        n_flips = 0
        for (a, b), (f, c) in list(owner.items()):
            if a > b or (b, a) not in owner or (c, other := owner[b, a][1]) in owner or (other, c) in owner:
                continue
            g, d = owner[b, a]
            if touched[f] or touched[g]:
                continue
            pa, pb, pc, pd = vertices[[a, b, c, d]]
            if _angle_at(pc, pa, pb) + _angle_at(pd, pa, pb) < np.pi + 0.05:
                continue
            normals = [np.cross(pb - pa, pc - pa), np.cross(pa - pb, pd - pb)]
            normals += [np.cross(pd - pc, pb - pc), np.cross(pa - pc, pd - pc)]
            if (
                min(m @ n / max(np.linalg.norm(m) * np.linalg.norm(n), 1e-15) for m in normals for n in normals)
                < 0.7
            ):
                continue
            faces[f], faces[g] = (c, d, b), (c, a, d)
            touched[f] = touched[g] = True
            n_flips += 1
        if n_flips == 0:
            break
    return faces
