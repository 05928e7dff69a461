"""Closed primitive parts: boxes, cylinders, rounded slabs, ovals, tubes, tyres; each with solids within 1 cm."""

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from synth.occluders.kit.parts import Array, Part, SolidRow, filled, pose
from synth.occluders.model import BOX, CAPSULE, CYLINDER

TOLERANCE = 0.006
"""How far solids that stand for curved shapes may be off, before rounded edges are counted [m]."""


def box(x: float, y: float, z: float, chamfer: float = 0.003) -> Part:
    """A box of these side lengths about the origin, its edges cut by a chamfer of at most 8 mm."""
    c = min(chamfer, 0.008, 0.3 * min(x, y, z))
    sign, is_inset, faces = _chamfered_cube()
    half = np.array([x, y, z]) / 2
    return filled((sign * (half - c * is_inset), faces), [(BOX, np.eye(4), (x / 2, y / 2, z / 2))])


@lru_cache(maxsize=1)
def _chamfered_cube() -> tuple[Array, Array, NDArray[np.int32]]:
    """Signs (24, 3), inset flags (24, 3) and outward faces of a cube with cut edges."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    sign = np.repeat(corners, 3, axis=0)
    is_inset = 1.0 - np.tile(np.eye(3), (8, 1))
    points = sign * (1 - 0.2 * is_inset)
    faces = ConvexHull(points).simplices.astype(np.int32)
    a, b, c = (points[faces[:, k]] for k in range(3))
    is_inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    faces[is_inward] = faces[is_inward][:, ::-1]
    return sign, is_inset, np.ascontiguousarray(faces)


def cylinder(radius: float, height: float, rounding: float = 0.003) -> Part:
    """A cylinder about the origin, its axis along z, its rims cut or rounded (at most 2 cm)."""
    r = min(rounding, 0.02, 0.45 * height, 0.9 * radius)
    z, inset = edge_profile(height, r, 1 if r < 0.008 else 3)
    rings = _stack(_circle(n_sides(radius))[None] * (radius - inset)[:, None, None], z)
    return filled(loft(rings), [(CYLINDER, np.eye(4), (radius, radius, height / 2))])


def frustum(bottom: float, top: float, height: float) -> Part:
    """A cut cone about the origin from radius `bottom` at -height/2 to `top` at height/2."""
    n = n_sides(max(bottom, top))
    radii = np.array([bottom, top])
    rings = _stack(_circle(n)[None] * radii[:, None, None], np.array([-height / 2, height / 2]))
    n_steps = max(1, int(np.ceil(abs(bottom - top) / (2 * TOLERANCE))))
    step = height / n_steps
    rows: list[SolidRow] = []
    for k in range(n_steps):
        radius = bottom + (top - bottom) * (k + 0.5) / n_steps
        rows.append((CYLINDER, pose((0, 0, -height / 2 + (k + 0.5) * step)), (radius, radius, step / 2)))
    return filled(loft(rings), rows)


def slab(x: float, y: float, z: float, corner: float, rounding: float = 0.004) -> Part:
    """A board or cushion about the origin, whose four edges along z have radius `corner`.

    Args:
        x: Length [m].
        y: Width [m].
        z: Thickness [m].
        corner: Radius of the edges along z [m].
        rounding: Radius of the edges round its two faces [m], at most 2 cm, `corner` and half the thickness.
    """
    corner = min(corner, x / 2, y / 2)
    r = min(rounding, 0.02, corner, z / 2)
    heights, inset = edge_profile(z, r, 1 if r < 0.008 else 3)
    quarter = int(np.clip(np.ceil(corner / 0.02), 2, 8)) + 1
    angle = (np.arange(4)[:, None] + np.linspace(0, 1, quarter)) * (np.pi / 2)
    centre = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (x / 2 - corner, y / 2 - corner)
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    rings = centre[:, None] + direction * (corner - inset)[:, None, None, None]
    mesh = loft(_stack(rings.reshape(len(heights), -1, 2), heights))
    return filled(mesh, _slab_solids(x, y, z, corner))


def _slab_solids(x: float, y: float, z: float, corner: float) -> list[SolidRow]:
    if corner <= 0.012:
        return [(BOX, np.eye(4), (x / 2, y / 2, z / 2))]
    inner_x, inner_y = x / 2 - corner, y / 2 - corner
    rows: list[SolidRow] = []
    if inner_x > 1e-4:
        rows.append((BOX, np.eye(4), (inner_x, y / 2, z / 2)))
    if inner_y > 1e-4:
        rows.append((BOX, np.eye(4), (x / 2, inner_y, z / 2)))
    for sx in (-1, 1) if inner_x > 1e-4 else (0,):
        for sy in (-1, 1) if inner_y > 1e-4 else (0,):
            rows.append((CYLINDER, pose((sx * inner_x, sy * inner_y, 0)), (corner, corner, z / 2)))
    return rows


def oval(x: float, y: float, z: float, rounding: float = 0.004) -> Part:
    """An elliptic board about the origin with axes x and y and thickness z.

    Its solids are discs that touch the ellipse from within, centred on its longer axis: the one at c has radius
    b sqrt(1 - c^2 / (a^2 - b^2)), for semi-axes a > b.
    """
    a, b = max(x, y) / 2, min(x, y) / 2
    heights, inset = edge_profile(z, min(rounding, 0.02, z / 2), 1)
    half = np.array([x, y]) / 2 - inset[:, None]
    rings = _stack(_circle(48)[None] * half[:, None, :], heights)
    reach = (a * a - b * b) / a
    n = int(np.ceil(2 * reach / np.sqrt(8 * b * TOLERANCE))) + 1 if reach > TOLERANCE else 1
    rows: list[SolidRow] = []
    for c in np.linspace(-reach, reach, n) if n > 1 else [0.0]:
        radius = b * np.sqrt(1 - c * c / (a * a - b * b)) if n > 1 else b
        centre = (c, 0, 0) if x >= y else (0, c, 0)
        rows.append((CYLINDER, pose(centre), (radius, radius, z / 2)))
    return filled(loft(rings), rows)


def tube(path: ArrayLike, radius: float, sides: int = 8) -> Part:
    """A round bar along a path (n, 3) [m] that lies roughly in a plane, with flat ends."""
    points = np.asarray(path, dtype=np.float64)
    tangent = _tangents(points)
    normal = _plane_normal(points)
    across = normal - (tangent @ normal)[:, None] * tangent
    across /= np.linalg.norm(across, axis=1)[:, None]
    other = np.cross(tangent, across)
    circle = _circle(sides)
    # At a bend the rings are cut at the mitre, which widens them in the bend's plane.
    step = np.diff(points, axis=0)
    step /= np.linalg.norm(step, axis=1)[:, None]
    widen = np.ones(len(points))
    widen[1:-1] = 1 / np.maximum(np.einsum("ij,ij->i", step[1:], tangent[1:-1]), 0.6)
    rings = points[:, None] + radius * (
        circle[None, :, :1] * across[:, None] + circle[None, :, 1:] * (widen[:, None] * other)[:, None]
    )
    return filled(loft(rings), _capsules(simplified(points, TOLERANCE / 2), radius))


def rod(start: ArrayLike, end: ArrayLike, radius: float, sides: int = 8) -> Part:
    """A straight round bar between two points."""
    return tube(np.array([start, end], dtype=np.float64), radius, sides)


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


def _capsules(path: Array, radius: float, shorten: float = 0.6) -> list[SolidRow]:
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


def edge_profile(height: float, rounding: float, n_steps: int) -> tuple[Array, Array]:
    """Heights and insets (n_rings,) of a slab's side, bottom to top, its edges rounded by quarter circles."""
    if rounding <= 0:
        return np.array([-height / 2, height / 2]), np.zeros(2)
    angle = np.linspace(0, np.pi / 2, n_steps + 1)
    inset = rounding * (1 - np.sin(angle))
    z = height / 2 - rounding * (1 - np.cos(angle))
    return np.concatenate([-z, z[::-1]]), np.concatenate([inset, inset[::-1]])


