"""Prams: a bassinet with a cover and a canopy on a frame with four spoked wheels and one bar to push."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about, translation
from synth.occluders.kit.bars import bent, rod, tube
from synth.occluders.kit.linkage import Joint, Linkage
from synth.occluders.kit.parts import Part, joined, occluder
from synth.occluders.kit.shapes import box, cylinder, slab
from synth.occluders.kit.spec import Spec, count, flag, number, uniform
from synth.occluders.model import Occluder
from synth.occluders.stroller.fittings import (
    AXLE,
    CANOPY_TILT,
    bar_anchors,
    canopy,
    canopy_joint,
    spoked_wheel,
)

HANDLE_TURN = 0.5
"""How far the handle turns down from its spec's height [rad]."""


@dataclass(frozen=True)
class PramSpec(Spec):
    """A pram; it rolls along x, whoever pushes it stands at -x and sees the child's face under the canopy.

    Attributes:
        handle_height: Of the bar above the floor at handle_turn 0 [m].
        handle_turn: How far the handle is turned down [rad].
        handle_width: Of the bar [m].
        length: From the front to the rear axle [m].
        width: Between the wheels [m].
        front_radius: Of the front wheels [m].
        rear_radius: Of the rear wheels [m].
        n_spokes: Of each wheel.
        bassinet_length: Along x [m].
        bassinet_width: Along y [m].
        bassinet_depth: From its rim to its floor [m].
        rim_height: Of the bassinet's rim above the floor [m].
        canopy_span: Angle that the canopy covers [rad].
        canopy_tilt: How far the canopy is turned down over the bassinet's head [rad].
        has_basket: Whether a basket hangs between the axles.
    """

    handle_height: float = number(0.85, 1.25)
    handle_turn: float = number(0.0, HANDLE_TURN)
    handle_width: float = number(0.35, 0.65)
    length: float = number(0.45, 0.9)
    width: float = number(0.4, 0.7)
    front_radius: float = number(0.08, 0.22)
    rear_radius: float = number(0.08, 0.26)
    n_spokes: int = count(3, 12)
    bassinet_length: float = number(0.6, 0.95)
    bassinet_width: float = number(0.3, 0.5)
    bassinet_depth: float = number(0.14, 0.3)
    rim_height: float = number(0.6, 0.95)
    canopy_span: float = number(0.5, 2.2)
    canopy_tilt: float = number(0.0, CANOPY_TILT)
    has_basket: bool = flag()

    def __post_init__(self) -> None:
        super().__post_init__()
        room = self.rim_height - self.bassinet_depth - 2 * max(self.front_radius, self.rear_radius)
        self.require(room >= 0.02, f"rim_height={self.rim_height} leaves {room:.2f} m between wheels and bassinet")


def sample_pram(rng: np.random.Generator) -> PramSpec:
    """Draws a pram with the sizes of makers: bassinets 0.75-0.85 m long, bars 0.98-1.1 m high."""
    front = uniform(rng, 0.1, 0.15)
    return PramSpec(
        handle_height=uniform(rng, 1.0, 1.1),
        handle_turn=uniform(rng, 0.0, 0.25),
        handle_width=uniform(rng, 0.44, 0.52),
        length=uniform(rng, 0.55, 0.7),
        width=uniform(rng, 0.52, 0.6),
        front_radius=front,
        rear_radius=round(front * uniform(rng, 1.0, 1.4), 4),
        n_spokes=int(rng.integers(5, 9)),
        bassinet_length=uniform(rng, 0.76, 0.85),
        bassinet_width=uniform(rng, 0.36, 0.42),
        bassinet_depth=uniform(rng, 0.18, 0.24),
        rim_height=uniform(rng, 0.72, 0.82),
        canopy_span=uniform(rng, 1.2, 1.9),
        canopy_tilt=uniform(rng, 0.0, 0.12),
        has_basket=bool(rng.random() < 0.7),
    )


