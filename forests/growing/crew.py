"""What training asks of workers in other processes: to gather pixels, and to run functions on arrays that all can read.

The functions are those that this process would run, so that what is learned is the same to the byte.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, NamedTuple, Protocol

from forests.samples import Layer, TrainingSet

Call = Callable[..., Any]
"""call(function, *arguments) runs function(*records, *arguments) on a worker and waits for what it gives."""


class Crew(Protocol):
    """Workers in other processes, perhaps on other machines."""

    @property
    def n_calls(self) -> int:
        """Calls that keep all of them busy."""
        ...

    def gather(
        self,
        layer: Layer,
        n_body_pixels: int,
        n_occluder_pixels: int,
        seed: int,
        on_frames: Callable[[int], object],
    ) -> TrainingSet:
        """What `forests.samples.gather` gives for the training frames.

        Args:
            layer: As of `gather`; so are the numbers of pixels and the seed.
            n_body_pixels: Pixels drawn from the person in a frame.
            n_occluder_pixels: Pixels drawn from the objects in a frame.
            seed: Of the drawing.
            on_frames: Told the number of further frames that were read.
        """
        ...

    def sharing(self, *records: NamedTuple) -> AbstractContextManager[Call]:
        """Lets all workers read the arrays of some records as long as the block lasts.

        Args:
            records: NamedTuples of arrays, which are the first arguments of all functions that are called.
        """
        ...
