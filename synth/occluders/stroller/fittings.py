"""What strollers share: wheels, canopies, panels between tubes, handle anchors."""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from synth.geometry import rotation_about
from synth.occluders.kit.bars import rod, sheet, tyre
from synth.occluders.kit.linkage import Joint
from synth.occluders.kit.parts import Array, Part, cross, frame, joined, unit
from synth.occluders.kit.shapes import box, cylinder, slab
from synth.occluders.model import Anchor

AXLE = rotation_about((1.0, 0.0, 0.0), np.pi / 2)
"""Turns a part whose axis is z so that its axis lies along y."""
CANOPY_TILT = 0.8
"""How far a canopy turns forwards from its rearmost place [rad]."""
FABRIC = 0.004
"""Half the thickness that solids give to a canopy's cloth [m]."""


@lru_cache(maxsize=64)
def disc_wheel(radius: float, width: float) -> Part:
    """A small solid wheel with its axle along y through the origin."""
    hub = cylinder(0.3 * radius, width + 0.008, 0.003)
    return joined([cylinder(radius, width, 0.3 * width), hub]).moved(AXLE)


@lru_cache(maxsize=64)
def spoked_wheel(radius: float, width: float, n_spokes: int = 5) -> Part:
    """A wheel with a round tyre, thick spokes and a hub, its axle along y through the origin."""
    parts = [tyre(radius, width), cylinder(0.16 * radius, width + 0.01, 0.003)]
    spoke = rod((0.1 * radius, 0, 0), (radius - 0.6 * width, 0, 0), 0.009, 6)
    parts += [spoke.moved(rotation_about((0, 0, 1), 2 * np.pi * k / n_spokes)) for k in range(n_spokes)]
    return joined(parts).moved(AXLE)


def panel(start: tuple[float, float], end: tuple[float, float], width: float, thickness: float) -> Part:
    """A padded panel in the plane of a seat, from (x, z) to (x, z) [m], its middle plane through both."""
    a, b = np.array([start[0], 0.0, start[1]]), np.array([end[0], 0.0, end[1]])
    normal = cross(b - a, (0.0, 1.0, 0.0))
    T = frame((a + b) / 2, b - a, normal)
    return slab(float(np.linalg.norm(b - a)), width, thickness, 0.03, 0.35 * thickness).moved(T)


def seat_sides(corner: tuple[float, float], depth: float, recline: float, y: float) -> list[Part]:
    """The cloth on one side of a seat: a low strip beside the seat and a wing along the backrest.

    Args:
        corner: x and z where seat and backrest meet [m].
        depth: Of the seat from there [m].
        recline: Of the backrest from the vertical [rad].
        y: Of the side [m].
    """
    x, z = corner
    strip = _side_strip((x, z), (x + depth, z + 0.03), y, 0.11)
    wing = _side_strip((x, z), (x - 0.38 * np.sin(recline), z + 0.38 * np.cos(recline)), y, 0.1)
    return [strip, wing]


def _side_strip(start: tuple[float, float], end: tuple[float, float], y: float, height: float) -> Part:
    """A thin upright strip of cloth beside a seat, `height` wide above the line from (x, z) to (x, z)."""
    a, b = np.array([start[0], y, start[1]]), np.array([end[0], y, end[1]])
    T = frame((a + b) / 2, b - a, cross(b - a, (0.0, 1.0, 0.0)))
    length = float(np.linalg.norm(b - a))
    up = T[:3, 2] if T[2, 2] >= 0 else -T[:3, 2]
    T[:3, 3] += up * height / 2
    return box(length, 0.01, height, 0.002).moved(T)


