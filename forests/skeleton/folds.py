"""Answers on training frames that are as new to a forest as test frames: of forests that learned from the others."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from forests.frames import FrameSequence, FrameSubset
from forests.skeleton.answers import Answers, Truth, joined
from forests.tree import TreeStore

TreeT = TypeVar("TreeT")

N_FOLDS = 2
LEAST_FRAMES = 200
"""From fewer training frames no network is learned."""


def answers_across(
    frames: FrameSequence,
    answers_apart: Callable[[FrameSequence, FrameSequence, int], tuple[Answers, Truth] | None],
) -> tuple[Answers, Truth] | None:
    """Answers on all training frames, each by a forest that has not learned from it.

    Frames that follow one another may share people and objects, so that each fold is one run of frames.

    Args:
        frames: The training frames.
        answers_apart: Trains on frames, and answers others; its last argument numbers the fold. None where the
            frames do not tell what the answers need.

    Returns:
        Answers and truths in the frames' order; None of too few frames, or where a fold has none.
    """
    n = len(frames)
    if n < LEAST_FRAMES:
        return None
    parts = []
    for fold in range(N_FOLDS):
        first, last = fold * n // N_FOLDS, (fold + 1) * n // N_FOLDS
        others = FrameSubset(frames, (*range(first), *range(last, n)))
        part = answers_apart(others, FrameSubset(frames, tuple(range(first, last))), fold)
        if part is None:
            return None
        parts.append(part)
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
