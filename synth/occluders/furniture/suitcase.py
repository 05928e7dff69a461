"""Trolley suitcases with a drawn-out handle."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about
from synth.occluders.kit.bars import bent, rod, tube
from synth.occluders.kit.parts import Part, frame, occluder
from synth.occluders.kit.shapes import box, cylinder, slab
from synth.occluders.kit.spec import Spec, chance, count, flag, number, uniform
from synth.occluders.model import Anchor, Occluder

_ON_EDGE = rotation_about((0.0, 1.0, 0.0), np.pi / 2)
_AXLE = rotation_about((1.0, 0.0, 0.0), np.pi / 2)


@dataclass(frozen=True)
class SuitcaseSpec(Spec):
    """A suitcase standing upright; its broad face looks along x, its handle is drawn out upwards.

    Attributes:
        height: Of the case with its wheels [m].
        width: Along y [m].
        depth: Along x [m].
        corner: Radius of the case's corners, seen from the front [m].
        wheel: Diameter of the wheels [m].
        handle: Length that the handle is drawn out, 0 for pushed in [m].
        n_ribs: Grooved ribs on each broad face, 0 for a smooth case.
        is_soft: Whether it has a front pocket instead of ribs.
    """

    height: float = number(0.4, 0.95)
    width: float = number(0.25, 0.65)
    depth: float = number(0.14, 0.45)
    corner: float = number(0.02, 0.1)
    wheel: float = number(0.02, 0.1)
    handle: float = number(0.0, 0.65)
    n_ribs: int = count(0, 9)
    is_soft: bool = flag()


def sample_suitcase(rng: np.random.Generator) -> SuitcaseSpec:
    """Draws a case, from cabin size (IATA's guide: 0.56 x 0.45 x 0.25 m at most) to checked size.

    Airlines take up to 1.58 m as the sum of height, width and depth. A handle's grip ends up 0.95-1.1 m high.
    """
    height = uniform(rng, 0.5, 0.56) if chance(rng, 0.5) else uniform(rng, 0.6, 0.78)
    is_drawn = chance(rng, 0.75)
    return SuitcaseSpec(
        height=height,
        width=round(height * uniform(rng, 0.62, 0.7), 4),
        depth=round(height * uniform(rng, 0.36, 0.42), 4),
        corner=uniform(rng, 0.035, 0.07),
        wheel=uniform(rng, 0.045, 0.06),
        handle=round(uniform(rng, 0.95, 1.08) - height, 4) if is_drawn else 0.0,
        n_ribs=int(rng.integers(0, 8)),
        is_soft=chance(rng, 0.35),
    )


def make_suitcase(spec: SuitcaseSpec) -> Occluder:
    """Builds the suitcase; anchors "handle_left" and "handle_right" share its one grip if it is drawn out."""
    body_height = spec.height - spec.wheel
    z = spec.wheel + body_height / 2
    shell = slab(body_height, spec.width, spec.depth, spec.corner, 0.02).moved(_ON_EDGE).at(0, 0, z)
    parts = [shell, *_faces(spec, body_height, z), *_wheels(spec)]
    grip = [(0, -0.06, spec.height - 0.002), (0, -0.055, spec.height + 0.022)]
    grip += [(0, 0.055, spec.height + 0.022), (0, 0.06, spec.height - 0.002)]
    parts.append(tube(bent(grip, 0.02), 0.008))
    anchors: tuple[Anchor, ...] = ()
    if spec.handle > 0.05:
        x, top = -spec.depth / 2 + 0.03, spec.height + spec.handle
        half = min(0.085, 0.3 * spec.width)
        parts += [rod((x, sy * half, spec.height - 0.03), (x, sy * half, top), 0.008) for sy in (-1, 1)]
        parts.append(slab(0.032, 2 * half + 0.05, 0.028, 0.012, 0.008).at(x, 0, top))
        T = frame((x, 0, top), (1, 0, 0), (0, 0, 1))
        anchors = tuple(Anchor(name, T, (0.03, 2 * half + 0.05)) for name in ("handle_left", "handle_right"))
    return occluder("suitcase", parts, anchors)


def _faces(spec: SuitcaseSpec, body_height: float, z: float) -> list[Part]:
    """What stands out of the broad faces."""
    if spec.is_soft:
        pocket = slab(0.55 * body_height, 0.82 * spec.width, 0.04, 0.04, 0.015).moved(_ON_EDGE)
        lid = slab(0.26 * body_height, 0.82 * spec.width, 0.03, 0.04, 0.012).moved(_ON_EDGE)
        x = spec.depth / 2
        return [pocket.at(x + 0.012, 0, z - 0.15 * body_height), lid.at(x + 0.008, 0, z + 0.3 * body_height)]
    rib = box(spec.depth + 0.012, 0.016, body_height - 2 * spec.corner, 0.004)
    ys = np.linspace(-0.4, 0.4, max(spec.n_ribs, 1))[: spec.n_ribs] * (spec.width - 0.04)
    return [rib.at(0, float(y), z) for y in ys]


def _wheels(spec: SuitcaseSpec) -> list[Part]:
    parts = []
    wheel = cylinder(spec.wheel / 2, 0.022, 0.005).moved(_AXLE)
    for sx in (-1, 1):
        for sy in (-1, 1):
            x, y = sx * (spec.depth / 2 - 0.045), sy * (spec.width / 2 - 0.045)
            parts.append(wheel.at(x, y, spec.wheel / 2))
            parts.append(box(0.05, 0.05, 0.5 * spec.wheel).at(x, y, 0.8 * spec.wheel))
    return parts
