"""Sofas and upholstered armchairs for one to three."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about, translation
from synth.occluders.furniture.chair import back_anchor, back_pose
from synth.occluders.kit.parts import Part, occluder
from synth.occluders.kit.shapes import box, post, slab
from synth.occluders.kit.spec import Spec, chance, count, flag, number, uniform
from synth.occluders.model import Anchor, Occluder

_UPRIGHT = rotation_about((0.0, 1.0, 0.0), np.pi / 2)
_SIDEWAYS = rotation_about((1.0, 0.0, 0.0), np.pi / 2)


@dataclass(frozen=True)
class SofaSpec(Spec):
    """A sofa; sitters look along x.

    Attributes:
        n_seats: One (an armchair) to three.
        place_width: Of one seat cushion along y [m].
        seat_height: Of the cushions' surface [m].
        seat_depth: From the cushions' front to the backrest [m].
        back_height: Of the backrest's upper edge above the floor [m].
        recline: Of the back cushions from the vertical [rad].
        back_thickness: Of the back behind the cushions [m].
        cushion: Thickness of seat and back cushions [m].
        has_arms: Whether it has arms.
        arm_width: Of an arm [m].
        arm_height: Of the arms above the floor [m].
        foot: Height of the feet [m].
    """

    n_seats: int = count(1, 3)
    place_width: float = number(0.45, 0.95)
    seat_height: float = number(0.3, 0.55)
    seat_depth: float = number(0.42, 0.75)
    back_height: float = number(0.6, 1.2)
    recline: float = number(0.0, 0.5)
    back_thickness: float = number(0.05, 0.3)
    cushion: float = number(0.08, 0.22)
    has_arms: bool = flag()
    arm_width: float = number(0.05, 0.3)
    arm_height: float = number(0.4, 0.8)
    foot: float = number(0.0, 0.2)

    def __post_init__(self) -> None:
        super().__post_init__()
        base = self.seat_height - self.cushion - self.foot
        self.require(base >= 0.05, f"cushion and foot leave a base of {base:.2f} m, at least 0.05 is needed")
        self.require(
            self.back_height >= self.seat_height + 0.2,
            f"back_height={self.back_height} must be 0.2 m above seat_height={self.seat_height}",
        )
        self.require(
            self.arm_height >= self.seat_height,
            f"arm_height={self.arm_height} must not lie below seat_height={self.seat_height}",
        )


def sample_sofa(rng: np.random.Generator) -> SofaSpec:
    """Draws a sofa: seats 0.4-0.46 m high, 0.5-0.58 m deep, 0.58-0.72 m a place (typical of makers)."""
    seat_height = uniform(rng, 0.4, 0.46)
    return SofaSpec(
        n_seats=int(rng.integers(1, 4)),
        place_width=uniform(rng, 0.58, 0.72),
        seat_height=seat_height,
        seat_depth=uniform(rng, 0.5, 0.58),
        back_height=uniform(rng, 0.76, 0.95),
        recline=uniform(rng, np.deg2rad(8), np.deg2rad(18)),
        back_thickness=uniform(rng, 0.08, 0.16),
        cushion=uniform(rng, 0.12, 0.17),
        has_arms=chance(rng, 0.85),
        arm_width=uniform(rng, 0.09, 0.22),
        arm_height=uniform(rng, 0.56, 0.66),
        foot=uniform(rng, 0.03, 0.14),
    )


def make_sofa(spec: SofaSpec) -> Occluder:
    """Builds the sofa.

    Anchors "seat" and "backrest" belong to the middle place (of two, the sitter's right one); the other places'
    are called "seat_2", "backrest_2" and so on.
    """
    width = spec.n_seats * spec.place_width
    inner_rear = -spec.seat_depth / 2
    depth = spec.seat_depth + spec.cushion + spec.back_thickness
    x_mid = spec.seat_depth / 2 - depth / 2
    base = spec.seat_height - spec.cushion - spec.foot
    parts = [box(depth - 0.02, width, base, 0.008).at(x_mid, 0, spec.foot + base / 2)]
    T_back = back_pose(inner_rear, spec.seat_height, spec.recline)
    parts += [part.moved(T_back) for part in _back(spec, width)]
    anchors: list[Anchor] = []
    for y in _places(spec):
        cushion = slab(spec.seat_depth + 0.02, spec.place_width - 0.006, spec.cushion, 0.04, 0.02)
        parts.append(cushion.at(-0.01, y, spec.seat_height - spec.cushion / 2))
        suffix = f"_{len(anchors) // 2 + 1}" if anchors else ""
        up = spec.back_height - spec.seat_height
        leaning = back_anchor(0.0, 0.5 * up, 0.9 * up, spec.place_width)
        T = translation(0, y, 0) @ T_back @ leaning.T_object_anchor
        seat = Anchor("seat" + suffix, translation(0, y, spec.seat_height), (spec.seat_depth, spec.place_width))
        anchors += [seat, Anchor("backrest" + suffix, T, leaning.size)]
    if spec.has_arms:
        arm = slab(depth, spec.arm_height - spec.foot, spec.arm_width, 0.05, 0.02).moved(_SIDEWAYS)
        z = (spec.arm_height + spec.foot) / 2
        parts += [arm.at(x_mid, sy * (width + spec.arm_width) / 2, z) for sy in (-1, 1)]
    return occluder("chair", parts + _feet(spec, x_mid, depth, width), tuple(anchors))


def _places(spec: SofaSpec) -> list[float]:
    """Y of the places' middles, the middle (or right) one first."""
    ys = [(k - (spec.n_seats - 1) / 2) * spec.place_width for k in range(spec.n_seats)]
    return sorted(ys, key=lambda y: (abs(y), y))


def _back(spec: SofaSpec, width: float) -> list[Part]:
    """Back cushions with their front on x = 0 and the frame behind, standing on the seat's height."""
    up = (spec.back_height - spec.seat_height) / np.cos(spec.recline)
    frame_height = up - 0.04 + spec.cushion
    frame = slab(frame_height, width, spec.back_thickness, 0.03, 0.02).moved(_UPRIGHT)
    x = -spec.cushion - spec.back_thickness / 2
    parts = [frame.at(x, 0, frame_height / 2 - spec.cushion)]
    for y in _places(spec):
        cushion = slab(up, spec.place_width - 0.008, spec.cushion, 0.05, 0.02).moved(_UPRIGHT)
        parts.append(cushion.at(-spec.cushion / 2, y, up / 2))
    return parts


def _feet(spec: SofaSpec, x_mid: float, depth: float, width: float) -> list[Part]:
    if spec.foot < 0.01:
        return []
    foot = post(0.03, 0.045, spec.foot, True)
    x, y = depth / 2 - 0.06, width / 2 - 0.05
    return [foot.at(x_mid + sx * x, sy * y, spec.foot / 2) for sx in (-1, 1) for sy in (-1, 1)]
