"""Tables: rectangular, round and oval tops on legs, a pedestal, trestles or panels; coffee tables too."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.geometry import translation
from synth.occluders.kit.bars import beam, rod
from synth.occluders.kit.parts import Part, occluder
from synth.occluders.kit.shapes import box, cylinder, oval, post, slab
from synth.occluders.kit.spec import Spec, chance, choice, flag, number, pick, uniform
from synth.occluders.model import Anchor, Occluder

TOPS = ("rectangle", "round", "oval")
BASES = ("four_legs", "pedestal", "trestle", "panel")


@dataclass(frozen=True)
class TableSpec(Spec):
    """A table; its users sit at -x and +x, its width lies along y.

    Attributes:
        top: "rectangle", "round" or "oval".
        base: "four_legs", "pedestal", "trestle" or "panel".
        depth: Of the top along x; a round top's diameter [m].
        width: Of the top along y; for a round top the same as its depth [m].
        height: Of the top's surface [m].
        thickness: Of the top [m].
        corner: Radius of a rectangular top's corners, seen from above [m].
        leg: Thickness of a leg, a panel's bar or the pedestal's column [m].
        leg_taper: Thickness of a leg's foot over that of its upper end.
        is_leg_round: Whether legs are round and a pedestal stands on a disc, not on a cross.
        inset: From the top's edge to the legs, trestles or panels [m].
        apron: Height of the frame under the top, 0 for none [m].
        spread: Depth of pedestal foot, trestles or panels over the top's depth.
    """

    top: str = choice(*TOPS)
    base: str = choice(*BASES)
    depth: float = number(0.4, 1.6)
    width: float = number(0.4, 3.0)
    height: float = number(0.3, 1.15)
    thickness: float = number(0.01, 0.08)
    corner: float = number(0.0, 0.3)
    leg: float = number(0.02, 0.2)
    leg_taper: float = number(0.3, 1.0)
    is_leg_round: bool = flag()
    inset: float = number(0.0, 0.4)
    apron: float = number(0.0, 0.15)
    spread: float = number(0.3, 0.95)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require(
            self.top != "round" or self.depth == self.width,
            f"a round top has one diameter, but depth={self.depth} and width={self.width}",
        )
        across = min(self.depth, self.width) if self.base == "four_legs" else self.width
        self.require(
            self.base == "pedestal" or across / 2 > self.inset + self.leg,
            f"inset={self.inset} and leg={self.leg} leave no room under the top",
        )

    @property
    def under_top(self) -> float:
        """Height of the top's underside [m]."""
        return self.height - self.thickness


@dataclass(frozen=True)
class CoffeeTableSpec(TableSpec):
    """A low table: the fields of `TableSpec`, but lower."""

    height: float = number(0.3, 0.56)


def sample_table(rng: np.random.Generator) -> TableSpec:
    """Draws a dining, meeting or work table.

    Heights: 0.71-0.78 m, round EN 527-1's 0.74 m for fixed work tables and the 0.74-0.76 m of dining tables; tops
    give each sitter 0.6 m of edge, 0.75-1.0 m deep (Panero and Zelnik, Human Dimension and Interior Space, 1979).
    """
    top = pick(rng, TOPS, (0.6, 0.25, 0.15))
    base = pick(rng, BASES, (0.5, 0.2, 0.15, 0.15) if top == "rectangle" else (0.5, 0.5, 0.0, 0.0))
    depth, width = uniform(rng, 0.68, 1.0), uniform(rng, 1.1, 2.2)
    if top == "round":
        depth = width = uniform(rng, 0.8, 1.35)
    elif top == "oval":
        depth, width = uniform(rng, 0.85, 1.1), uniform(rng, 1.4, 2.1)
    elif base == "pedestal":
        width = uniform(rng, 0.7, 1.9)
    return TableSpec(**_sampled(rng, top, base, (depth, width, uniform(rng, 0.71, 0.78))))


def sample_coffee_table(rng: np.random.Generator) -> CoffeeTableSpec:
    """Draws a coffee table, 0.36-0.5 m high (typical of makers)."""
    top = pick(rng, TOPS)
    base = pick(rng, ("four_legs", "panel") if top == "rectangle" else ("four_legs", "pedestal"))
    depth, width = uniform(rng, 0.5, 0.7), uniform(rng, 0.8, 1.3)
    if top == "round":
        depth = width = uniform(rng, 0.6, 0.9)
    return CoffeeTableSpec(**_sampled(rng, top, base, (depth, width, uniform(rng, 0.36, 0.5))))


def _sampled(rng: np.random.Generator, top: str, base: str, size: tuple[float, float, float]) -> dict[str, Any]:
    """The fields that tables of all heights draw alike."""
    return {
        "top": top,
        "base": base,
        "depth": size[0],
        "width": size[1],
        "height": size[2],
        "thickness": uniform(rng, 0.018, 0.042),
        "corner": uniform(rng, 0.05, 0.14) if chance(rng, 0.3) else 0.006,
        "leg": uniform(rng, 0.07, 0.12) if base == "pedestal" else uniform(rng, 0.035, 0.075),
        "leg_taper": uniform(rng, 0.5, 0.9) if chance(rng, 0.4) else 1.0,
        "is_leg_round": chance(rng, 0.4),
        "inset": uniform(rng, 0.01, 0.07) if base == "four_legs" else uniform(rng, 0.04, 0.2),
        "apron": uniform(rng, 0.05, 0.09) if base == "four_legs" and chance(rng, 0.6) else 0.0,
        "spread": uniform(rng, 0.55, 0.85),
    }


