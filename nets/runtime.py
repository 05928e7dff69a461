"""torch as this package uses it: found or missed with one sentence, repeatable, on as many threads as are told."""

import contextlib
from collections.abc import Iterator
from typing import Any

import numpy as np


class MissingLibraryError(RuntimeError):
    """A library of the extra `nets` is not installed."""


def load_torch() -> Any:
    """The module torch.

    Raises:
        MissingLibraryError: It is not installed; says how to get it.
    """
    try:
        import torch
    except ImportError:
        raise MissingLibraryError(
            "nets need torch, which is not installed; install it with: pip install 'undergrowth[nets]'"
        ) from None
    return torch


@contextlib.contextmanager
def repeatable(n_threads: int = 1) -> Iterator[None]:
    """Makes torch repeat itself to the bit inside, with that number of threads; leaves no trace outside.

    On the CPU, the same seed and the same number of threads give the same weights. Another number of threads adds
    in another order and gives others.
    """
    torch = load_torch()
    before = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    torch.set_num_threads(n_threads)
    torch.use_deterministic_algorithms(True)
    try:
        with torch.random.fork_rng():
            yield
    finally:
        torch.set_num_threads(before[0])
        torch.use_deterministic_algorithms(before[1])


def seed_of(*numbers: int) -> int:
    """A seed for torch out of several numbers, such as a seed, a purpose and an epoch."""
    return int(np.random.SeedSequence(numbers).generate_state(1, np.uint64)[0] >> np.uint64(1))
