"""Deals numbered tasks to workers so that neighbours stay together."""

from collections import deque
from collections.abc import Hashable, Sequence

import numpy as np

IN_FLIGHT = 2
"""Tasks that a worker has at a time: one at work, one waiting."""


class Dealer:
    """Gives every worker a run of neighbouring numbers; one that is through takes from the end of the longest run.

    Neighbouring shards share subjects and objects, which a worker keeps. What is made does not depend on who makes it.

    Args:
        numbers: The tasks, in order.
        workers: Who is there at the start; others may join later.
    """

    def __init__(self, numbers: Sequence[int], workers: Sequence[Hashable]) -> None:
        runs = np.array_split(np.asarray(numbers, np.int64), max(len(workers), 1))
        names = workers or [None]
        self._runs = {name: deque(run.tolist()) for name, run in zip(names, runs, strict=True)}

    def next_for(self, worker: Hashable) -> int | None:
        """The next number of a worker's own run, else the last of the longest run, whoever's it is."""
        if run := self._runs.get(worker):
            return run.popleft()
        longest = max(self._runs.values(), key=len)
        return longest.pop() if longest else None
