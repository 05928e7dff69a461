"""Desks with drawers under one or both ends of the top."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import translation
from synth.occluders.kit.bars import rod
from synth.occluders.kit.parts import Part, joined, occluder
from synth.occluders.kit.shapes import box, slab
from synth.occluders.kit.spec import Spec, chance, choice, count, flag, number, pick, uniform
from synth.occluders.model import Anchor, Occluder

SIDES = ("left", "right", "both")


@dataclass(frozen=True)
class DeskSpec(Spec):
    """A desk; its user sits at -x between drawers and looks along x.

    Attributes:
        depth: Of the top along x [m].
        width: Of the top along y [m].
        height: Of the top's surface [m].
        thickness: Of the top [m].
        drawers: Where drawers stand, seen by the user: "left", "right" or "both".
        drawer_width: Of a drawer cabinet [m].
        n_drawers: In a cabinet.
        has_legs: Whether an end without drawers stands on two legs, not on a board.
        modesty: Height of the board at the far side, 0 for none [m].
    """

    depth: float = number(0.5, 1.0)
    width: float = number(1.0, 2.4)
    height: float = number(0.6, 0.85)
    thickness: float = number(0.015, 0.05)
    drawers: str = choice(*SIDES)
    drawer_width: float = number(0.25, 0.5)
    n_drawers: int = count(1, 5)
    has_legs: bool = flag()
    modesty: float = number(0.0, 0.7)

    def __post_init__(self) -> None:
        super().__post_init__()
        knee_room = self.width - self.drawer_width * (2 if self.drawers == "both" else 1)
        self.require(knee_room >= 0.5, f"drawers leave {knee_room:.2f} m for the knees, at least 0.5 is needed")


def sample_desk(rng: np.random.Generator) -> DeskSpec:
    """Draws a desk: 0.72-0.76 m high (EN 527-1: 0.74 m), 0.6-0.8 m deep, 1.2-1.8 m wide."""
    drawers = pick(rng, SIDES, (0.4, 0.4, 0.2))
    return DeskSpec(
        depth=uniform(rng, 0.6, 0.8),
        width=uniform(rng, 1.4, 1.8) if drawers == "both" else uniform(rng, 1.2, 1.7),
        height=uniform(rng, 0.72, 0.76),
        thickness=uniform(rng, 0.018, 0.03),
        drawers=drawers,
        drawer_width=uniform(rng, 0.33, 0.42),
        n_drawers=int(rng.integers(2, 5)),
        has_legs=chance(rng, 0.5),
        modesty=uniform(rng, 0.25, 0.6) if chance(rng, 0.6) else 0.0,
    )


def make_desk(spec: DeskSpec) -> Occluder:
    """Builds the desk; anchor "top" is its surface."""
    under = spec.height - spec.thickness
    parts = [slab(spec.depth, spec.width, spec.thickness, 0.008).at(0, 0, spec.height - spec.thickness / 2)]
    for sign, side in ((1, "left"), (-1, "right")):
        if spec.drawers in (side, "both"):
            y = sign * (spec.width / 2 - spec.drawer_width / 2 - 0.02)
            parts.append(_cabinet(spec, under).at(0, y, 0))
        else:
            parts += _open_end(spec, under, sign)
    if spec.modesty > 0:
        height = min(spec.modesty, under - 0.05)
        board = box(0.018, spec.width - 0.1, height)
        parts.append(board.at(spec.depth / 2 - 0.06, 0, under - height / 2))
    anchor = Anchor("top", translation(0, 0, spec.height), (spec.depth, spec.width))
    return occluder("table", parts, (anchor,))


def _cabinet(spec: DeskSpec, under: float) -> Part:
    """Drawers from a few centimetres above the floor up to the top, fronts towards -x."""
    depth, plinth = spec.depth - 0.06, 0.05
    parts = [
        box(depth - 0.02, spec.drawer_width, under - plinth).at(0.01, 0, (under + plinth) / 2),
        box(depth - 0.1, spec.drawer_width - 0.04, plinth).at(0.03, 0, plinth / 2),
    ]
    step = (under - plinth) / spec.n_drawers
    for k in range(spec.n_drawers):
        z = plinth + (k + 0.5) * step
        parts.append(box(0.02, spec.drawer_width - 0.006, step - 0.008).at(-depth / 2 + 0.01, 0, z))
        grip = [(-depth / 2 - 0.015, y, z) for y in (-0.06, 0.06)]
        parts.append(rod(grip[0], grip[1], 0.006, 6))
    return joined(parts)


def _open_end(spec: DeskSpec, under: float, sign: int) -> list[Part]:
    y = sign * (spec.width / 2 - 0.04)
    if spec.has_legs:
        x = spec.depth / 2 - 0.05
        return [box(0.045, 0.045, under).at(sx * x, y, under / 2) for sx in (-1, 1)]
    return [box(spec.depth - 0.06, 0.025, under).at(0, y, under / 2)]
