"""Part: a small mesh with the solids that fill it, to be moved and put together into an occluder."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.geometry import LabelledMesh
from synth.occluders.model import Anchor, Occluder, Solids

Array = NDArray[np.float64]
SolidRow = tuple[int, Array, tuple[float, float, float]]


@dataclass(frozen=True)
class Part:
    """A piece of an object.

    Attributes:
        vertices: (n_vertices, 3) [m].
        faces: (n_faces, 3) int32, counter-clockwise seen from outside.
        kind: (n,) uint8 of its solids.
        T_part_solid: (n, 4, 4).
        size: (n, 3) [m], as in `Solids`.
        is_closed: Whether the mesh bounds a volume.
    """

    vertices: Array
    faces: NDArray[np.int32]
    kind: NDArray[np.uint8]
    T_part_solid: Array
    size: Array
    is_closed: bool = True

    def moved(self, T: ArrayLike) -> "Part":
        """The part after a rigid transform (4, 4)."""
        T = np.asarray(T, dtype=np.float64)
        vertices = self.vertices @ T[:3, :3].T + T[:3, 3]
        return Part(vertices, self.faces, self.kind, T @ self.T_part_solid, self.size, self.is_closed)

    def at(self, x: float, y: float, z: float) -> "Part":
        """The part shifted [m]."""
        shift = np.array([x, y, z])
        T = self.T_part_solid.copy()
        T[:, :3, 3] += shift
        return Part(self.vertices + shift, self.faces, self.kind, T, self.size, self.is_closed)


def joined(parts: Iterable[Part]) -> Part:
    """Several parts as one."""
    parts = list(parts)
    starts = np.cumsum([0] + [len(p.vertices) for p in parts])
    return Part(
        np.concatenate([p.vertices for p in parts]),
        np.concatenate([p.faces + np.int32(start) for p, start in zip(parts, starts, strict=False)]),
        np.concatenate([p.kind for p in parts]),
        np.concatenate([p.T_part_solid for p in parts]),
        np.concatenate([p.size for p in parts]),
        all(p.is_closed for p in parts),
    )


def occluder(class_name: str, parts: Iterable[Part], anchors: tuple[Anchor, ...] = ()) -> Occluder:
    """Puts an object together."""
    whole = joined(parts)
    label = np.zeros(len(whole.faces), dtype=np.uint8)
    mesh = LabelledMesh(whole.vertices.astype(np.float32), whole.faces, label, whole.is_closed)
    return Occluder(class_name, mesh, Solids(whole.kind, whole.T_part_solid, whole.size), anchors)


def filled(mesh: tuple[Array, NDArray[np.int32]], rows: Sequence[SolidRow], is_closed: bool = True) -> Part:
    """A part from its mesh (vertices, faces) and its solids, one row (kind, T_part_solid, size) each."""
    kinds, poses, sizes = zip(*rows, strict=True)
    size = np.array(sizes, dtype=np.float64)
    return Part(*mesh, np.array(kinds, dtype=np.uint8), np.stack(poses), size, is_closed)


def pose(centre: ArrayLike, z_axis: ArrayLike | None = None) -> Array:
    """A (4, 4) transform to a centre, with the z axis along a direction (any length)."""
    T = np.eye(4)
    T[:3, 3] = centre
    if z_axis is not None:
        z = np.asarray(z_axis, dtype=np.float64)
        z = z / np.linalg.norm(z)
        helper = (1.0, 0.0, 0.0) if abs(z[0]) < 0.9 else (0.0, 1.0, 0.0)
        y = np.cross(z, helper)
        y /= np.linalg.norm(y)
        T[:3, 0], T[:3, 1], T[:3, 2] = np.cross(y, z), y, z
    return T


def frame(origin: ArrayLike, x: ArrayLike, z: ArrayLike) -> Array:
    """A (4, 4) transform to an origin with z along `z` and x as near to `x` as that allows."""
    T = np.eye(4)
    T[:3, 3] = origin
    up = np.asarray(z, dtype=np.float64)
    up = up / np.linalg.norm(up)
    y = np.cross(up, np.asarray(x, dtype=np.float64))
    y /= np.linalg.norm(y)
    T[:3, 0], T[:3, 1], T[:3, 2] = np.cross(y, up), y, up
    return T
