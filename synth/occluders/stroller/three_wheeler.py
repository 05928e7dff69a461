"""Three-wheelers (joggers): one wheel on a fork in front, two behind, a deep seat and a canopy."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import translation
from synth.occluders.kit.bars import bent, rod, tube
from synth.occluders.kit.linkage import Joint, Linkage
from synth.occluders.kit.parts import Part, joined, occluder
from synth.occluders.kit.shapes import cylinder, slab
from synth.occluders.kit.spec import Spec, count, flag, number, uniform
from synth.occluders.model import Occluder
from synth.occluders.stroller.fittings import (
    AXLE,
    CANOPY_TILT,
    bar_anchors,
    canopy,
    canopy_joint,
    panel,
    seat_sides,
    spoked_wheel,
)

HANDLE_TURN = 0.9
"""How far the handle turns about its pivot [rad]."""
HANDLE_REACH = 0.2
"""From the handle's pivot to its bar [m]."""


@dataclass(frozen=True)
class ThreeWheelerSpec(Spec):
    """A three-wheeler; it rolls along x, whoever pushes it stands at -x.

    Attributes:
        pivot_height: Of the handle's pivots above the floor [m].
        handle_turn: Rise of the handle from the level, backwards [rad].
        handle_width: Of the bar [m].
        length: From the front to the rear axle [m].
        width: Between the rear wheels [m].
        front_radius: Of the front wheel [m].
        rear_radius: Of the rear wheels [m].
        n_spokes: Of each wheel.
        seat_height: Of the seat's rear edge [m].
        seat_width: [m].
        recline: Of the backrest from the vertical [rad].
        canopy_span: Angle that the canopy covers [rad].
        canopy_tilt: How far the canopy is turned forwards [rad].
        has_basket: Whether a basket hangs under the seat.
    """

    pivot_height: float = number(0.75, 1.05)
    handle_turn: float = number(0.0, HANDLE_TURN)
    handle_width: float = number(0.35, 0.65)
    length: float = number(0.6, 1.1)
    width: float = number(0.45, 0.75)
    front_radius: float = number(0.1, 0.25)
    rear_radius: float = number(0.12, 0.25)
    n_spokes: int = count(3, 12)
    seat_height: float = number(0.38, 0.65)
    seat_width: float = number(0.28, 0.45)
    recline: float = number(0.1, 1.0)
    canopy_span: float = number(0.5, 2.4)
    canopy_tilt: float = number(0.0, CANOPY_TILT)
    has_basket: bool = flag()


def sample_three_wheeler(rng: np.random.Generator) -> ThreeWheelerSpec:
    """Draws a three-wheeler with the sizes of makers: 12 to 16 inch wheels, bars 0.95-1.1 m high."""
    return ThreeWheelerSpec(
        pivot_height=uniform(rng, 0.88, 0.95),
        handle_turn=uniform(rng, 0.3, 0.8),
        handle_width=uniform(rng, 0.46, 0.54),
        length=uniform(rng, 0.75, 0.92),
        width=uniform(rng, 0.56, 0.64),
        front_radius=uniform(rng, 0.14, 0.2),
        rear_radius=uniform(rng, 0.15, 0.2),
        n_spokes=int(rng.integers(5, 9)),
        seat_height=uniform(rng, 0.46, 0.54),
        seat_width=uniform(rng, 0.33, 0.37),
        recline=uniform(rng, 0.3, 0.6),
        canopy_span=uniform(rng, 1.2, 2.1),
        canopy_tilt=uniform(rng, 0.0, 0.4),
        has_basket=bool(rng.random() < 0.7),
    )


def three_wheeler_linkage(spec: ThreeWheelerSpec) -> Linkage:
    """Frame with the seat, three wheels, handle and canopy."""
    x = spec.length / 2
    rear = spoked_wheel(spec.rear_radius, 0.045, spec.n_spokes)
    links: list[tuple[str, Part]] = [
        ("frame", _frame(spec)),
        ("front_wheel", spoked_wheel(spec.front_radius, 0.045, spec.n_spokes)),
        ("rear_left_wheel", rear),
        ("rear_right_wheel", rear),
        ("handle", _handle(spec)),
        ("canopy", canopy(0.31, spec.seat_width + 0.04, np.pi / 2 - spec.recline - 0.1, spec.canopy_span)),
    ]
    places = [("front", (x, 0.0, spec.front_radius))]
    places += [(f"rear_{s}", (-x, w * spec.width / 2, spec.rear_radius)) for s, w in (("left", 1), ("right", -1))]
    joints = [Joint(f"{n}_axle", "continuous", "frame", f"{n}_wheel", origin, (0, 1, 0)) for n, origin in places]
    pivot, top = _pivot(spec), _back_top(spec)
    joints.append(
        Joint("handle_pivot", "revolute", "frame", "handle", pivot, (0, 1, 0), 0.0, HANDLE_TURN, spec.handle_turn)
    )
    joints.append(canopy_joint("frame", (top[0] + 0.03, 0.0, top[1] - 0.14), spec.canopy_tilt))
    return Linkage("three_wheeler", tuple(links), tuple(joints))


