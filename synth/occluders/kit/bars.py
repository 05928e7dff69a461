"""Bars, tyres and cloth: parts that follow a path or a grid, each with solids within 1 cm."""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.occluders.kit.parts import Array, Part, SolidRow, cross, filled, frame, pose
from synth.occluders.kit.shapes import TOLERANCE, box, circle, loft, n_sides
from synth.occluders.model import BOX, CAPSULE

END = 0.6
"""How far a capsule's end is drawn back from a bar's flat end, in radii; both then differ by 0.6 radii at most."""


def tube(path: ArrayLike, radius: float, sides: int = 8) -> Part:
    """A round bar along a path (n, 3) [m] that lies roughly in a plane, with flat ends."""
    points = np.asarray(path, dtype=np.float64)
    tangent = _tangents(points)
    normal = _plane_normal(points)
    across = normal - (tangent @ normal)[:, None] * tangent
    across /= np.linalg.norm(across, axis=1)[:, None]
    other = _crosses(tangent, across)
    section = circle(sides)
    # At a bend the rings are cut at the mitre, which widens them in the bend's plane.
    step = np.diff(points, axis=0)
    step /= np.linalg.norm(step, axis=1)[:, None]
    widen = np.ones(len(points))
    widen[1:-1] = 1 / np.maximum(np.einsum("ij,ij->i", step[1:], tangent[1:-1]), 0.6)
    rings = points[:, None] + radius * (
        section[None, :, :1] * across[:, None] + section[None, :, 1:] * (widen[:, None] * other)[:, None]
    )
    return filled(loft(rings), _capsules(simplified(points, TOLERANCE / 2), radius))


