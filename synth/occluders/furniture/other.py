"""Things without a class of their own: stacked boxes, and round bins and planters."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about
from synth.occluders.kit.parts import occluder
from synth.occluders.kit.shapes import box, cylinder, frustum
from synth.occluders.kit.spec import Spec, chance, count, flag, number, uniform
from synth.occluders.model import Occluder


@dataclass(frozen=True)
class BoxesSpec(Spec):
    """One box, or a few on top of each other.

    Attributes:
        n_boxes: How many.
        depth: Of the lowest along x [m].
        width: Of the lowest along y [m].
        height: Of each [m].
        shrink: Each box's sides over those of the one below.
        turn: Of each box against the one below about the vertical [rad].
    """

    n_boxes: int = count(1, 4)
    depth: float = number(0.1, 1.2)
    width: float = number(0.1, 2.0)
    height: float = number(0.05, 2.0)
    shrink: float = number(0.5, 1.0)
    turn: float = number(-np.pi, np.pi)


def sample_boxes(rng: np.random.Generator) -> BoxesSpec:
    """Draws boxes from a parcel to a low cabinet, at most 1.2 m high together."""
    n_boxes = int(rng.choice((1, 1, 2, 3)))
    return BoxesSpec(
        n_boxes=n_boxes,
        depth=uniform(rng, 0.25, 0.6),
        width=uniform(rng, 0.3, 0.9),
        height=uniform(rng, 0.25, 1.1) if n_boxes == 1 else uniform(rng, 0.2, 0.4),
        shrink=uniform(rng, 0.75, 1.0),
        turn=uniform(rng, -0.5, 0.5),
    )


def make_boxes(spec: BoxesSpec) -> Occluder:
    """Builds the stack; no anchors."""
    parts = []
    for k in range(spec.n_boxes):
        scale = spec.shrink**k
        one = box(scale * spec.depth, scale * spec.width, spec.height, 0.004)
        turned = one.moved(rotation_about((0.0, 0.0, 1.0), k * spec.turn))
        parts.append(turned.at(0, 0, (k + 0.5) * spec.height))
    return occluder("other", parts)


@dataclass(frozen=True)
class BinSpec(Spec):
    """A bin or planter.

    Attributes:
        radius: Of its rim [m].
        foot: Radius of its foot over that of its rim.
        height: [m].
        has_rim: Whether a band runs round its rim.
    """

    radius: float = number(0.08, 0.6)
    foot: float = number(0.4, 1.2)
    height: float = number(0.1, 1.5)
    has_rim: bool = flag()


def sample_bin(rng: np.random.Generator) -> BinSpec:
    """Draws a bin or planter, 0.3-1.0 m high."""
    return BinSpec(
        radius=uniform(rng, 0.13, 0.3),
        foot=uniform(rng, 0.65, 1.0),
        height=uniform(rng, 0.3, 1.0),
        has_rim=chance(rng, 0.6),
    )


def make_bin(spec: BinSpec) -> Occluder:
    """Builds the bin, filled to its rim; no anchors."""
    parts = [frustum(spec.foot * spec.radius, spec.radius, spec.height).at(0, 0, spec.height / 2)]
    if spec.has_rim:
        parts.append(cylinder(spec.radius + 0.012, 0.04, 0.006).at(0, 0, spec.height - 0.015))
    return occluder("other", parts)
