"""What hangs on walls: curtains, radiators, pictures and boards."""

from dataclasses import dataclass

import numpy as np

from synth.occluders.kit.parts import SolidRow, filled, occluder, pose
from synth.occluders.kit.shapes import box
from synth.occluders.kit.spec import Spec, count, number, uniform
from synth.occluders.model import BOX, Occluder

CLOTH = 0.006
"""Thickness of a curtain [m]."""
STEPS_A_FOLD = 10
"""Facets of one fold."""


@dataclass(frozen=True)
class CurtainSpec(Spec):
    """A curtain that hangs in folds along y.

    Attributes:
        width: Along y, as it hangs [m].
        bottom: Of its hem above the floor [m].
        top: Of its upper edge above the floor [m].
        fold: Length of one fold along y [m].
        swing: Half the depth of the folds [m].
    """

    width: float = number(0.2, 3.0)
    bottom: float = number(0.0, 1.5)
    top: float = number(0.8, 3.5)
    fold: float = number(0.06, 0.3)
    swing: float = number(0.01, 0.08)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require(self.top - self.bottom >= 0.3, f"top={self.top} must be 0.3 m above bottom={self.bottom}")


def sample_curtain(rng: np.random.Generator) -> CurtainSpec:
    """Draws a curtain of 0.35-1.1 m, folds of 9-18 cm and 4-9 cm deep (sizes are ours)."""
    return CurtainSpec(
        width=uniform(rng, 0.35, 1.1),
        bottom=uniform(rng, 0.01, 0.06),
        top=uniform(rng, 2.2, 2.4),
        fold=uniform(rng, 0.09, 0.18),
        swing=uniform(rng, 0.02, 0.045),
    )


def make_curtain(spec: CurtainSpec) -> Occluder:
    """Builds the cloth; no anchors."""
    n = max(2, int(np.ceil(spec.width / spec.fold * STEPS_A_FOLD)))
    y = np.linspace(-spec.width / 2, spec.width / 2, n + 1)
    x = spec.swing * np.sin(2 * np.pi * y / spec.fold)
    slope = 2 * np.pi * spec.swing / spec.fold * np.cos(2 * np.pi * y / spec.fold)
    across = np.stack([np.ones_like(slope), -slope], axis=1) / np.hypot(1.0, slope)[:, None]
    front, rear = (np.stack([x, y], axis=1) + side * CLOTH / 2 * across for side in (1, -1))
    points = np.concatenate([front, rear])
    vertices = np.concatenate(
        [np.column_stack([points, np.full(len(points), z)]) for z in (spec.bottom, spec.top)]
    )
    rows: list[SolidRow] = []
    z_mid, half = (spec.bottom + spec.top) / 2, (spec.top - spec.bottom) / 2
    for k in range(n):
        along = np.array([x[k + 1] - x[k], y[k + 1] - y[k], 0.0])
        length = float(np.linalg.norm(along))
        T = pose(((x[k] + x[k + 1]) / 2, (y[k] + y[k + 1]) / 2, z_mid))
        T[:3, 1] = along / length
        T[:3, 0] = (along[1] / length, -along[0] / length, 0.0)
        rows.append((BOX, T, (CLOTH / 2, length / 2, half)))
    return occluder("background", [filled((vertices, _cloth_faces(n)), rows)])


def _cloth_faces(n: int) -> np.ndarray:
    """Faces of a cloth of n facets: front and rear lines of n + 1 points below, then the same above."""
    m = n + 1
    k = np.arange(n)
    quads = [
        (k, k + 1, 2 * m + k + 1, 2 * m + k),  # front
        (m + k + 1, m + k, 3 * m + k, 3 * m + k + 1),  # rear
        (2 * m + k, 2 * m + k + 1, 3 * m + k + 1, 3 * m + k),  # upper edge
        (m + k, m + k + 1, k + 1, k),  # hem
    ]
    ends = [(np.array([m]), np.array([0]), np.array([2 * m]), np.array([3 * m])),
            (np.array([n]), np.array([m + n]), np.array([3 * m + n]), np.array([2 * m + n]))]  # fmt: skip
    faces = []
    for a, b, c, d in quads + ends:
        faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    return np.concatenate(faces).astype(np.int32)


@dataclass(frozen=True)
class RadiatorSpec(Spec):
    """A radiator on a wall.

    Attributes:
        width: Along y [m].
        depth: Along x [m].
        height: [m].
        bottom: Above the floor [m].
        n_panels: Panels behind each other.
    """

    width: float = number(0.3, 3.0)
    depth: float = number(0.05, 0.25)
    height: float = number(0.2, 1.0)
    bottom: float = number(0.03, 0.3)
    n_panels: int = count(1, 3)


def sample_radiator(rng: np.random.Generator) -> RadiatorSpec:
    """Draws a panel radiator: 0.5-0.6 m high, 0.1-0.15 m above the floor (EN 442 sizes)."""
    return RadiatorSpec(
        width=uniform(rng, 0.6, 1.6),
        depth=uniform(rng, 0.07, 0.16),
        height=uniform(rng, 0.5, 0.6),
        bottom=uniform(rng, 0.1, 0.15),
        n_panels=int(rng.integers(1, 3)),
    )


def make_radiator(spec: RadiatorSpec) -> Occluder:
    """Builds the panels and two brackets that reach to the wall behind them; no anchors."""
    thickness = min(0.03, 0.8 * spec.depth / spec.n_panels)
    front = spec.depth / 2 - thickness / 2
    z = spec.bottom + spec.height / 2
    xs = np.linspace(front, front - (spec.depth - 0.06), spec.n_panels) if spec.n_panels > 1 else [front]
    parts = [box(thickness, spec.width, spec.height, 0.004).at(float(x), 0, z) for x in xs]
    for y in (-0.3, 0.3):
        parts.append(box(spec.depth, 0.03, 0.7 * spec.height, 0.002).at(0, y * spec.width, z))
    return occluder("background", parts)


@dataclass(frozen=True)
class PanelSpec(Spec):
    """A picture, board or screen that hangs flat on a wall.

    Attributes:
        width: Along y [m].
        height: [m].
        depth: How far it stands out [m].
        bottom: Of its lower edge above the floor [m].
    """

    width: float = number(0.15, 4.0)
    height: float = number(0.15, 2.0)
    depth: float = number(0.01, 0.15)
    bottom: float = number(0.1, 2.5)


def sample_panel(rng: np.random.Generator) -> PanelSpec:
    """Draws a picture, a television or a whiteboard, its middle at 1.3-1.6 m (sizes are ours)."""
    kind = int(rng.choice(3, p=(0.6, 0.25, 0.15)))
    width = uniform(rng, *((0.3, 1.0), (0.9, 1.4), (1.2, 2.4))[kind])
    height = uniform(rng, *((0.3, 0.8), (0.52, 0.8), (0.9, 1.2))[kind])
    return PanelSpec(
        width=width,
        height=height,
        depth=uniform(rng, *((0.015, 0.04), (0.04, 0.09), (0.02, 0.03))[kind]),
        bottom=round(uniform(rng, 1.3, 1.6) - height / 2, 4),
    )


def make_panel(spec: PanelSpec) -> Occluder:
    """Builds the panel; no anchors."""
    middle = spec.bottom + spec.height / 2
    return occluder("background", [box(spec.depth, spec.width, spec.height, 0.004).at(0, 0, middle)])