def rod(start: ArrayLike, end: ArrayLike, radius: float, sides: int = 8) -> Part:
    """A straight round bar between two points, with flat ends."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    T = pose((a + b) / 2, b - a)
    half = math.dist(a, b) / 2
    ring = radius * (circle(sides) @ T[:3, :2].T)
    along = half * T[:3, 2]
    rings = T[:3, 3] + np.stack([ring - along, ring + along])
    return filled(loft(rings), [(CAPSULE, T, (radius, radius, half - min(END * radius, 0.9 * half)))])


def tyre(radius: float, thickness: float) -> Part:
    """A torus about the z axis whose outer radius is `radius` and whose section has the diameter `thickness`."""
    r = thickness / 2
    R = radius - r
    n, m = n_sides(radius), 8
    phi = np.arange(n) * (2 * np.pi / n)
    theta = (np.arange(m) + 0.5) * (2 * np.pi / m)
    rho = R + r * np.cos(theta)
    points = np.empty((n, m, 3))
    points[..., 0] = np.cos(phi)[:, None] * rho
    points[..., 1] = np.sin(phi)[:, None] * rho
    points[..., 2] = r * np.sin(theta)
    n_arcs = int(np.ceil(np.pi / np.arccos(1 - TOLERANCE / R)))
    angle = np.arange(n_arcs + 1) * (2 * np.pi / n_arcs)
    ring = np.stack([R * np.cos(angle), R * np.sin(angle), 0 * angle], axis=1)
    return filled((points.reshape(-1, 3), _torus_faces(n, m)), _capsules(ring, r, 0.0))


@lru_cache(maxsize=32)
def _torus_faces(n: int, m: int) -> NDArray[np.int32]:
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    i2, j2 = (i + 1) % n, (j + 1) % m
    a, b, c, d = i * m + j, i2 * m + j, i2 * m + j2, i * m + j2
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return faces.astype(np.int32)


def sheet(grid: Array, boxes: list[tuple[Array, tuple[float, float, float]]]) -> Part:
    """An open surface through a grid of points (n, m, 3), with boxes (T, half extents) that fill it."""
    n, m, _ = grid.shape
    i, j = np.meshgrid(np.arange(n - 1), np.arange(m - 1), indexing="ij")
    a, b, c, d = i * m + j, (i + 1) * m + j, (i + 1) * m + j + 1, i * m + j + 1
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    rows = [(BOX, T, half) for T, half in boxes]
    return filled((grid.reshape(-1, 3), faces.astype(np.int32)), rows, is_closed=False)


def bent(corners: ArrayLike, radius: float, n_steps: int = 3) -> Array:
    """A polyline (n, 3) whose inner corners are replaced by curves that begin `radius` before them [m]."""
    points = np.asarray(corners, dtype=np.float64)
    out = [points[0]]
    t = np.linspace(0, 1, n_steps + 1)[:, None]
    for before, corner, after in zip(points[:-2], points[1:-1], points[2:], strict=True):
        back, on = before - corner, after - corner
        reach = min(radius, 0.45 * float(np.linalg.norm(back)), 0.45 * float(np.linalg.norm(on)))
        start = corner + back * (reach / np.linalg.norm(back))
        end = corner + on * (reach / np.linalg.norm(on))
        out.extend((1 - t) ** 2 * start + 2 * t * (1 - t) * corner + t**2 * end)  # a quadratic Bezier curve
    out.append(points[-1])
    return np.array(out)


def simplified(points: Array, tolerance: float) -> Array:
    """The polyline with as few points as keep it within a tolerance (Douglas and Peucker 1973)."""
    if len(points) < 3:
        return points
    chord = points[-1] - points[0]
    length2 = float(chord @ chord)
    t = np.clip((points - points[0]) @ chord / length2, 0, 1) if length2 > 0 else np.zeros(len(points))
    distance = np.linalg.norm(points - points[0] - t[:, None] * chord, axis=1)
    k = int(distance.argmax())
    if distance[k] <= tolerance:
        return points[[0, -1]]
    return np.concatenate([simplified(points[: k + 1], tolerance)[:-1], simplified(points[k:], tolerance)])


def _capsules(path: Array, radius: float, shorten: float = END) -> list[SolidRow]:
    """A capsule for each segment; the path's ends are drawn back by `shorten` radii, as the bar's are flat."""
    points = path.copy()
    for end, inner in ((0, 1), (-1, -2)):
        back = path[inner] - path[end]
        length = float(np.linalg.norm(back))
        points[end] += back * min(shorten * radius / length, 0.45)
    rows: list[SolidRow] = []
    for start, end in pairwise(points):
        along = end - start
        rows.append((CAPSULE, pose((start + end) / 2, along), (radius, radius, float(np.linalg.norm(along)) / 2)))
    return rows


def _tangents(points: Array) -> Array:
    step = np.diff(points, axis=0)
    step /= np.linalg.norm(step, axis=1)[:, None]
    tangent = np.concatenate([step[:1], step[:-1] + step[1:], step[-1:]])
    return tangent / np.linalg.norm(tangent, axis=1)[:, None]


def _crosses(a: Array, b: Array) -> Array:
    """Row by row cross products (n, 3); for a few rows faster than numpy's."""
    out = np.empty_like(a)
    out[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    out[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    out[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return out


def _plane_normal(points: Array) -> Array:
    """Unit normal of the plane that fits a path best; any perpendicular of a straight one."""
    if len(points) > 2:
        return np.linalg.svd(points - points.mean(axis=0), full_matrices=True)[2][2]
    along = points[1] - points[0]
    normal = np.zeros(3)
    i = int(np.abs(along).argmin())
    normal[i] = 1.0
    normal = normal - along * (along[i] / (along @ along))
    return normal / np.linalg.norm(normal)


def beam(start: ArrayLike, end: ArrayLike, width: float, thickness: float) -> Part:
    """A straight bar between two points: `width` measured horizontally across it, `thickness` the other way."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    along = b - a
    is_steep = abs(along[2]) > 0.99 * np.linalg.norm(along)
    across = (0.0, 1.0, 0.0) if is_steep else cross(along, (0.0, 0.0, 1.0))
    T = frame((a + b) / 2, cross(across, along), along)
    return box(thickness, width, float(np.linalg.norm(along))).moved(T)