def pram_linkage(spec: PramSpec) -> Linkage:
    """Chassis with the bassinet, wheels, handle and canopy."""
    links: list[tuple[str, Part]] = [("chassis", _chassis(spec))]
    joints: list[Joint] = []
    for name, sign_x, radius in (("front", 1, spec.front_radius), ("rear", -1, spec.rear_radius)):
        wheel = spoked_wheel(radius, 0.042, spec.n_spokes)
        for side, sign in (("left", 1), ("right", -1)):
            links.append((f"{name}_{side}_wheel", wheel))
            origin = (sign_x * spec.length / 2, sign * spec.width / 2, radius)
            joints.append(Joint(f"{name}_{side}_axle", "continuous", "chassis", links[-1][0], origin, (0, 1, 0)))
    pivot = (-0.2, 0.0, _floor_height(spec))
    links.append(("handle", _handle(spec)))
    turn = (0.0, -1.0, 0.0)
    joints.append(
        Joint("handle_pivot", "revolute", "chassis", "handle", pivot, turn, 0.0, HANDLE_TURN, spec.handle_turn)
    )
    # The head lies at +x: seen from there, the canopy is a stroller's turned round.
    head = canopy(0.27, spec.bassinet_width + 0.02, 0.15, spec.canopy_span)
    links.append(("canopy", head.moved(rotation_about((0, 0, 1), np.pi))))
    hinge = (spec.bassinet_length / 2 - 0.27, 0.0, spec.rim_height - 0.02)
    joint = canopy_joint("chassis", hinge, spec.canopy_tilt)
    joints.append(Joint(**{**vars(joint), "axis": (0.0, -1.0, 0.0)}))
    return Linkage("pram", tuple(links), tuple(joints))


def _floor_height(spec: PramSpec) -> float:
    """Height of the bassinet's floor [m]."""
    return spec.rim_height - spec.bassinet_depth


def _handle_end(spec: PramSpec) -> tuple[float, float]:
    """X and z of the bar, in the handle's frame [m]."""
    return -0.42, spec.handle_height - _floor_height(spec)


def _handle(spec: PramSpec) -> Part:
    """A U of tube from the pivots on both sides, with a padded bar."""
    x, z = _handle_end(spec)
    y, inner = spec.handle_width / 2, spec.bassinet_width / 2 + 0.03
    corners = [(0, inner, 0), (0.9 * x, y, 0.9 * z), (x, y, z), (x, -y, z), (0.9 * x, -y, 0.9 * z), (0, -inner, 0)]
    return joined([tube(bent(corners, 0.07), 0.0125), rod((x, 0.75 * y, z), (x, -0.75 * y, z), 0.0175)])


def _chassis(spec: PramSpec) -> Part:
    length, width, depth = spec.bassinet_length, spec.bassinet_width, spec.bassinet_depth
    # The bassinet's profile has round ends, its cover lies over the foot's half.
    tub = slab(length, depth, width, 0.45 * depth, 0.02).moved(AXLE).at(0, 0, spec.rim_height - depth / 2)
    rim = slab(length - 0.04, width + 0.016, 0.03, 0.12, 0.008).at(0, 0, spec.rim_height - 0.012)
    cover = slab(0.55 * length, width - 0.03, 0.06, 0.1, 0.018).at(-0.2 * length, 0, spec.rim_height + 0.012)
    parts = [tub, rim, cover]
    x, floor = spec.length / 2, _floor_height(spec)
    y_frame = width / 2 + 0.03
    for sign in (1, -1):
        y = sign * y_frame
        front, rear = (x, y, spec.front_radius), (-x, y, spec.rear_radius)
        parts.append(tube(bent([front, (-0.2, y, floor)], 0.05), 0.0125))
        parts.append(tube(bent([rear, (0.2, y, floor)], 0.05), 0.0125))
        parts.append(box(0.1, 0.03, 0.05, 0.006).at(-0.2, y, floor))
        parts.append(box(0.1, 0.03, 0.05, 0.006).at(0.2, y, floor))
    for sx, radius in ((1, spec.front_radius), (-1, spec.rear_radius)):
        parts.append(cylinder(0.009, spec.width).moved(AXLE).at(sx * x, 0, radius))
    for sx in (-1, 1):
        parts.append(cylinder(0.0125, 2 * y_frame).moved(AXLE).at(sx * 0.2, 0, floor))
    if spec.has_basket:
        z = max(spec.front_radius, spec.rear_radius) + 0.06
        parts.append(slab(0.72 * spec.length, spec.width - 0.12, 0.1, 0.05, 0.015).at(0, 0, z))
    return joined(parts)


def make_pram(spec: PramSpec) -> Occluder:
    """Builds the pram; anchors "handle_left" and "handle_right" on its bar."""
    linkage = pram_linkage(spec)
    x, z = _handle_end(spec)
    T = linkage.link_poses()["handle"] @ translation(x, 0.0, z)
    return occluder("stroller", linkage.posed(), bar_anchors(T, 0.45 * spec.handle_width / 2, 0.035))
