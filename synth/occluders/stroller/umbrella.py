"""Umbrella strollers: two crossed pairs of tubes, a hammock seat, two hooked grips, small double wheels."""

from dataclasses import dataclass

import numpy as np

from synth.occluders.kit.bars import bent, rod, tube
from synth.occluders.kit.linkage import Joint, Linkage
from synth.occluders.kit.parts import Array, Part, joined, occluder
from synth.occluders.kit.spec import Spec, flag, number, uniform
from synth.occluders.model import Occluder
from synth.occluders.stroller.fittings import (
    CANOPY_TILT,
    canopy,
    canopy_joint,
    disc_wheel,
    grip_anchor,
    panel,
    seat_sides,
)


@dataclass(frozen=True)
class UmbrellaStrollerSpec(Spec):
    """An umbrella stroller; it rolls along x, whoever pushes it stands at -x.

    Attributes:
        handle_height: Of the grips above the floor [m].
        length: From the front to the rear axle [m].
        width: Between the wheels [m].
        seat_height: Of the seat's rear edge [m].
        seat_width: Of the seat [m].
        recline: Of the backrest from the vertical [rad].
        wheel_radius: [m].
        tube: Diameter of the frame's tubes [m].
        canopy_span: Angle that the canopy covers [rad].
        canopy_tilt: How far the canopy is turned forwards [rad].
        has_canopy: Whether it has one.
    """

    handle_height: float = number(0.85, 1.2)
    length: float = number(0.4, 0.75)
    width: float = number(0.35, 0.6)
    seat_height: float = number(0.35, 0.6)
    seat_width: float = number(0.28, 0.45)
    recline: float = number(0.1, 1.0)
    wheel_radius: float = number(0.05, 0.11)
    tube: float = number(0.015, 0.035)
    canopy_span: float = number(0.35, 2.4)
    canopy_tilt: float = number(0.0, CANOPY_TILT)
    has_canopy: bool = flag()


def sample_umbrella(rng: np.random.Generator) -> UmbrellaStrollerSpec:
    """Draws an umbrella stroller with the sizes of makers: grips 0.98-1.08 m high, wheels of 13-17 cm."""
    return UmbrellaStrollerSpec(
        handle_height=uniform(rng, 0.98, 1.08),
        length=uniform(rng, 0.52, 0.62),
        width=uniform(rng, 0.42, 0.5),
        seat_height=uniform(rng, 0.4, 0.48),
        seat_width=uniform(rng, 0.32, 0.36),
        recline=uniform(rng, 0.3, 0.6),
        wheel_radius=uniform(rng, 0.065, 0.085),
        tube=uniform(rng, 0.018, 0.025),
        canopy_span=uniform(rng, 1.0, 1.9),
        canopy_tilt=uniform(rng, 0.0, 0.4),
        has_canopy=bool(rng.random() < 0.85),
    )


@dataclass(frozen=True)
class _Layout:
    """Where the tubes run, for the left side; y is mirrored for the right [m]."""

    grip: Array
    elbow: Array
    front: Array
    rear: Array
    knee: Array
    seat_rear: Array
    back_top: Array


def _layout(spec: UmbrellaStrollerSpec) -> _Layout:
    r, y = spec.wheel_radius, spec.width / 2 - 0.02
    x_front, x_rear = spec.length / 2, -spec.length / 2
    seat_y = spec.seat_width / 2 + 0.015
    seat_rear = np.array([-0.1, 0.0, spec.seat_height - 0.03])
    lean = np.array([-np.sin(spec.recline), 0.0, np.cos(spec.recline)])
    # The long tube runs from the front wheel behind the backrest up to the grip.
    elbow = np.array([x_rear - 0.1, seat_y + 0.06, spec.handle_height - 0.015])
    return _Layout(
        grip=elbow + np.array([-0.045, -0.115, 0.02]),
        elbow=elbow,
        front=np.array([x_front, y, r + 0.05]),
        rear=np.array([x_rear, y, r + 0.03]),
        knee=np.array([0.16, seat_y, spec.seat_height + 0.12]),
        seat_rear=seat_rear,
        back_top=seat_rear + 0.48 * lean,
    )


