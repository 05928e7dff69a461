"""Office chairs: a star base on castors, a gas column, a swivelling seat with back and arms."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about, translation
from synth.occluders.furniture.chair import back_anchor, back_pose
from synth.occluders.kit.bars import beam, bent, tube
from synth.occluders.kit.linkage import Joint, Linkage
from synth.occluders.kit.parts import Part, joined, occluder
from synth.occluders.kit.shapes import box, cylinder, slab
from synth.occluders.kit.spec import Spec, chance, count, flag, number, uniform
from synth.occluders.model import Anchor, Occluder

MIN_SEAT_HEIGHT = 0.38
"""Seat height at which the gas column is wholly in [m]."""
_UPRIGHT = rotation_about((0.0, 1.0, 0.0), np.pi / 2)


@dataclass(frozen=True)
class OfficeChairSpec(Spec):
    """An office chair; the sitter looks along x.

    Attributes:
        seat_height: Of the seat's surface, set by the gas column [m].
        seat_depth: Along x [m].
        seat_width: Along y [m].
        cushion: Thickness of the seat's cushion [m].
        back_height: Of the backrest's upper edge above the seat [m].
        back_width: Of the backrest [m].
        recline: Of the backrest from the vertical [rad].
        base_radius: From the column to the castors [m].
        star_angle: Turn of the star base about the column [rad].
        n_arms: Of the star base.
        has_armrests: Whether it has armrests.
        arm_height: Of the armrests above the seat [m].
        has_headrest: Whether it has a headrest.
    """

    seat_height: float = number(MIN_SEAT_HEIGHT, 0.58)
    seat_depth: float = number(0.35, 0.55)
    seat_width: float = number(0.38, 0.6)
    cushion: float = number(0.03, 0.12)
    back_height: float = number(0.3, 0.8)
    back_width: float = number(0.3, 0.6)
    recline: float = number(0.0, 0.5)
    base_radius: float = number(0.22, 0.4)
    star_angle: float = number(0.0, 2 * np.pi)
    n_arms: int = count(4, 6)
    has_armrests: bool = flag()
    arm_height: float = number(0.15, 0.3)
    has_headrest: bool = flag()


def sample_office_chair(rng: np.random.Generator) -> OfficeChairSpec:
    """Draws an office chair: seats 0.42-0.51 m high and 0.38-0.47 m deep (EN 1335-1's ranges)."""
    return OfficeChairSpec(
        seat_height=uniform(rng, 0.42, 0.51),
        seat_depth=uniform(rng, 0.38, 0.47),
        seat_width=uniform(rng, 0.44, 0.52),
        cushion=uniform(rng, 0.045, 0.085),
        back_height=uniform(rng, 0.42, 0.66),
        back_width=uniform(rng, 0.38, 0.48),
        recline=uniform(rng, np.deg2rad(5), np.deg2rad(18)),
        base_radius=uniform(rng, 0.27, 0.34),
        star_angle=uniform(rng, 0, 2 * np.pi / 5),
        n_arms=5,
        has_armrests=chance(rng, 0.65),
        arm_height=uniform(rng, 0.2, 0.25),
        has_headrest=chance(rng, 0.3),
    )


def office_chair_linkage(spec: OfficeChairSpec) -> Linkage:
    """Base, column and seat, joined by the gas column's lift and the seat's swivel."""
    lift = spec.seat_height - MIN_SEAT_HEIGHT
    column = joined([cylinder(0.014, 0.24).at(0, 0, -0.12), box(0.2, 0.16, 0.03, 0.006).at(0, 0, 0.01)])
    joints = (
        Joint("lift", "prismatic", "base", "column", (0, 0, 0.29), (0, 0, 1), 0.0, 0.2, lift),
        Joint("swivel", "continuous", "column", "seat", (0, 0, MIN_SEAT_HEIGHT - 0.29)),
    )
    return Linkage("office_chair", (("base", _base(spec)), ("column", column), ("seat", _seat(spec))), joints)


def make_office_chair(spec: OfficeChairSpec) -> Occluder:
    """Builds the chair; anchors "seat" and "backrest"."""
    x = _back_x(spec)
    leaning = back_anchor(0.0, 0.55 * spec.back_height, 0.8 * spec.back_height, spec.back_width)
    T_back = back_pose(x, spec.seat_height, spec.recline)
    seat = Anchor("seat", translation(0, 0, spec.seat_height), (spec.seat_depth, spec.seat_width))
    back = Anchor("backrest", T_back @ leaning.T_object_anchor, leaning.size)
    return occluder("chair", office_chair_linkage(spec).posed(), (seat, back))


def _back_x(spec: OfficeChairSpec) -> float:
    return -spec.seat_depth / 2 + 0.02


def _base(spec: OfficeChairSpec) -> Part:
    """A star with a pair of small wheels under each tip."""
    parts = [cylinder(0.032, 0.2).at(0, 0, 0.16), cylinder(0.05, 0.05, 0.008).at(0, 0, 0.105)]
    for k in range(spec.n_arms):
        turn = rotation_about((0, 0, 1), spec.star_angle + k * 2 * np.pi / spec.n_arms)
        tip = spec.base_radius
        arm = beam((0.03, 0, 0.11), (tip, 0, 0.078), 0.045, 0.028)
        wheels = [cylinder(0.028, 0.018, 0.004).moved(_AXLE).at(tip - 0.02, sy * 0.016, 0.028) for sy in (-1, 1)]
        stem = cylinder(0.008, 0.045).at(tip - 0.012, 0, 0.055)
        parts.append(joined([arm, stem, *wheels]).moved(turn))
    return joined(parts)


_AXLE = rotation_about((1.0, 0.0, 0.0), np.pi / 2)
"""Turns a cylinder so that its axis lies along y."""


def _seat(spec: OfficeChairSpec) -> Part:
    """Cushion, backrest, armrests; the link's z = 0 is the seat's surface."""
    cushion = slab(spec.seat_depth, spec.seat_width, spec.cushion, 0.08, 0.018).at(0, 0, -spec.cushion / 2)
    x = _back_x(spec)
    T_back = back_pose(x, 0.0, spec.recline)
    height = spec.back_height - 0.1
    thick = 0.05
    pad = slab(height, spec.back_width, thick, 0.07, 0.018).moved(_UPRIGHT)
    back = [pad.at(-thick / 2, 0, 0.1 + height / 2), box(0.02, 0.07, 0.3, 0.005).at(-thick - 0.01, 0, 0.12)]
    if spec.has_headrest:
        z = spec.back_height + 0.12
        back.append(slab(0.15, 0.27, 0.05, 0.05, 0.018).moved(_UPRIGHT).at(-0.015, 0, z))
        back.append(box(0.014, 0.05, 0.2).at(-0.05, 0, spec.back_height + 0.03))
    parts = [cushion, *(part.moved(T_back) for part in back)]
    rear = T_back @ (-thick - 0.01, 0.0, -0.01, 1.0)
    parts.append(beam((-0.06, 0, -spec.cushion - 0.012), (rear[0], 0, -spec.cushion - 0.012), 0.06, 0.022))
    parts.append(beam((rear[0], 0, -spec.cushion - 0.02), (rear[0], 0, rear[2] + 0.02), 0.06, 0.02))
    if spec.has_armrests:
        parts += [part for sy in (-1, 1) for part in _armrest(spec, sy)]
    return joined(parts)


def _armrest(spec: OfficeChairSpec, sy: int) -> list[Part]:
    y = sy * (spec.seat_width / 2 + 0.05)
    z = spec.arm_height
    corners = [(-0.02, sy * 0.12, -spec.cushion - 0.008), (-0.02, y, -spec.cushion - 0.008), (-0.02, y, z - 0.03)]
    pad = slab(0.25, 0.075, 0.03, 0.03, 0.01).at(0.0, y, z - 0.015)
    return [tube(bent(corners, 0.05), 0.016), pad]