def canopy(radius: float, width: float, start: float, span: float) -> Part:
    """A folding canopy: cloth over bows that turn about the y axis through the origin.

    The cloth is an open surface: a roof with rounded shoulders and a skirt that hangs a third of the way to the
    hinge. Angles run from -x (0) over +z (pi/2) to +x (pi).

    Args:
        radius: From the hinge to the roof [m].
        width: Between the sides [m].
        start: Angle of the rear bow [rad].
        span: From the rear to the front bow [rad].
    """
    n_bows = max(2, round(span / 0.35)) + 1
    angles = start + np.linspace(0, span, n_bows)
    shoulder = min(0.07, 0.3 * width)
    turn = np.linspace(0, np.pi / 2, 4)
    half = width / 2
    y = np.concatenate([[half], half - shoulder * (1 - np.cos(turn)), [0.0]])
    rho = np.concatenate([[0.62 * radius], radius - shoulder * (1 - np.sin(turn)), [radius]])
    section_y = np.concatenate([-y, y[-2::-1]])  # from right to left, so that the front is outside
    section_rho = np.concatenate([rho, rho[-2::-1]])
    radial = np.stack([-np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
    grid = section_rho[None, :, None] * radial[:, None, :]
    grid[..., 1] = section_y
    boxes = [
        row
        for k in range(n_bows - 1)
        for row in _strip(section_y, section_rho, radial[k] + radial[k + 1], angles[k + 1] - angles[k])
    ]
    bows = [_bow(radius, half, shoulder, direction) for direction in radial[[0, -1]]]
    return joined([sheet(grid, boxes), *bows])


def _strip(y: Array, rho: Array, outwards: Array, angle: float) -> list[tuple[Array, tuple[float, float, float]]]:
    """Boxes (T, half extents) of the flat strip of cloth between two bows; x runs along the bows."""
    direction, y_axis = np.array(unit(outwards)), np.array([0.0, 1.0, 0.0])
    along = np.array(cross(y_axis, direction))
    chord, slope = rho * np.cos(angle / 2), float(np.tan(angle / 2))
    boxes = []
    for (y0, r0), (y1, r1) in pairwise(zip(y.tolist(), chord.tolist(), strict=True)):
        # The skirt is narrower near the hinge: short boxes hold it within a centimetre.
        n = math.ceil(max(abs(r1 - r0) * slope / 0.008, 1.0))
        dy, dr = (y1 - y0) / n, (r1 - r0) / n
        length = math.hypot(dy, dr)
        T = np.eye(4)
        T[:3, 0] = (dr * direction + dy * y_axis) / length
        T[:3, 1] = along
        T[:3, 2] = (dr * y_axis - dy * direction) / length
        for k in range(n):
            r = r0 + (k + 0.5) * dr
            T = T.copy()
            T[:3, 3] = r * direction + (y0 + (k + 0.5) * dy) * y_axis
            boxes.append((T, (length / 2, r * slope, FABRIC)))
    return boxes


def _bow(radius: float, half: float, shoulder: float, direction: Array) -> Part:
    """A bow's two rods from the hinge up the sides, and the bar across the roof."""
    y = np.array([0.0, half, 0.0])
    inner, outer = 0.0 * direction, (radius - shoulder) * direction
    across = radius * direction - 0.004 * direction
    bar = np.array([0.0, half - shoulder, 0.0])
    return joined(
        [
            rod(inner + y, outer + y, 0.006, 6),
            rod(inner - y, outer - y, 0.006, 6),
            rod(across - bar, across + bar, 0.006, 6),
        ]
    )


def canopy_joint(parent: str, hinge: tuple[float, float, float], tilt: float) -> Joint:
    """The hinge that turns a canopy forwards by `tilt` [rad]."""
    return Joint("canopy_hinge", "revolute", parent, "canopy", hinge, (0.0, 1.0, 0.0), 0.0, CANOPY_TILT, tilt)


def grip_anchor(name: str, middle: ArrayLike, to_left: ArrayLike, size: tuple[float, float]) -> Anchor:
    """Anchor of a grip whose axis runs along `to_left`, the user's left; size is (diameter, length)."""
    y = np.asarray(to_left, dtype=np.float64)
    y = y / np.linalg.norm(y)
    x = cross(y, (0.0, 0.0, 1.0))
    T = frame(middle, x, cross(x, y))
    return Anchor(name, T, size)


def bar_anchors(T: Array, half: float, diameter: float) -> tuple[Anchor, Anchor]:
    """Anchors of both hands on one bar along y through T's origin, each `half` from its middle [m]."""
    middle, left = T[:3, 3], T[:3, 1]
    size = (diameter, 0.12)
    return (
        grip_anchor("handle_left", middle + half * left, left, size),
        grip_anchor("handle_right", middle - half * left, left, size),
    )
