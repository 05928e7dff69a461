"""From patches to a net's input: crops, and in training what may go wrong with a person's patch."""

from typing import NamedTuple, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nets.patches import MISSING
from nets.views import View

PERSON, OBJECT = 1, 2
"""Kinds of pixels."""
BLEED_PX = 3
"""Outlines are wrong by at most so many pixels of the patch."""
WALL_SHARE = 0.2
"""Share of the people who stand before something that fills the image, such as a wall."""


def to_channels(relative: Tensor, view: View) -> Tensor:
    """(n, 2, height, width) float32 of relative depths (n, height, width) int16 [mm].

    The first channel is the depth within the reach, -1..1 and 0 where nothing is, the second 1 where something is.
    """
    is_there = relative != int(MISSING)
    value = (relative.to(torch.float32) * (1e-3 / view.reach_m)).clamp(-1.0, 1.0)
    return torch.stack([value * is_there, is_there.to(torch.float32)], dim=1)


def crop_places(view: View, n_crops: int) -> tuple[tuple[int, int], ...]:
    """(row, column) of the upper left corners of the crops of a patch: the middle, and with five the corners."""
    m = view.margin
    if n_crops not in (1, 5):
        raise ValueError(f"n_crops={n_crops} must be 1 or 5")
    return ((m, m),) if n_crops == 1 else ((m, m), (0, 0), (0, 2 * m), (2 * m, 0), (2 * m, 2 * m))


def crop_inputs(relative: NDArray[np.int16], view: View, n_crops: int) -> Tensor:
    """(n * n_crops, 2, height, width): the crops of each of the patches (n, ...) after one another."""
    patches = torch.from_numpy(np.ascontiguousarray(relative))
    h, w = view.height, view.width
    crops = [patches[:, row : row + h, column : column + w] for row, column in crop_places(view, n_crops)]
    return to_channels(torch.stack(crops, dim=1).reshape(-1, h, w), view)


class Augmentation(Protocol):
    """Settings of what may go wrong with a patch in training; see `nets.orientation.config.OrientationConfig`."""

    @property
    def view(self) -> View:
        """What the net looks at."""
        ...

    @property
    def mirrors(self) -> bool:
        """Whether half of the people are shown in the mirror."""
        ...

    @property
    def cut_share(self) -> float:
        """Share of the people who are shown without the objects around them."""
        ...

    @property
    def bleed_share(self) -> float:
        """Share of those whose outline is wrong."""
        ...

    @property
    def hole_share(self) -> float:
        """Largest share of pixels that are lost."""
        ...

    @property
    def depth_jitter_m(self) -> float:
        """Standard deviation of the distance [m]."""
        ...

    @property
    def scale_jitter(self) -> float:
        """Patches are shown up to this share larger or smaller."""
        ...


class Draws(NamedTuple):
    """What is drawn for a batch of n people, each (n,).

    Attributes:
        is_mirrored: Whether the person is shown in the mirror.
        is_cut: Whether the person is shown alone.
        is_bled: Whether the outline is wrong, if so.
        grows: Whether it then takes in what lies beside the person, or loses some of the person.
        bleed: (n, 2) by how many rows and columns.
        has_wall: Whether something far away fills the image.
        shift: (n, 2) rows and columns from the middle of the margin.
        scale: Of the patch.
        depth_m: Error of the distance [m].
        hole_share: Share of pixels that are lost.
    """

    is_mirrored: NDArray[np.bool_]
    is_cut: NDArray[np.bool_]
    is_bled: NDArray[np.bool_]
    grows: NDArray[np.bool_]
    bleed: NDArray[np.int64]
    has_wall: NDArray[np.bool_]
    shift: NDArray[np.float64]
    scale: NDArray[np.float64]
    depth_m: NDArray[np.float64]
    hole_share: NDArray[np.float64]