def umbrella_linkage(spec: UmbrellaStrollerSpec) -> Linkage:
    """Frame, four double wheels, and the canopy's front half on its hinge."""
    at = _layout(spec)
    r = spec.wheel_radius
    links: list[tuple[str, Part]] = [("frame", _frame(spec, at))]
    joints: list[Joint] = []
    pair = joined([disc_wheel(r, 0.02).at(0, s * 0.026, 0) for s in (-1, 1)])
    for name, place in (("front", at.front), ("rear", at.rear)):
        for side, sign in (("left", 1), ("right", -1)):
            links.append((f"{name}_{side}_wheel", pair))
            origin = (float(place[0]), sign * float(place[1]), r)
            joints.append(Joint(f"{name}_{side}_axle", "continuous", "frame", links[-1][0], origin, (0, 1, 0)))
    if spec.has_canopy:
        links.append(
            ("canopy", canopy(0.3, spec.seat_width + 0.03, np.pi / 2 - spec.recline - 0.1, spec.canopy_span))
        )
        hinge = at.back_top + np.array([0.02, 0, -0.12])
        joints.append(canopy_joint("frame", (float(hinge[0]), 0.0, float(hinge[2])), spec.canopy_tilt))
    return Linkage("umbrella_stroller", tuple(links), tuple(joints))


def _frame(spec: UmbrellaStrollerSpec, at: _Layout) -> Part:
    radius = spec.tube / 2
    parts: list[Part] = []
    for sign in (1, -1):
        flip = np.array([1.0, sign, 1.0])
        parts.append(tube(bent(np.array([at.front, at.elbow, at.grip]) * flip, 0.03), radius))
        parts.append(rod((at.grip + 0.8 * (at.elbow - at.grip)) * flip, at.grip * flip, 0.016))
        parts.append(
            tube(bent(np.array([at.rear, at.knee, at.knee + np.array([-0.16, 0, 0.03])]) * flip, 0.05), radius)
        )
        for place in (at.front, at.rear):
            parts.append(rod(place * flip, (place * (1, 1, 0) + (0, 0, spec.wheel_radius)) * flip, 0.014))
        parts += seat_sides((-0.1, spec.seat_height - 0.02), 0.26, spec.recline, sign * spec.seat_width / 2)
    parts.append(rod(at.rear, at.rear * (1, -1, 1), 0.7 * radius))
    crossing = at.front + 0.62 * (at.elbow - at.front)
    parts += [rod(at.rear * (1, s, 1) + (0, 0, 0.02), crossing * (1, -s, 1), 0.6 * radius, 6) for s in (1, -1)]
    front_edge = (0.17, spec.seat_height)
    parts.append(panel((at.seat_rear[0], at.seat_rear[2]), front_edge, spec.seat_width, 0.03))
    parts.append(
        panel((at.seat_rear[0], at.seat_rear[2]), (at.back_top[0], at.back_top[2]), spec.seat_width, 0.03)
    )
    shank = at.front + 0.18 * (at.elbow - at.front)
    parts.append(panel(front_edge, (shank[0] - 0.01, shank[2]), 0.8 * spec.seat_width, 0.012))
    parts.append(rod(shank * (1, 1, 1), shank * (1, -1, 1), 0.8 * radius))
    return joined(parts)


def make_umbrella(spec: UmbrellaStrollerSpec) -> Occluder:
    """Builds the stroller; anchors "handle_left" and "handle_right" on its two grips."""
    at = _layout(spec)
    anchors = []
    for name, sign in (("handle_left", 1.0), ("handle_right", -1.0)):
        flip = np.array([1.0, sign, 1.0])
        middle = (at.grip + 0.4 * (at.elbow - at.grip)) * flip
        anchors.append(grip_anchor(name, middle, sign * (at.elbow - at.grip) * flip, (0.032, 0.1)))
    return occluder("stroller", umbrella_linkage(spec).posed(), tuple(anchors))
