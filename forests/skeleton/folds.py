"""Answers on training frames that are as new to a forest as test frames: of forests that learned from the others."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from forests.frames import FrameSequence, FrameSubset
from forests.skeleton.answers import Answers, Truth, View, joined
from forests.skeleton.heading import facings_of
from forests.tree import TreeStore

TreeT = TypeVar("TreeT")
Answering: TypeAlias = Callable[[FrameSequence, View], tuple[Answers, Truth]]
"""What a forest answers on frames that it is shown in some way."""

N_FOLDS = 2
KEPT_QUARTERS = ((2, 3), (0, 1), (0, 3), (1, 2))
"""Quarters of the frames that are learned from, by fold."""
FOLD_SEED = 1000
"""Added, with the fold's number, to the seed of a forest that learns from a part of the frames."""
HEADING_ERROR, FLIPPED_SHARE = 0.15, 0.02
"""Standard deviation of the headings [rad] that forests are told on training frames, and the share turned round."""
_HEADING_STREAM = 0x4EAD
MOST_FRAMES = 10_000
"""Of more training frames, evenly spread ones are answered."""
LEAST_FRAMES = 200
"""From fewer training frames no network is learned."""


def answers_across(
    frames: FrameSequence,
    train_apart: Callable[[FrameSubset, int], Answering | None],
    reads_headings: bool,
    n_ways: int,
) -> tuple[Answers, Truth] | None:
    """Answers on all training frames, each by a forest that has not learned from it.

    Frames that follow one another may share people and objects, so that each fold is one run of frames, or two.

    Args:
        frames: The training frames.
        train_apart: Trains on frames, of a fold of that number; None where they do not tell what the answers need.
        reads_headings: Whether the forest's votes are weighed by headings.
        n_ways: In how many ways the frames are halved, 1 or 2: each gives answers on all frames.

    Returns:
        Answers and truths, of each fold those on whole frames and then those on cut ones, and the same again with
        headings about as wrong as estimated ones (of MOST_FRAMES frames or a few less, if there are more); None of
        too few frames, or where the frames of a fold do not tell enough.
    """
    n = len(frames)
    if n < LEAST_FRAMES:
        return None
    parts: list[tuple[Answers, Truth]] = []
    quarters = [range(k * n // 4, (k + 1) * n // 4) for k in range(4)]
    for fold, kept in enumerate(KEPT_QUARTERS[: N_FOLDS * n_ways]):
        others = FrameSubset(frames, tuple(itertools.chain(*(quarters[k] for k in kept))))
        answers = train_apart(others, fold)
        if answers is None:
            return None
        left = itertools.chain(*(quarters[k] for k in range(4) if k not in kept))
        own = FrameSubset(frames, tuple(itertools.islice(left, None, None, -(-n // MOST_FRAMES))))
        parts += [answers(own, View()), answers(own, View(is_cut=True))]
        if reads_headings:
            headings = _rough_headings(parts[-2][1].joints, frames.labels.joints, fold)
            parts += [answers(own, View(is_cut, headings=headings)) for is_cut in (False, True)]
    return joined(parts)


def _rough_headings(joints: NDArray[np.float32], names: tuple[str, ...], fold: int) -> NDArray[np.float32]:
    """(n,) float32: headings of joints (n, n_joints, 3) as they are estimated [rad]; NaN = not known."""
    facings, rng = facings_of(joints, names), np.random.default_rng([_HEADING_STREAM, fold])
    angle = np.arctan2(facings[:, 1], facings[:, 0]) + rng.normal(0.0, HEADING_ERROR, len(joints))
    angle += np.pi * (rng.random(len(joints)) < FLIPPED_SHARE)
    return np.where(facings.any(axis=1), angle, np.nan).astype(np.float32)


@dataclass(frozen=True)
class ShiftedStore(Generic[TreeT]):
    """A store whose trees are numbered on from those of the forest itself.

    Attributes:
        store: Where the trees are kept.
        first: Number of the first of them.
    """

    store: TreeStore[TreeT]
    first: int

    def load(self, tree: int) -> TreeT | None:
        """A tree that was finished before, or None."""
        return self.store.load(self.first + tree)

    def save(self, tree: int, grown: TreeT) -> None:
        """Keeps a finished tree."""
        self.store.save(self.first + tree, grown)
