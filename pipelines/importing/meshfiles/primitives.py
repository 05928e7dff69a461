"""Meshes of the solids that a URDF may name: boxes, cylinders, spheres and capsules."""

import numpy as np
from numpy.typing import NDArray

from synth.occluders.imported.shape import Triangles

_AROUND = 32
"""Corners around a round solid."""
_BOX = np.array([
    (0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
])  # fmt: skip


def box(size: NDArray[np.float64]) -> Triangles:
    """A box about the origin with edges of a size (3,)."""
    corners = np.array([[k & 4 > 0, k & 2 > 0, k & 1 > 0] for k in range(8)], dtype=np.float64) - 0.5
    return Triangles(corners * size, _BOX)


def cylinder(radius: float, length: float) -> Triangles:
    """A cylinder about the origin along z."""
    half = 0.5 * length
    return _turned(np.array([(0.0, -half), (radius, -half), (radius, half), (0.0, half)]))


def capsule(radius: float, length: float) -> Triangles:
    """A cylinder along z with half a ball at either end; `length` is the cylinder's."""
    angle = np.linspace(-0.5 * np.pi, 0.0, _AROUND // 4 + 1)
    half = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    half[0, 0] = 0.0
    lower, upper = half - (0.0, 0.5 * length), half[::-1] * (1.0, -1.0) + (0.0, 0.5 * length)
    return _turned(np.concatenate([lower, upper if length > 0.0 else upper[1:]]))


def sphere(radius: float) -> Triangles:
    """A ball about the origin."""
    return capsule(radius, 0.0)


def _turned(profile: NDArray[np.float64]) -> Triangles:
    """A profile (n, 2) of radius and height, upwards, turned about z; its ends are on the axis."""
    phi = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    rings = profile[1:-1]
    xy = rings[:, :1, None] * np.stack([np.cos(phi), np.sin(phi)], axis=1)
    z = np.broadcast_to(rings[:, 1, None, None], (len(rings), _AROUND, 1))
    around = np.concatenate([xy, z], axis=2).reshape(-1, 3)
    n = len(around)
    vertices = np.concatenate([around, [(0.0, 0.0, profile[0, 1]), (0.0, 0.0, profile[-1, 1])]])
    a = np.arange(_AROUND)
    b = np.roll(a, -1)
    last = n - _AROUND
    faces = [
        np.stack([np.full(_AROUND, n), b, a], axis=1),
        np.stack([np.full(_AROUND, n + 1), a + last, b + last], 1),
    ]
    for first in range(0, last, _AROUND):
        low, next_low, high, next_high = a + first, b + first, a + first + _AROUND, b + first + _AROUND
        faces += [np.stack([low, next_low, next_high], axis=1), np.stack([low, next_high, high], axis=1)]
    return Triangles(vertices, np.concatenate(faces).astype(np.int64))