def _pivot(spec: ThreeWheelerSpec) -> tuple[float, float, float]:
    return -spec.length / 2 - 0.06, 0.0, spec.pivot_height


def _back_top(spec: ThreeWheelerSpec) -> tuple[float, float]:
    """X and z of the backrest's upper end [m]."""
    return -0.16 - 0.5 * np.sin(spec.recline), spec.seat_height - 0.03 + 0.5 * np.cos(spec.recline)


def _handle(spec: ThreeWheelerSpec) -> Part:
    """A U that points backwards from its pivots."""
    y, r = spec.handle_width / 2, HANDLE_REACH
    corners = [(0, y, 0), (-r, y, 0), (-r, -y, 0), (0, -y, 0)]
    hubs = [cylinder(0.026, 0.03).moved(AXLE).at(0, s * y, 0) for s in (-1, 1)]
    return joined([tube(bent(corners, 0.06), 0.0125), rod((-r, 0.7 * y, 0), (-r, -0.7 * y, 0), 0.017), *hubs])


def _frame(spec: ThreeWheelerSpec) -> Part:
    x, w = spec.length / 2, spec.handle_width / 2
    pivot = _pivot(spec)
    neck = (x - 0.12, 0.05, 2 * spec.front_radius + 0.05)
    parts: list[Part] = []
    for s in (1, -1):
        fork = (neck[0], s * neck[1], neck[2])
        long_tube = [(pivot[0], s * w, pivot[2]), (-0.12, s * w, spec.seat_height - 0.02), fork]
        parts.append(tube(bent(long_tube, 0.2, 5), 0.014))
        parts.append(tube(bent([fork, (x, s * 0.05, spec.front_radius)], 0.05), 0.012))
        rear = (-x, s * (spec.width / 2 - 0.05), spec.rear_radius)
        parts.append(tube(bent([rear, (0.02, s * w, spec.seat_height - 0.03)], 0.05), 0.014))
        parts += seat_sides((-0.16, spec.seat_height - 0.02), 0.28, spec.recline, s * spec.seat_width / 2)
    parts.append(rod(neck, (neck[0], -neck[1], neck[2]), 0.014))
    parts.append(cylinder(0.01, 0.11).moved(AXLE).at(x, 0, spec.front_radius))
    parts.append(cylinder(0.012, spec.width).moved(AXLE).at(-x, 0, spec.rear_radius))
    parts += [rod((a, -w, z), (a, w, z), 0.012) for a, z in ((0.02, spec.seat_height - 0.045),)]
    back, seat_front = _back_top(spec), (0.14, spec.seat_height + 0.02)
    corner = (-0.16, spec.seat_height - 0.03)
    parts.append(panel(corner, seat_front, spec.seat_width, 0.035))
    parts.append(panel(corner, back, spec.seat_width, 0.035))
    shin = (min(0.24, x - 0.17), spec.seat_height - 0.2)
    parts.append(panel(seat_front, shin, 0.85 * spec.seat_width, 0.016))
    if spec.has_basket:
        parts.append(slab(0.34, spec.width - 0.2, 0.13, 0.06, 0.015).at(-0.14, 0, spec.rear_radius + 0.06))
    return joined(parts)


def make_three_wheeler(spec: ThreeWheelerSpec) -> Occluder:
    """Builds the three-wheeler; anchors "handle_left" and "handle_right" on its bar."""
    linkage = three_wheeler_linkage(spec)
    T = linkage.link_poses()["handle"] @ translation(-HANDLE_REACH, 0.0, 0.0)
    return occluder("stroller", linkage.posed(), bar_anchors(T, 0.42 * spec.handle_width / 2, 0.034))
