"""Tells how far long work is: with a bar on a terminal, with a plain line now and then elsewhere."""

import sys
import time
from collections.abc import Collection, Iterator
from typing import Any, Self, TextIO, TypeVar

DELAY_S = 2.0
"""Work shorter than this shows no bar."""
LINE_S = 30.0
"""Time between two lines where standard error is no terminal."""
LEAST_SHARE = 0.02
"""Before so much is done, the time left is not told: what was slow so far is the start."""

Item = TypeVar("Item")


def progress(items: Collection[Item], unit: str, name: str) -> Iterator[Item]:
    """Goes through a collection and tells how far it is.

    Args:
        items: What to go through.
        unit: What one item is, in the singular.
        name: What is being done.

    Yields:
        The items.
    """
    with Progress(len(items), unit, name) as bar:
        for item in items:
            yield item
            bar.update()


class Progress:
    """How far one piece of work is; a context manager that takes the bar away at its end.

    Args:
        total: How much is to be done: a number of units, or 1 for the whole of something that has no units.
        unit: What is counted, in the singular; "" tells a percentage only.
        name: What is being done.
    """

    def __init__(self, total: float = 1.0, unit: str = "", name: str = "") -> None:
        self.done = 0.0
        self._total = total
        self._unit = unit
        self._name = name
        self._n_earlier = 0.0
        self._begun = self._told = time.monotonic()
        self._stream = sys.stderr
        self._bar = _bar(self._stream, total, unit, name) if self._stream and self._stream.isatty() else None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def rename(self, name: str) -> None:
        """Says what is being done from here on."""
        self._name = name
        if self._bar is not None:
            self._bar.set_description(name)

    def update(self, n: float = 1.0) -> None:
        """Adds to what is done."""
        self.set_done(self.done + n, self._n_earlier)

    def set_done(self, done: float, n_earlier: float = 0.0) -> None:
        """Sets what is done.

        Args:
            done: How much of the total; never goes back.
            n_earlier: How much of it an earlier run has done, which the time left is not estimated from.
        """
        step = max(0.0, done - self.done)
        self.done += step
        self._n_earlier = n_earlier
        if self._bar is not None:
            self._bar.initial = n_earlier
            self._bar.update(int(step) if self._unit else step)
        elif self._stream and time.monotonic() - self._told >= LINE_S and self.done < self._total:
            self._told = time.monotonic()
            self._stream.write(self._line(self._told - self._begun) + "\n")
            self._stream.flush()

    def _line(self, elapsed: float) -> str:
        """Such as "generate: 320 of 1000 frames, 45 s, 96 s left"."""
        share = f"{100.0 * self.done / self._total:.0f} %"
        counted = f"{self.done:.0f} of {self._total:.0f} {self._unit}s" if self._unit else share
        words = [f"{self._name}: {counted}" if self._name else counted, _duration(elapsed)]
        if self.done - self._n_earlier >= LEAST_SHARE * self._total:
            left = elapsed * (self._total - self.done) / (self.done - self._n_earlier)
            words.append(f"{_duration(left)} left")
        return ", ".join(words)


def _bar(stream: TextIO, total: float, unit: str, name: str) -> Any:
    """A bar that appears once the work has taken a while."""
    from tqdm import tqdm

    layout = None if unit else "{desc}{percentage:3.0f}%|{bar}| {elapsed}, {remaining} left"
    return tqdm(
        file=stream,
        total=total,
        desc=f"{name}: " if name else None,
        unit=unit or "it",
        bar_format=layout,
        delay=DELAY_S,
        smoothing=0.0,
        dynamic_ncols=True,
    )


def _duration(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    if seconds < 7200.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h"
