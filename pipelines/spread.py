"""Evenly spread places: which of many things are taken when not all are."""

import numpy as np
from numpy.typing import NDArray


def evenly_spread(n_things: int, n_taken: int) -> NDArray[np.int64]:
    """(n_taken,) places of things, rising: one of each of equal stretches, the first of it.

    More may be taken than there are; each is then taken as often as the others, within one.

    Args:
        n_things: How many there are, at least 1 unless none is taken.
        n_taken: How many are taken.
    """
    if n_taken and n_things < 1:
        raise ValueError(f"n_taken={n_taken} of {n_things} things must be 0")
    return np.arange(n_taken) * n_things // max(n_taken, 1)


def at_most(n_things: int, limit: int) -> NDArray[np.int64]:
    """(n,) places of at most so many things, as `evenly_spread` has them; all if the limit is 0."""
    return evenly_spread(n_things, min(n_things, limit) if limit > 0 else n_things)


def first_to_last(n_things: int, limit: int) -> NDArray[np.int64]:
    """(n,) places of at most so many things, rising: the first, the last, and others evenly between them."""
    if n_things <= limit:
        return np.arange(n_things)
    return np.rint(np.linspace(0, n_things - 1, limit)).astype(np.int64)
