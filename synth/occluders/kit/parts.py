"""Part: a small mesh with the solids that fill it, to be moved and put together into an occluder."""

import math
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
    if z_axis is not None:
        x, y, z = (float(value) for value in np.asarray(z_axis))
        length = math.sqrt(x * x + y * y + z * z)
        return frame(centre, (1.0, 0.0, 0.0) if abs(x) < 0.9 * length else (0.0, 1.0, 0.0), (x, y, z))
    T = np.eye(4)
    T[:3, 3] = centre
    return T


def frame(origin: ArrayLike, x: ArrayLike, z: ArrayLike) -> Array:
    """A (4, 4) transform to an origin with z along `z` and x as near to `x` as that allows."""
    up = unit(z)
    y = unit(cross(up, x))
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = cross(y, up), y, up, origin
    return T


def unit(a: ArrayLike) -> tuple[float, float, float]:
    """A 3-vector at length one; in plain floats, which for one vector is several times faster than numpy."""
    x, y, z = np.asarray(a, dtype=np.float64).tolist()
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def cross(a: ArrayLike, b: ArrayLike) -> tuple[float, float, float]:
    """Cross product of two 3-vectors, in plain floats as in `unit`."""
    ax, ay, az = np.asarray(a, dtype=np.float64).tolist()
    bx, by, bz = np.asarray(b, dtype=np.float64).tolist()
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
