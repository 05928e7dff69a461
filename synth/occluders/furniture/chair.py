"""Dining chairs with and without arms, folding chairs, and stools."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about, translation
from synth.occluders.kit.bars import beam, bent, rod, tube
from synth.occluders.kit.parts import Array, Part, frame, joined, occluder
from synth.occluders.kit.shapes import box, cylinder, post, slab
from synth.occluders.kit.spec import Spec, chance, choice, count, flag, number, pick, uniform
from synth.occluders.model import Anchor, Occluder

BACKS = ("panel", "slats", "spindles", "frame")


@dataclass(frozen=True)
class DiningChairSpec(Spec):
    """A chair on four legs; the sitter looks along x.

    Attributes:
        seat_height: Of the seat's surface [m].
        seat_depth: Along x [m].
        seat_width: Along y [m].
        seat_thickness: Of the seat or its cushion [m].
        back: "panel", "slats" (level), "spindles" (upright) or "frame" (a padded upper half).
        back_height: From the floor to the upper edge of the backrest [m].
        recline: Of the backrest from the vertical [rad].
        leg: Thickness of a leg [m].
        leg_taper: Thickness of a leg's foot over that of its upper end.
        is_leg_round: Whether legs are round.
        corner: Radius of the seat's corners, seen from above [m].
        has_arms: Whether it has armrests.
        arm_height: Of the armrests above the seat [m].
    """

    seat_height: float = number(0.3, 0.6)
    seat_depth: float = number(0.3, 0.6)
    seat_width: float = number(0.3, 0.7)
    seat_thickness: float = number(0.01, 0.1)
    back: str = choice(*BACKS)
    back_height: float = number(0.55, 1.3)
    recline: float = number(0.0, 0.5)
    leg: float = number(0.015, 0.08)
    leg_taper: float = number(0.4, 1.0)
    is_leg_round: bool = flag()
    corner: float = number(0.0, 0.2)
    has_arms: bool = flag()
    arm_height: float = number(0.15, 0.3)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require(
            self.back_height >= self.seat_height + 0.2,
            f"back_height={self.back_height} must be 0.2 m above seat_height={self.seat_height}",
        )


def sample_dining_chair(rng: np.random.Generator) -> DiningChairSpec:
    """Draws a chair: seats 0.43-0.47 m high (EN 1729-1 size 6 for adults: 0.46 m), 0.38-0.45 m deep."""
    seat_height = uniform(rng, 0.43, 0.47)
    has_arms = chance(rng, 0.3)
    return DiningChairSpec(
        seat_height=seat_height,
        seat_depth=uniform(rng, 0.38, 0.45),
        seat_width=uniform(rng, 0.48, 0.54) if has_arms else uniform(rng, 0.4, 0.48),
        seat_thickness=uniform(rng, 0.018, 0.055),
        back=pick(rng, BACKS),
        back_height=round(seat_height + uniform(rng, 0.34, 0.54), 4),
        recline=uniform(rng, np.deg2rad(4), np.deg2rad(15)),
        leg=uniform(rng, 0.025, 0.042),
        leg_taper=uniform(rng, 0.6, 0.9) if chance(rng, 0.5) else 1.0,
        is_leg_round=chance(rng, 0.4),
        corner=uniform(rng, 0.01, 0.08),
        has_arms=has_arms,
        arm_height=uniform(rng, 0.19, 0.24),
    )


def make_dining_chair(spec: DiningChairSpec) -> Occluder:
    """Builds the chair; anchors "seat" and "backrest"."""
    seat = slab(spec.seat_depth, spec.seat_width, spec.seat_thickness, spec.corner, 0.4 * spec.seat_thickness)
    parts = [seat.at(0, 0, spec.seat_height - spec.seat_thickness / 2)]
    x, y = spec.seat_depth / 2 - spec.leg / 2, spec.seat_width / 2 - spec.leg / 2
    under = spec.seat_height - 0.5 * spec.seat_thickness
    leg = post(spec.leg * spec.leg_taper, spec.leg, under, spec.is_leg_round)
    inset = 0.3 * min(spec.corner, x)
    parts += [leg.at(sx * (x - inset), sy * (y - inset), under / 2) for sx in (-1, 1) for sy in (-1, 1)]
    rail = spec.seat_height - spec.seat_thickness - 0.018
    parts += [box(2 * (x - inset), 0.018, 0.04).at(0, sy * (y - inset), rail) for sy in (-1, 1)]
    parts += [box(0.018, 2 * (y - inset), 0.04).at(sx * (x - inset), 0, rail) for sx in (-1, 1)]
    T_back = back_pose(-spec.seat_depth / 2 + 0.015, spec.seat_height, spec.recline)
    length = (spec.back_height - spec.seat_height) / np.cos(spec.recline)
    back, face = _back(spec, length)
    parts.append(back.moved(T_back))
    if spec.has_arms:
        parts += _arms(spec, T_back, x)
    anchors = (
        Anchor("seat", translation(0, 0, spec.seat_height), (spec.seat_depth, spec.seat_width)),
        Anchor("backrest", T_back @ face.T_object_anchor, face.size),
    )
    return occluder("chair", parts, anchors)


def back_pose(x: float, z: float, recline: float) -> Array:
    """T_object_back of a backrest that starts at (x, 0, z) and leans towards -x: its z runs up along it."""
    return translation(x, 0.0, z) @ rotation_about((0.0, 1.0, 0.0), -recline)


def back_anchor(x: float, z: float, height: float, width: float) -> Anchor:
    """Anchor of a backrest's front at x round the height z, in the backrest's frame; x up along it."""
    return Anchor("backrest", frame((x, 0.0, z), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)), (height, width))


def _back(spec: DiningChairSpec, length: float) -> tuple[Part, Anchor]:
    """The backrest standing upright on the origin, and where a back leans."""
    width, leg, depth = spec.seat_width, spec.leg, 0.022
    y = width / 2 - leg / 2
    below = 0.05
    upright = post(leg, 0.8 * leg, length + below, spec.is_leg_round)
    parts = [upright.at(0, sy * y, (length - below) / 2) for sy in (-1, 1)]
    if spec.back == "slats":
        n = max(2, round(length / 0.15))
        parts += [box(0.018, 2 * y, 0.055).at(0, 0, length - 0.035 - k * (length - 0.1) / n) for k in range(n)]
    elif spec.back == "spindles":
        parts += [box(depth, 2 * y, 0.06).at(0, 0, length - 0.035), box(depth, 2 * y, 0.03).at(0, 0, 0.06)]
        gaps = max(4, round(2 * y / 0.07))
        for k in range(1, gaps):
            at = -y + 2 * y * k / gaps
            parts.append(rod((0, at, 0.06), (0, at, length - 0.04), 0.008, 6))
    elif spec.back == "panel":
        height = length - 0.03
        parts.append(slab(height, 2 * y, depth, 0.012, 0.006).moved(_UPRIGHT).at(0, 0, length - height / 2))
    else:
        height = 0.55 * length
        parts.append(slab(height, 2 * y, 0.035, 0.04, 0.012).moved(_UPRIGHT).at(0, 0, length - height / 2))
    return joined(parts), back_anchor(0.012, 0.55 * length, 0.8 * length, 0.9 * width)


_UPRIGHT = rotation_about((0.0, 1.0, 0.0), np.pi / 2)
"""Turns a slab so that its thickness lies along x and its length along z."""


def _arms(spec: DiningChairSpec, T_back: Array, x_front: float) -> list[Part]:
    parts = []
    z = spec.seat_height + spec.arm_height
    rear_x = float((T_back @ (0.0, 0.0, spec.arm_height / np.cos(spec.recline), 1.0))[0])
    for sy in (-1, 1):
        y = sy * (spec.seat_width / 2 + 0.01)
        front = (x_front - 0.07, y, z - 0.012)
        parts.append(beam((rear_x, y, z - 0.012), (front[0] + 0.03, y, z - 0.012), 0.045, 0.024))
        parts.append(beam((x_front - 0.04, y, spec.seat_height - 0.03), front, 0.028, 0.028))
    return parts


@dataclass(frozen=True)
class FoldingChairSpec(Spec):
    """A folding chair of bent tube whose legs cross under the seat; the sitter looks along x.

    Attributes:
        seat_height: Of the seat's surface [m].
        seat_depth: Along x [m].
        seat_width: Along y, between the tubes [m].
        seat_thickness: Of the seat and the backrest's panel [m].
        back_height: From the floor to the upper edge of the backrest [m].
        recline: Of the backrest from the vertical [rad].
        tube: Diameter of the tubes [m].
        stride: From the front to the rear feet [m].
    """

    seat_height: float = number(0.35, 0.55)
    seat_depth: float = number(0.3, 0.5)
    seat_width: float = number(0.3, 0.55)
    seat_thickness: float = number(0.012, 0.06)
    back_height: float = number(0.65, 1.1)
    recline: float = number(0.0, 0.5)
    tube: float = number(0.012, 0.035)
    stride: float = number(0.3, 0.65)


def sample_folding_chair(rng: np.random.Generator) -> FoldingChairSpec:
    """Draws a folding chair with the sizes of makers: seats 0.43-0.46 m high, backs 0.76-0.86 m."""
    return FoldingChairSpec(
        seat_height=uniform(rng, 0.43, 0.46),
        seat_depth=uniform(rng, 0.37, 0.42),
        seat_width=uniform(rng, 0.39, 0.44),
        seat_thickness=uniform(rng, 0.015, 0.03),
        back_height=uniform(rng, 0.76, 0.86),
        recline=uniform(rng, 0.12, 0.3),
        tube=uniform(rng, 0.018, 0.025),
        stride=uniform(rng, 0.42, 0.5),
    )


def make_folding_chair(spec: FoldingChairSpec) -> Occluder:
    """Builds the chair; anchors "seat" and "backrest"."""
    r, half = spec.tube / 2, spec.stride / 2
    T_back = back_pose(-spec.seat_depth / 2 - r, spec.seat_height, spec.recline)
    length = (spec.back_height - spec.seat_height) / np.cos(spec.recline)
    hip, top = T_back[:3, 3], (T_back @ (0.0, 0.0, length, 1.0))[:3]
    side = np.array([0.0, spec.seat_width / 2 + r, 0.0])
    front_foot, rear_foot = np.array([half, 0.0, 0.6 * r]), np.array([-half, 0.0, 0.6 * r])
    under_front = np.array([spec.seat_depth / 2 - 0.03, 0.0, spec.seat_height - spec.seat_thickness - r])
    parts = [slab(spec.seat_depth, spec.seat_width, spec.seat_thickness, 0.04, 0.006)]
    parts[0] = parts[0].at(0, 0, spec.seat_height - spec.seat_thickness / 2)
    for sign in (1, -1):
        parts.append(tube(bent([front_foot + sign * side, hip + sign * side, top + sign * side], 0.12, 4), r))
        inner = sign * (side - (0, 2 * r, 0))
        parts.append(rod(rear_foot + inner, under_front + inner, r))
    for at, inset in ((under_front, 2 * r), (front_foot + 0.25 * (hip - front_foot), 0.0)):
        parts.append(rod(at - side + (0, inset, 0), at + side - (0, inset, 0), 0.8 * r))
    height = 0.55 * length
    panel = slab(height, 2 * side[1], spec.seat_thickness, 0.03, 0.006).moved(_UPRIGHT)
    parts.append(panel.at(0, 0, length - height / 2 + 0.005).moved(T_back))
    face = back_anchor(spec.seat_thickness / 2, length - height / 2, height, spec.seat_width)
    anchors = (
        Anchor("seat", translation(0, 0, spec.seat_height), (spec.seat_depth, spec.seat_width)),
        Anchor("backrest", T_back @ face.T_object_anchor, face.size),
    )
    return occluder("chair", parts, anchors)


@dataclass(frozen=True)
class StoolSpec(Spec):
    """A stool without a back.

    Attributes:
        seat_height: Of the seat's surface [m].
        seat_size: Diameter or side of the seat [m].
        seat_thickness: Of the seat [m].
        is_round: Whether the seat is round.
        n_legs: Three or four.
        leg: Diameter of a leg [m].
        splay: Of the legs from the vertical [rad].
    """

    seat_height: float = number(0.3, 0.85)
    seat_size: float = number(0.25, 0.5)
    seat_thickness: float = number(0.015, 0.12)
    is_round: bool = flag()
    n_legs: int = count(3, 4)
    leg: float = number(0.015, 0.06)
    splay: float = number(0.0, 0.35)


def sample_stool(rng: np.random.Generator) -> StoolSpec:
    """Draws a stool for sitting at a table: 0.43-0.5 m high, 0.3-0.4 m across."""
    return StoolSpec(
        seat_height=uniform(rng, 0.43, 0.5),
        seat_size=uniform(rng, 0.31, 0.4),
        seat_thickness=uniform(rng, 0.022, 0.07),
        is_round=chance(rng, 0.65),
        n_legs=int(rng.integers(3, 5)),
        leg=uniform(rng, 0.022, 0.038),
        splay=uniform(rng, 0.03, 0.2),
    )


def make_stool(spec: StoolSpec) -> Occluder:
    """Builds the stool; anchor "seat"."""
    size, thick = spec.seat_size, spec.seat_thickness
    rounding = 0.3 * thick
    seat = cylinder(size / 2, thick, rounding) if spec.is_round else slab(size, size, thick, 0.03, rounding)
    under = spec.seat_height - 0.7 * thick
    angle = (np.arange(spec.n_legs) + 0.5) * (2 * np.pi / spec.n_legs)
    direction = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    reach = (0.5 if spec.is_round else 0.62) * size - spec.leg
    upper = direction * (reach - 0.02) + (0, 0, under)
    foot = direction * (reach - 0.02 + np.tan(spec.splay) * under) + (0, 0, 0.5 * np.sin(spec.splay) * spec.leg)
    parts = [seat.at(0, 0, spec.seat_height - thick / 2)]
    parts += [rod(a, b, spec.leg / 2) for a, b in zip(foot, upper, strict=True)]
    ring = foot + (upper - foot) * 0.42
    parts += [rod(ring[k - 1], ring[k], 0.009, 6) for k in range(spec.n_legs)]
    shape = "ellipse" if spec.is_round else "rectangle"
    return occluder("chair", parts, (Anchor("seat", translation(0, 0, spec.seat_height), (size, size), shape),))
