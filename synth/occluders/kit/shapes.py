"""Solid primitive parts: boxes, cylinders, rounded slabs, ovals, legs; each with solids within 1 cm."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from synth.occluders.kit.parts import Array, Part, SolidRow, filled, pose
from synth.occluders.model import BOX, CYLINDER

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
    rings = _stack(circle(n_sides(radius))[None] * (radius - inset)[:, None, None], z)
    return filled(loft(rings), [(CYLINDER, np.eye(4), (radius, radius, height / 2))])


def frustum(bottom: float, top: float, height: float) -> Part:
    """A cut cone about the origin from radius `bottom` at -height/2 to `top` at height/2."""
    n = n_sides(max(bottom, top))
    radii = np.array([bottom, top])
    rings = _stack(circle(n)[None] * radii[:, None, None], np.array([-height / 2, height / 2]))
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
    rings = _stack(circle(48)[None] * half[:, None, :], heights)
    reach = (a * a - b * b) / a
    # Between two discs the ellipse stands out by step^2 a^2 / (8 b (a^2 - b^2)) in its middle, by about
    # step^2 a / (8 b^2) near its tips.
    step = np.sqrt(8 * TOLERANCE * min(b * (a * a - b * b) / (a * a), b * b / a))
    n = int(np.ceil(2 * reach / step)) + 1 if reach > TOLERANCE / 2 else 1
    rows: list[SolidRow] = []
    for c in np.linspace(-reach, reach, n) if n > 1 else [0.0]:
        radius = b * np.sqrt(1 - c * c / (a * a - b * b)) if n > 1 else b
        centre = (c, 0, 0) if x >= y else (0, c, 0)
        rows.append((CYLINDER, pose(centre), (radius, radius, z / 2)))
    return filled(loft(rings), rows)


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
def circle(n: int) -> Array:
    """Points (n, 2) of a unit circle, counter-clockwise, with a side's middle at angle 0."""
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
    rings = _stack(circle(4)[None] * (widths / np.sqrt(2))[:, None, None], np.array([-0.5, 0.5]) * height)
    n_steps = max(1, int(np.ceil(abs(bottom - top) / (4 * TOLERANCE))))
    half = height / n_steps / 2
    rows: list[SolidRow] = []
    for k in range(n_steps):
        width = bottom + (top - bottom) * (k + 0.5) / n_steps
        rows.append((BOX, pose((0, 0, -height / 2 + (2 * k + 1) * half)), (width / 2, width / 2, half)))
    return filled(loft(rings), rows)
