"""Bookshelves with what stands in them, and cabinets with closed fronts."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from synth.occluders.kit.parts import Part, occluder
from synth.occluders.kit.shapes import box
from synth.occluders.kit.spec import Spec, chance, count, flag, number, uniform
from synth.occluders.model import Occluder

BOARD = 0.022
"""Thickness of boards [m]."""
MAX_BOOKS = 6
"""Blocks of books or boxes in one compartment."""


@dataclass(frozen=True)
class ShelfSpec(Spec):
    """An open bookshelf; its back is at -x, its front looks along x.

    Attributes:
        width: Along y [m].
        depth: Along x [m].
        height: [m].
        n_boards: Compartments above each other.
        n_columns: Compartments beside each other.
        has_back: Whether a board closes its back.
        fill: Share of the compartments' width that books and boxes take.
        contents: Number of the pattern in which they stand.
    """

    width: float = number(0.3, 3.0)
    depth: float = number(0.18, 0.6)
    height: float = number(0.4, 2.6)
    n_boards: int = count(1, 8)
    n_columns: int = count(1, 4)
    has_back: bool = flag()
    fill: float = number(0.0, 1.0)
    contents: int = count(0, 2**31)

    def __post_init__(self) -> None:
        super().__post_init__()
        room = self.height / self.n_boards - BOARD
        self.require(room >= 0.12, f"{self.n_boards} boards leave {room:.2f} m for each, at least 0.12 is needed")


def sample_shelf(rng: np.random.Generator) -> ShelfSpec:
    """Draws a shelf: 0.6-1.2 m a column wide, 0.28-0.4 m deep, up to 2.2 m high (typical of makers)."""
    height = uniform(rng, 0.8, 2.2)
    n_columns = int(rng.choice((1, 1, 2)))
    return ShelfSpec(
        width=n_columns * uniform(rng, 0.6, 1.0),
        depth=uniform(rng, 0.28, 0.4),
        height=height,
        n_boards=max(2, round(height / uniform(rng, 0.3, 0.42))),
        n_columns=n_columns,
        has_back=chance(rng, 0.8),
        fill=uniform(rng, 0.2, 0.95),
        contents=int(rng.integers(1 << 31)),
    )


def make_shelf(spec: ShelfSpec) -> Occluder:
    """Builds the shelf and what stands in it; no anchors."""
    inner = spec.height - BOARD
    parts = [
        box(spec.depth, BOARD, inner, 0.002).at(0, y, inner / 2)
        for y in np.linspace(-0.5, 0.5, spec.n_columns + 1) * (spec.width - BOARD)
    ]
    levels = np.linspace(BOARD / 2, spec.height - BOARD / 2, spec.n_boards + 1)
    parts += [box(spec.depth, spec.width, BOARD, 0.002).at(0, 0, float(z)) for z in levels]
    if spec.has_back:
        parts.append(box(0.008, spec.width - 0.01, inner - 0.01, 0.001).at(0.004 - spec.depth / 2, 0, inner / 2))
    rng = np.random.default_rng(spec.contents)
    step = (spec.width - BOARD) / spec.n_columns
    for low, high in pairwise(levels):
        for k in range(spec.n_columns):
            left = -spec.width / 2 + BOARD + k * step
            parts += _books(spec, rng, left, step - BOARD, float(low) + BOARD / 2, float(high - low) - BOARD)
    return occluder("background", parts)


def _books(
    spec: ShelfSpec, rng: np.random.Generator, left: float, width: float, floor: float, room: float
) -> list[Part]:
    """Blocks that stand on one board, from the left on, each as deep and high as its books."""
    parts = []
    end = left + spec.fill * width
    for _ in range(MAX_BOOKS):
        block = float(rng.uniform(0.05, 0.35))
        height = float(rng.uniform(0.45, 0.9)) * room
        depth = float(rng.uniform(0.5, 0.92)) * (spec.depth - 0.02)
        if left + block > end:
            break
        x = 0.012 - spec.depth / 2 + depth / 2
        parts.append(box(depth, block - 0.004, height, 0.002).at(x, left + block / 2, floor + height / 2))
        left += block + (float(rng.uniform(0.0, 0.15)) if rng.random() < 0.3 else 0.0)
    return parts


@dataclass(frozen=True)
class CabinetSpec(Spec):
    """A cupboard, sideboard or filing cabinet; its fronts look along x.

    Attributes:
        width: Along y [m].
        depth: Along x [m].
        height: [m].
        n_rows: Fronts above each other.
        n_columns: Fronts beside each other.
        foot: Height of plinth or feet [m].
    """

    width: float = number(0.3, 3.0)
    depth: float = number(0.2, 0.8)
    height: float = number(0.3, 2.5)
    n_rows: int = count(1, 6)
    n_columns: int = count(1, 6)
    foot: float = number(0.02, 0.25)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.require(self.height - self.foot >= 0.2, f"foot={self.foot} leaves less than 0.2 m of the height")


def sample_cabinet(rng: np.random.Generator) -> CabinetSpec:
    """Draws a sideboard (0.5-0.9 m high), a filing cabinet (1-1.3 m) or a cupboard (1.8-2.2 m)."""
    kind = int(rng.integers(3))
    height = uniform(rng, *((0.5, 0.9), (1.0, 1.3), (1.8, 2.2))[kind])
    width = uniform(rng, *((1.0, 2.0), (0.4, 0.9), (0.8, 1.8))[kind])
    return CabinetSpec(
        width=width,
        depth=uniform(rng, 0.35, 0.6),
        height=height,
        n_rows=(1, int(rng.integers(3, 5)), 1)[kind],
        n_columns=max(1, round(width / 0.5)),
        foot=uniform(rng, 0.04, 0.14),
    )


def make_cabinet(spec: CabinetSpec) -> Occluder:
    """Builds the cabinet; no anchors."""
    body = spec.height - spec.foot
    parts = [
        box(spec.depth - 0.02, spec.width, body, 0.003).at(-0.01, 0, spec.foot + body / 2),
        box(spec.depth - 0.1, spec.width - 0.06, spec.foot, 0.003).at(-0.02, 0, spec.foot / 2),
    ]
    wide, high = spec.width / spec.n_columns, body / spec.n_rows
    for row in range(spec.n_rows):
        for column in range(spec.n_columns):
            front = box(0.02, wide - 0.006, high - 0.006, 0.003)
            y = -spec.width / 2 + (column + 0.5) * wide
            parts.append(front.at(spec.depth / 2 - 0.01, y, spec.foot + (row + 0.5) * high))
    return occluder("background", parts)
