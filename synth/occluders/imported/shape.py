"""Triangles of others made fit for use: welded, without degenerate faces, not too many; and points on them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

MAX_FACES = 20_000
"""Meshes with more faces are reduced."""
_WELD = 1e-5
"""Vertices are one if they are within this of each other, over the mesh's size."""
_MIN_EXTENT = 1e-3
"""A mesh is flat if it is thinner than this over its size."""


class MeshError(ValueError):
    """A mesh that cannot be used; the message says why, the file's name goes before it."""


@dataclass(frozen=True)
class Triangles:
    """A mesh on its way in.

    Attributes:
        vertices: (n, 3) float64.
        faces: (m, 3) int64.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]

    def turned(self, R: NDArray[np.float64], scale: float = 1.0) -> "Triangles":
        """The mesh after a rotation (3, 3) and a scaling."""
        return Triangles(scale * self.vertices @ R.T, self.faces)

    def shifted(self, x: float, y: float, z: float) -> "Triangles":
        """The mesh after a shift."""
        return Triangles(self.vertices + np.array([x, y, z]), self.faces)


def cleaned(mesh: Triangles) -> Triangles:
    """Welds vertices and drops degenerate and double faces.

    Raises:
        MeshError: Coordinates are not finite, faces name missing vertices, or too little is left.
    """
    if not len(mesh.faces) or not len(mesh.vertices):
        raise MeshError("has no triangles")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise MeshError(f"has faces with vertex indices outside 0..{len(mesh.vertices) - 1}")
    used = np.unique(mesh.faces)
    if not np.isfinite(mesh.vertices[used]).all():
        raise MeshError("has vertex coordinates that are not finite")
    extent = np.ptp(mesh.vertices[used], axis=0)
    if not extent.min() > _MIN_EXTENT * extent.max():
        raise MeshError(f"is flat: {extent[0]:.3g} x {extent[1]:.3g} x {extent[2]:.3g}")
    out = _clustered(mesh, _WELD * float(extent.max()))
    if len(out.faces) < 4:
        raise MeshError(f"has only {len(out.faces)} triangles that are not degenerate")
    return out


def reduced(mesh: Triangles, max_faces: int = MAX_FACES) -> Triangles:
    """The mesh with at most so many faces: vertices of one cube become their mean (Rossignac and Borrel 1993).

    Args:
        mesh: In metres.
        max_faces: The cubes grow from 2 mm until there are no more.
    """
    out, cell = mesh, 0.002
    while len(out.faces) > max_faces:
        out, cell = _clustered(mesh, cell), 1.25 * cell
    return out


def _clustered(mesh: Triangles, cell: float) -> Triangles:
    used, faces = np.unique(mesh.faces, return_inverse=True)
    vertices = mesh.vertices[used]
    cells = np.floor((vertices - vertices.min(axis=0)) / cell + 0.5).astype(np.int64)
    _, first, group = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    n = np.bincount(group.ravel())
    means = np.stack([np.bincount(group.ravel(), vertices[:, k]) / n for k in range(3)], axis=1)
    means[n == 1] = vertices[first[n == 1]]
    faces = group.ravel()[faces.reshape(-1, 3)]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    edges = means[faces]
    cross = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
    faces = faces[np.linalg.norm(cross, axis=1) > 0.0]
    _, once = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return _compact(Triangles(means, faces[np.sort(once)]))


def _compact(mesh: Triangles) -> Triangles:
    used, faces = np.unique(mesh.faces, return_inverse=True)
    return Triangles(mesh.vertices[used], faces.reshape(-1, 3).astype(np.int64))


def is_closed(mesh: Triangles) -> bool:
    """Whether every part of the mesh bounds a volume and faces outwards, so that back faces are never seen."""
    a, b, c = mesh.faces.T
    n = len(mesh.vertices)
    edges = np.concatenate([a * n + b, b * n + c, c * n + a])
    back = np.concatenate([b * n + a, c * n + b, a * n + c])
    if len(np.unique(edges)) != len(edges) or not np.array_equal(np.sort(edges), np.sort(back)):
        return False
    graph = coo_array((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, c])), shape=(n, n))
    _, part = connected_components(graph, directed=False)
    p, q, r = (mesh.vertices[mesh.faces[:, k]] - mesh.vertices.mean(axis=0) for k in range(3))
    volume = np.bincount(part[a], np.einsum("ij,ij->i", p, np.cross(q, r)), minlength=part.max() + 1)
    return bool((volume > 0.0).all())


def sampled(mesh: Triangles, spacing: float) -> NDArray[np.float64]:
    """(n, 3) points all over a mesh, edges and corners too, neighbours at most `spacing` apart."""
    corners = mesh.vertices[mesh.faces]
    longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).argmax(axis=1)
    turn = (longest[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(corners, turn[:, :, None], axis=1).transpose(1, 0, 2)
    length = np.linalg.norm(b - a, axis=1)
    across = np.linalg.norm(np.cross(b - a, c - a), axis=1) / length
    steps = np.stack([np.ceil(length / spacing), np.ceil(across / spacing)], axis=1).astype(np.int64)
    kinds, kind_of = np.unique(np.maximum(steps, 1), axis=0, return_inverse=True)
    order = np.argsort(kind_of.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(kind_of.ravel()))
    points = [mesh.vertices]
    for (n, m), rows in zip(kinds, np.split(order, ends[:-1]), strict=True):
        if n == 1:
            continue  # the corners will do
        v, u = np.meshgrid(np.arange(m) / m, np.arange(n + 1) / n, indexing="ij")
        weight = np.stack([(1.0 - v) * (1.0 - u), (1.0 - v) * u, v], axis=-1).reshape(-1, 3)
        points.append(np.einsum("pk,kfi->pfi", weight, np.stack([a[rows], b[rows], c[rows]])).reshape(-1, 3))
    return np.concatenate(points)