def draw(rng: np.random.Generator, n: int, config: Augmentation) -> Draws:
    """Draws what happens to n people."""
    margin = config.view.margin
    return Draws(
        is_mirrored=(rng.random(n) < 0.5) & config.mirrors,
        is_cut=rng.random(n) < config.cut_share,
        is_bled=rng.random(n) < config.bleed_share,
        grows=rng.random(n) < 0.5,
        bleed=rng.integers(-BLEED_PX, BLEED_PX + 1, (n, 2)),
        has_wall=rng.random(n) < (WALL_SHARE if config.cut_share else 0.0),
        shift=rng.uniform(-margin, margin, (n, 2)),
        scale=np.exp(rng.uniform(-1.0, 1.0, n) * np.log1p(config.scale_jitter)),
        depth_m=rng.normal(0.0, 1.0, n) * config.depth_jitter_m,
        hole_share=rng.uniform(0.0, 1.0, n) ** 2 * config.hole_share,
    )


def training_inputs(
    relative: Tensor, kind: Tensor, draws: Draws, view: View, generator: torch.Generator
) -> Tensor:
    """(n, 2, height, width): a crop of each patch, as drawn.

    Args:
        relative: (n, ...) int16 patches [mm].
        kind: (n, ...) uint8, kinds of their pixels.
        draws: What happens to each.
        view: What the net looks at.
        generator: Draws the pixels that are lost.
    """
    is_there = relative != int(MISSING)
    is_person = kind == PERSON
    kept = torch.where(_column(draws.is_bled), _bled(is_person, draws), is_person)
    is_there &= kept | ~_column(draws.is_cut)
    # What is shown larger is so in depth too.
    millimetre = _column((1e-3 / draws.scale).astype(np.float32))
    moved = relative.to(torch.float32) * millimetre + _column(draws.depth_m.astype(np.float32))
    value = (moved / view.reach_m).clamp(-1.0, 1.0)
    value = torch.where(is_there, value, 1.0)
    is_there |= _column(draws.has_wall & ~draws.is_cut)
    rows, columns = shown_pixels(draws, view)
    at = torch.arange(len(relative))[:, None, None]
    value, is_there = value[at, rows, columns], is_there[at, rows, columns]
    lost = torch.rand(value.shape, generator=generator) < _column(draws.hole_share.astype(np.float32))
    is_there &= ~lost
    return torch.stack([value * is_there, is_there.to(torch.float32)], dim=1)


def _column(values: np.ndarray) -> Tensor:
    """(n, 1, 1)."""
    return torch.from_numpy(np.ascontiguousarray(values))[:, None, None]


def _bled(is_person: Tensor, draws: Draws) -> Tensor:
    """Outlines united, or cut, with themselves moved by a few pixels."""
    n, height, width = is_person.shape
    bleed = torch.from_numpy(draws.bleed)
    rows = (torch.arange(height)[None] + bleed[:, :1]).clamp(0, height - 1)
    columns = (torch.arange(width)[None] + bleed[:, 1:]).clamp(0, width - 1)
    moved = is_person[torch.arange(n)[:, None, None], rows[:, :, None], columns[:, None, :]]
    return torch.where(_column(draws.grows), is_person | moved, is_person & moved)


def shown_pixels(draws: Draws, view: View) -> tuple[Tensor, Tensor]:
    """(n, height, 1) rows and (n, 1, width) columns of the patch that a crop shows."""

    def along(n_pixels: int, n_patch: int, shift: np.ndarray, is_turned: np.ndarray | None) -> np.ndarray:
        at = np.arange(n_pixels) - (n_pixels - 1) / 2.0
        at = at[None] * draws.scale[:, None]
        if is_turned is not None:
            at = np.where(is_turned[:, None], -at, at)
        middle = (n_patch - 1) / 2.0 + shift[:, None]
        return np.clip(np.rint(middle + at), 0, n_patch - 1).astype(np.int64)

    height, width = view.patch
    rows = along(view.height, height, draws.shift[:, 0], None)
    columns = along(view.width, width, draws.shift[:, 1], draws.is_mirrored)
    return torch.from_numpy(rows)[:, :, None], torch.from_numpy(columns)[:, None, :]
