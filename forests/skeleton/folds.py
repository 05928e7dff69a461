"""Answers on training frames that are as new to a forest as test frames: of forests that learned from the others."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeAlias, TypeVar

from forests.frames import FrameSequence, FrameSubset
from forests.skeleton.answers import Answers, Truth, joined
from forests.tree import TreeStore

TreeT = TypeVar("TreeT")
Answering: TypeAlias = Callable[[FrameSequence, bool], tuple[Answers, Truth]]
"""What a forest answers on frames, which it sees whole or, if the second argument is true, cut."""

N_FOLDS = 2
FOLD_SEED = 1000
"""Added, with the fold's number, to the seed of a forest that learns from a part of the frames."""
LEAST_FRAMES = 200
"""From fewer training frames no network is learned."""


def answers_across(
    frames: FrameSequence,
    train_apart: Callable[[FrameSequence, int], Answering | None],
) -> tuple[Answers, Truth] | None:
    """Answers on all training frames, each by a forest that has not learned from it.

    Frames that follow one another may share people and objects, so that each fold is one run of frames.

    Args:
        frames: The training frames.
        train_apart: Trains on frames, of a fold of that number; None where they do not tell what the answers need.

    Returns:
        Answers and truths, of each fold those on whole frames and then those on cut ones; None of too few frames,
        or where the frames of a fold do not tell enough.
    """
    n = len(frames)
    if n < LEAST_FRAMES:
        return None
    parts: list[tuple[Answers, Truth]] = []
    for fold in range(N_FOLDS):
        first, last = fold * n // N_FOLDS, (fold + 1) * n // N_FOLDS
        others = FrameSubset(frames, (*range(first), *range(last, n)))
        answers = train_apart(others, fold)
        if answers is None:
            return None
        own = FrameSubset(frames, tuple(range(first, last)))
        parts += [answers(own, False), answers(own, True)]
    return joined(parts)


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