def n_sides(radius: float) -> int:
    """How many sides make a circle look round: 8 to 48, a multiple of 4, about 1 mm from round."""
    n = np.pi / np.arccos(max(1.0 - 0.001 / radius, 0.0))
    return int(np.clip(4 * np.ceil(n / 4), 8, 48))


def loft(rings: Array) -> tuple[Array, NDArray[np.int32]]:
    """A closed mesh through convex rings (n_rings, n, 3), counter-clockwise as seen from the last ring's side."""
    n_rings, n, _ = rings.shape
    return rings.reshape(-1, 3), _loft_faces(n, n_rings)


@lru_cache(maxsize=256)
def _loft_faces(n: int, n_rings: int) -> NDArray[np.int32]:
    """Faces of n_rings closed rings of n vertices, with fans over both ends."""
    i = np.arange(n)
    j = (i + 1) % n
    faces = []
    for a in range(0, (n_rings - 1) * n, n):
        faces += [np.stack([a + i, a + j, a + n + j], 1), np.stack([a + i, a + n + j, a + n + i], 1)]
    fan = np.arange(1, n - 1)
    zero = np.zeros_like(fan)
    faces += [np.stack([zero, fan + 1, fan], 1), (n_rings - 1) * n + np.stack([zero, fan, fan + 1], 1)]
    return np.concatenate(faces).astype(np.int32)


@lru_cache(maxsize=64)
def _circle(n: int) -> Array:
    angle = (np.arange(n) + 0.5) * (2 * np.pi / n)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _stack(outlines: Array, heights: Array) -> Array:
    """Rings (k, n, 3) from outlines (k, n, 2) at heights (k,)."""
    z = np.broadcast_to(heights[:, None, None], (*outlines.shape[:2], 1))
    return np.concatenate([outlines, z], axis=2)


def post(bottom: float, top: float, height: float, is_round: bool) -> Part:
    """A leg about the origin, round or square, whose thickness goes from `bottom` to `top` over its height."""
    if is_round:
        return frustum(bottom / 2, top / 2, height)
    widths = np.array([bottom, top])
    rings = _stack(_circle(4)[None] * (widths / np.sqrt(2))[:, None, None], np.array([-0.5, 0.5]) * height)
    n_steps = max(1, int(np.ceil(abs(bottom - top) / (4 * TOLERANCE))))
    half = height / n_steps / 2
    rows: list[SolidRow] = []
    for k in range(n_steps):
        width = bottom + (top - bottom) * (k + 0.5) / n_steps
        rows.append((BOX, pose((0, 0, -height / 2 + (2 * k + 1) * half)), (width / 2, width / 2, half)))
    return filled(loft(rings), rows)


def beam(start: ArrayLike, end: ArrayLike, width: float, thickness: float) -> Part:
    """A straight bar between two points: `width` measured horizontally across it, `thickness` the other way."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    along = b - a
    length = float(np.linalg.norm(along))
    z = along / length
    y = np.cross(z, (0.0, 0.0, 1.0)) if abs(z[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2] = np.cross(y / np.linalg.norm(y), z), y / np.linalg.norm(y), z
    T[:3, 3] = (a + b) / 2
    T[:3, 0] /= np.linalg.norm(T[:3, 0])
    T[:3, 1] = np.cross(z, T[:3, 0])
    return box(thickness, width, length).moved(T)
