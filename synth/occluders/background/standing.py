"""What stands in rooms: pillars, coats on a stand, floor lamps, plants."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about, translation
from synth.occluders.kit.bars import rod
from synth.occluders.kit.parts import Part, occluder
from synth.occluders.kit.shapes import box, cylinder, frustum, slab
from synth.occluders.kit.spec import Spec, chance, count, flag, number, uniform
from synth.occluders.model import Occluder


@dataclass(frozen=True)
class PillarSpec(Spec):
    """A pillar from floor to ceiling.

    Attributes:
        width: Diameter, or side of a square one [m].
        height: Of the room [m].
        is_round: Whether it is round.
    """

    width: float = number(0.1, 1.5)
    height: float = number(1.5, 12.0)
    is_round: bool = flag()


def sample_pillar(rng: np.random.Generator) -> PillarSpec:
    """Draws a pillar of 0.25-0.6 m (common in concrete frames)."""
    return PillarSpec(width=uniform(rng, 0.25, 0.6), height=3.0, is_round=chance(rng, 0.6))


def make_pillar(spec: PillarSpec) -> Occluder:
    """Builds the pillar; no anchors."""
    shaft = (
        cylinder(spec.width / 2, spec.height) if spec.is_round else box(spec.width, spec.width, spec.height, 0.008)
    )
    return occluder("background", [shaft.at(0, 0, spec.height / 2)])


@dataclass(frozen=True)
class CoatStandSpec(Spec):
    """A stand with coats on it: from afar it looks like a person.

    Attributes:
        height: Of the pole [m].
        foot: Radius of the foot [m].
        n_coats: That hang on it.
        shoulder: Width of a coat at its shoulders [m].
        length: Of a coat from the hook to its hem [m].
        flare: Width of a coat at its hem over that at its shoulders.
        bulk: Thickness of a coat [m].
        has_hat: Whether a hat hangs on top.
        turn: Direction of the first coat [rad].
    """

    height: float = number(1.2, 2.2)
    foot: float = number(0.12, 0.4)
    n_coats: int = count(0, 6)
    shoulder: float = number(0.2, 0.6)
    length: float = number(0.4, 1.4)
    flare: float = number(0.6, 1.6)
    bulk: float = number(0.05, 0.25)
    has_hat: bool = flag()
    turn: float = number(-np.pi, np.pi)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require(self.length <= self.height - 0.2, f"length={self.length} must end 0.2 m above the floor")


def sample_coat_stand(rng: np.random.Generator) -> CoatStandSpec:
    """Draws a stand of 1.65-1.85 m (typical of makers) with one to four coats (sizes of clothes are ours)."""
    return CoatStandSpec(
        height=uniform(rng, 1.65, 1.85),
        foot=uniform(rng, 0.18, 0.28),
        n_coats=int(rng.integers(1, 5)),
        shoulder=uniform(rng, 0.3, 0.46),
        length=uniform(rng, 0.65, 1.2),
        flare=uniform(rng, 0.85, 1.25),
        bulk=uniform(rng, 0.09, 0.18),
        has_hat=chance(rng, 0.4),
        turn=uniform(rng, -np.pi, np.pi),
    )


def make_coat_stand(spec: CoatStandSpec) -> Occluder:
    """Builds the stand; no anchors."""
    parts = [
        cylinder(spec.foot, 0.03).at(0, 0, 0.015),
        cylinder(0.02, spec.height, 0.003).at(0, 0, spec.height / 2),
    ]
    for k in range(spec.n_coats):
        bearing = spec.turn + 2 * np.pi * k / spec.n_coats
        T = rotation_about((0.0, 0.0, 1.0), bearing) @ translation(0.05 + spec.bulk / 2, 0, spec.height - 0.08)
        parts += [part.moved(T) for part in _coat(spec)]
    if spec.has_hat:
        parts.append(cylinder(0.17, 0.02).at(0, 0, spec.height + 0.01))
        parts.append(frustum(0.1, 0.08, 0.12).at(0, 0, spec.height + 0.08))
    return occluder("background", parts)


def _coat(spec: CoatStandSpec) -> list[Part]:
    """A coat that hangs from the origin down: slabs whose width goes from the shoulders to the hem, and sleeves."""
    n_slabs = 6
    step = spec.length / n_slabs
    parts = []
    for k in range(n_slabs):
        share = (k + 0.5) / n_slabs
        width = spec.shoulder * (0.55 if k == 0 else 1.0 + (spec.flare - 1.0) * share)
        thickness = spec.bulk * (0.7 + 0.3 * share)
        part = slab(thickness, width, step + 0.01, thickness / 2 - 0.001, 0.02)
        parts.append(part.at(0, 0, -(k + 0.5) * step))
    sleeve = min(0.6, 0.75 * spec.length)
    for side in (-1, 1):
        shoulder = (0.0, side * (spec.shoulder / 2 - 0.01), -step - 0.02)
        cuff = (0.03, side * (spec.shoulder / 2 + 0.05), -step - sleeve)
        parts.append(rod(shoulder, cuff, 0.05, 10))
    parts.append(rod((-0.05 - spec.bulk / 2, 0, 0.0), (0.0, 0, -0.02), 0.008, 6))
    return parts


@dataclass(frozen=True)
class FloorLampSpec(Spec):
    """A lamp on a pole.

    Attributes:
        height: To the top of its shade [m].
        foot: Radius of the foot [m].
        shade: Radius of the shade at its lower edge [m].
        shade_height: [m].
    """

    height: float = number(1.0, 2.2)
    foot: float = number(0.08, 0.3)
    shade: float = number(0.06, 0.4)
    shade_height: float = number(0.1, 0.6)


def sample_floor_lamp(rng: np.random.Generator) -> FloorLampSpec:
    """Draws a floor lamp of 1.4-1.75 m (typical of makers)."""
    return FloorLampSpec(
        height=uniform(rng, 1.4, 1.75),
        foot=uniform(rng, 0.12, 0.18),
        shade=uniform(rng, 0.14, 0.25),
        shade_height=uniform(rng, 0.2, 0.35),
    )


def make_floor_lamp(spec: FloorLampSpec) -> Occluder:
    """Builds the lamp; no anchors."""
    pole = spec.height - 0.5 * spec.shade_height
    return occluder(
        "background",
        [
            cylinder(spec.foot, 0.025).at(0, 0, 0.0125),
            cylinder(0.012, pole).at(0, 0, pole / 2),
            frustum(spec.shade, 0.7 * spec.shade, spec.shade_height).at(0, 0, spec.height - spec.shade_height / 2),
        ],
    )


@dataclass(frozen=True)
class PlantSpec(Spec):
    """A plant in a pot.

    Attributes:
        pot: Radius of the pot's rim [m].
        pot_height: [m].
        height: Of the whole plant [m].
        spread: Radius of its leaves [m].
        n_leaves: How many.
        growth: Number of the pattern in which they grow.
    """

    pot: float = number(0.06, 0.4)
    pot_height: float = number(0.08, 0.6)
    height: float = number(0.3, 2.5)
    spread: float = number(0.1, 0.8)
    n_leaves: int = count(4, 80)
    growth: int = count(0, 2**31)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require(self.height >= self.pot_height + 0.15, f"height={self.height} leaves no room for leaves")


def sample_plant(rng: np.random.Generator) -> PlantSpec:
    """Draws a house plant of 0.6-1.8 m (sizes are ours)."""
    height = uniform(rng, 0.6, 1.8)
    return PlantSpec(
        pot=uniform(rng, 0.13, 0.22),
        pot_height=uniform(rng, 0.22, 0.38),
        height=height,
        spread=uniform(rng, 0.22, 0.25 + 0.2 * height),
        n_leaves=int(rng.integers(14, 28)),
        growth=int(rng.integers(1 << 31)),
    )


def make_plant(spec: PlantSpec) -> Occluder:
    """Builds pot, stem and leaves, each leaf on its own stalk; no anchors."""
    rng = np.random.default_rng(spec.growth)
    top = spec.height - 0.05
    parts = [
        frustum(0.75 * spec.pot, spec.pot, spec.pot_height).at(0, 0, spec.pot_height / 2),
        rod((0, 0, 0.5 * spec.pot_height), (0, 0, top), 0.012, 6),
    ]
    for k in range(spec.n_leaves):
        share = (k + 0.5) / spec.n_leaves
        base = spec.pot_height + 0.03 + share * (top - spec.pot_height - 0.05)
        bearing = 2.39996 * k + float(rng.uniform(-0.4, 0.4))
        rise = float(rng.uniform(-0.15, 0.5))
        reach = spec.spread * float(rng.uniform(0.45, 1.0)) * float(np.sqrt(1.0 - 0.6 * abs(2 * share - 1)))
        length = min(0.3, 0.6 * reach)
        turned = rotation_about((0.0, 0.0, 1.0), bearing) @ rotation_about((0.0, 1.0, 0.0), -rise)
        T = translation(0, 0, base) @ turned
        parts.append(box(length, 0.45 * length, 0.004, 0.001).at(reach - length / 2, 0, 0).moved(T))
        parts.append(rod((0, 0, 0), (reach - 0.8 * length, 0, 0), 0.004, 4).moved(T))
    return occluder("background", parts)
