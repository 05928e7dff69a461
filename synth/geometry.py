"""Meshes and rigid transforms shared by bodies, occluders and the renderer."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class LabelledMesh:
    """Triangles with one label a face.

    Attributes:
        vertices: (n_vertices, 3) float32 [m].
        faces: (n_faces, 3) int32, counter-clockwise seen from outside.
        face_label: (n_faces,) uint8; body part 1..31, or 0 for objects, whose class is one for the mesh.
        is_closed: Whether the surface bounds a volume, so that back faces may be culled.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    face_label: NDArray[np.uint8]
    is_closed: bool

    def __post_init__(self) -> None:
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 3:
            raise ValueError(f"vertices have shape {self.vertices.shape}, must be (n, 3)")
        if self.faces.ndim != 2 or self.faces.shape[1] != 3:
            raise ValueError(f"faces have shape {self.faces.shape}, must be (m, 3)")
        if self.face_label.shape != (len(self.faces),):
            raise ValueError(f"face_label has shape {self.face_label.shape}, must be ({len(self.faces)},)")

    def transformed(self, T: ArrayLike) -> "LabelledMesh":
        """Moves the mesh by a rigid transform.

        Args:
            T: (4, 4) T_new_old.
        """
        vertices = transform_points(T, self.vertices).astype(np.float32)
        return LabelledMesh(vertices, self.faces, self.face_label, self.is_closed)


def transform_points(T: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
    """Applies T_a_b to points in b.

    Args:
        T: (4, 4) rigid transform.
        points: (..., 3) [m].

    Returns:
        (..., 3) float64, frame a [m].
    """
    matrix = np.asarray(T, dtype=np.float64)
    return np.asarray(points, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


@njit(cache=True, nogil=True)
def extent(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners (3,), (3,) of the axis-aligned box round points (n, 3); infinite and crossed if there are none.

    As the smallest and largest along the first axis, which numpy takes forty times as long for.
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(points.shape[0]):
        for axis in range(3):
            low[axis] = min(low[axis], points[i, axis])
            high[axis] = max(high[axis], points[i, axis])
    return low, high


@njit(cache=True, nogil=True)
def within(points: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.int64]:
    """(m,) indices of those of the points (n, 3) that lie in an axis-aligned box or on its border."""
    out = np.empty(points.shape[0], np.int64)
    n = 0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if low[0] <= x <= high[0] and low[1] <= y <= high[1] and low[2] <= z <= high[2]:
            out[n] = i
            n += 1
    return out[:n]


def inverse(T: ArrayLike) -> NDArray[np.float64]:
    """Inverse of a rigid transform (4, 4)."""
    matrix = np.asarray(T, dtype=np.float64)
    out = np.eye(4)
    out[:3, :3] = matrix[:3, :3].T
    out[:3, 3] = -matrix[:3, :3].T @ matrix[:3, 3]
    return out


def translation(x: float, y: float, z: float) -> NDArray[np.float64]:
    """A (4, 4) transform that only moves [m]."""
    T = np.eye(4)
    T[:3, 3] = (x, y, z)
    return T


def axis_angle(axis: ArrayLike, angle: float) -> NDArray[np.float64]:
    """A (3, 3) rotation by Rodrigues' formula.

    Args:
        axis: (3,) unit vector.
        angle: [rad], right-handed about the axis.
    """
    x, y, z = np.asarray(axis, dtype=np.float64)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def rotation_about(axis: ArrayLike, angle: float) -> NDArray[np.float64]:
    """A (4, 4) transform that only turns, by `axis_angle`."""
    T = np.eye(4)
    T[:3, :3] = axis_angle(axis, angle)
    return T


def look_at(eye: ArrayLike, target: ArrayLike, roll: float = 0.0) -> NDArray[np.float64]:
    """Pose T_world_camera of a camera in OpenCV axes whose z axis points at a target; world z is up.

    Args:
        eye: (3,) camera centre, world [m].
        target: (3,) point on the optical axis, world [m]; not straight above or below the eye.
        roll: turn about the optical axis [rad].
    """
    eye = np.asarray(eye, dtype=np.float64)
    z = np.asarray(target, dtype=np.float64) - eye
    z /= np.linalg.norm(z)
    x = np.cross(z, (0.0, 0.0, 1.0))
    norm = np.linalg.norm(x)
    if norm < 1e-9:
        raise ValueError(f"target {np.asarray(target)} lies straight above or below the camera at {eye}")
    x /= norm
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1) @ axis_angle((0.0, 0.0, 1.0), roll)
    T[:3, 3] = eye
    return T


def surface_points(mesh: LabelledMesh, spacing: float) -> NDArray[np.float64]:
    """Points spread over the faces of a mesh, one in each cube of half the spacing; no randomness.

    Args:
        mesh: The mesh.
        spacing: Wanted distance between neighbours [m]; a face is cut into at most 64 strips.

    Returns:
        (n, 3) float64 [m].
    """
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    edges = corners - np.roll(corners, 1, axis=1)
    n_strips = np.clip(np.ceil(np.linalg.norm(edges, axis=2).max(axis=1) / spacing), 1, 64).astype(np.int64)
    points = [mesh.vertices.astype(np.float64)]
    for n in np.unique(n_strips[n_strips > 1]):  # of smaller faces the corners will do
        a, b, c = corners[n_strips == n].transpose(1, 0, 2)
        i, j = np.nonzero(np.add.outer(np.arange(n), np.arange(n)) < n)
        u, v = ((i + 1.0 / 3.0) / n)[:, None, None], ((j + 1.0 / 3.0) / n)[:, None, None]
        points.append((a + u * (b - a) + v * (c - a)).reshape(-1, 3))
    return thinned(np.concatenate(points), 0.5 * spacing)


def thinned(points: NDArray[np.float64], cell: float) -> NDArray[np.float64]:
    """The first point of each cubic cell that holds any, in the points' order.

    Args:
        points: (n, 3) [m].
        cell: Side of the cells [m].
    """
    cells = np.floor(points / cell).astype(np.int64) + 2**20
    keys = (cells[:, 0] << 42) + (cells[:, 1] << 21) + cells[:, 2]
    return points[_first_of_each(keys)]


@njit(cache=True, nogil=True)
def _first_of_each(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """(m,) where each of the different keys (n,) stands first, in rising order; a hash table with open addresses."""
    size = 8
    while size < 2 * keys.shape[0]:
        size *= 2
    at = np.full(size, -1, np.int64)
    out = np.empty(keys.shape[0], np.int64)
    n = 0
    for i in range(keys.shape[0]):
        slot = ((keys[i] * np.int64(0x9E3779B97F4A7C15 - 2**64)) >> np.int64(32)) & (size - 1)
        while at[slot] >= 0 and keys[at[slot]] != keys[i]:
            slot = (slot + 1) & (size - 1)
        if at[slot] < 0:
            at[slot] = i
            out[n] = i
            n += 1
    return out[:n]