def make_table(spec: TableSpec) -> Occluder:
    """Builds the table; anchor "top" is its surface."""
    z = spec.height - spec.thickness / 2
    if spec.top == "rectangle":
        top = slab(spec.depth, spec.width, spec.thickness, spec.corner, 0.004)
    elif spec.top == "round":
        top = cylinder(spec.depth / 2, spec.thickness, 0.004)
    else:
        top = oval(spec.depth, spec.width, spec.thickness)
    build = {"four_legs": _four_legs, "pedestal": _pedestals, "trestle": _trestles, "panel": _panels}
    shape = "rectangle" if spec.top == "rectangle" else "ellipse"
    anchor = Anchor("top", translation(0, 0, spec.height), (spec.depth, spec.width), shape)
    return occluder("table", [top.at(0, 0, z), *build[spec.base](spec)], (anchor,))


def _four_legs(spec: TableSpec) -> list[Part]:
    # Under an ellipse the legs stand where it meets its diagonal.
    shrink = 1.0 if spec.top == "rectangle" else np.sqrt(0.5)
    x = shrink * (spec.depth / 2 - spec.inset) - spec.leg / 2
    y = shrink * (spec.width / 2 - spec.inset) - spec.leg / 2
    height = spec.under_top
    leg = post(spec.leg * spec.leg_taper, spec.leg, height, spec.is_leg_round)
    parts = [leg.at(sx * x, sy * y, height / 2) for sx in (-1, 1) for sy in (-1, 1)]
    if spec.apron > 0:
        z = height - spec.apron / 2
        parts += [box(2 * x, 0.02, spec.apron).at(0, sy * y, z) for sy in (-1, 1)]
        parts += [box(0.02, 2 * y, spec.apron).at(sx * x, 0, z) for sx in (-1, 1)]
    return parts


def _pedestals(spec: TableSpec) -> list[Part]:
    """One column, or two under a long top."""
    foot = spec.spread * min(spec.depth, spec.width)
    is_long = spec.width > 1.55
    places = (-0.27 * spec.width, 0.27 * spec.width) if is_long else (0.0,)
    height = spec.under_top
    parts = []
    for y in places:
        parts.append(post(spec.leg, spec.leg * 0.9, height - 0.02, True).at(0, y, height / 2 + 0.01))
        parts.append(box(0.5 * foot, 0.5 * foot, 0.012).at(0, y, height - 0.006))
        if spec.is_leg_round:
            parts.append(cylinder(foot / 2, 0.022, 0.006).at(0, y, 0.011))
            continue
        for ax, ay in ((1, 0), (-1, 0)) if is_long else ((1, 0), (-1, 0), (0, 1), (0, -1)):
            end = (ax * foot / 2, y + ay * foot / 2, 0.03)
            parts.append(beam((0.0, y, 0.11), end, 0.06, 0.05))
            parts.append(cylinder(0.022, 0.02).at(ax * (foot / 2 - 0.03), y + ay * (foot / 2 - 0.03), 0.01))
    return parts


def _trestles(spec: TableSpec) -> list[Part]:
    """Two A-shaped trestles with a bar across each, joined by a stretcher."""
    y_trestle = spec.width / 2 - spec.inset - spec.leg / 2
    half = spec.spread * spec.depth / 2
    bar = min(spec.leg, 0.05)
    height = spec.under_top
    parts = []
    for y in (-y_trestle, y_trestle):
        for s in (-1, 1):
            # A leaning bar's lower end touches the floor with its edge.
            lift = bar / 2 * 0.7 * half / np.hypot(0.7 * half, height)
            foot, upper = (s * half, y, lift), (s * 0.3 * half, y, height - bar)
            if spec.is_leg_round:
                parts.append(rod(foot, upper, bar / 2))
            else:
                parts.append(beam(foot, upper, bar, bar))
        parts.append(box(1.1 * half, bar, bar).at(0, y, height - bar / 2))
        z = 0.35 * height
        x = half * (1 - 0.7 * (z - bar / 2) / (height - 1.5 * bar))
        parts.append(box(2 * x, 0.6 * bar, bar).at(0, y, z))
    parts.append(box(0.8 * bar, 2 * y_trestle, bar).at(0, 0, height - bar / 2))
    return parts


def _panels(spec: TableSpec) -> list[Part]:
    """A board at each end and a lower one between them."""
    y_panel = spec.width / 2 - spec.inset - 0.015
    depth, height = max(spec.spread, 0.6) * spec.depth, spec.under_top
    parts = [box(depth, 0.028, height).at(0, sy * y_panel, height / 2) for sy in (-1, 1)]
    z = height - 0.17 * min(height, 0.7)
    parts.append(box(0.02, 2 * y_panel, 0.34 * min(height, 0.7)).at(0.25 * depth, 0, z))
    return parts
