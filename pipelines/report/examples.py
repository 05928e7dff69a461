"""Which test frames are shown: by their place in the order of gains, not by hand."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.metrics import errors
from pipelines.metrics.results import Results
from pipelines.report.methods import EXAMPLE_PAIRS
from pipelines.report.source import Source
from synth.vocabulary import JointState

ERROR_CAP_M = 0.50
"""A joint's error counts at most this much, and this much if there is no answer."""


class Place(NamedTuple):
    """A place in the order of frames.

    Attributes:
        quantile: 0 = the least gain, 1 = the largest.
        words: What the page calls it.
    """

    quantile: float
    words: str


PLACES = (
    Place(1.0, "Largest gain"),
    Place(0.9, "Gain that one frame in ten exceeds"),
    Place(0.5, "Median gain"),
    Place(0.1, "Gain that one frame in ten falls short of"),
    Place(0.0, "Least gain"),
)


@dataclass(frozen=True)
class Example:
    """A frame to show.

    Attributes:
        words: Why this one.
        row: Its place in the rows.
        gain_m: By how much the first method's mean error is below the second's [m].
    """

    words: str
    row: int
    gain_m: float


@dataclass(frozen=True)
class Choice:
    """The frames to show.

    Attributes:
        pair: Methods whose errors are compared: the gain is that of the first over the second.
        n_frames: How many were ordered.
        is_hiding: Whether these are the frames in which an object hides a joint; else there are none, and all are
            taken.
        examples: By falling gain.
    """

    pair: tuple[str, str]
    n_frames: int
    is_hiding: bool
    examples: tuple[Example, ...]


def choose_examples(source: Source) -> Choice | None:
    """Frames at the quantiles of the gain, of the first training; None without two methods to compare."""
    for pair in EXAMPLE_PAIRS:
        both = source.pairs(*pair)
        if both:
            first, second = both[0]
            gain = frame_errors(second) - frame_errors(first)
            hides = (first.truths.state == JointState.OCCLUDED).any(axis=1)
            rows = np.flatnonzero(hides if hides.any() else np.ones_like(hides))
            rows = rows[~np.isnan(gain[rows])]
            if len(rows):
                examples = at_quantiles(rows, gain[rows], PLACES)
                return Choice(pair, len(rows), bool(hides.any()), examples)
    return None


def at_quantiles(
    rows: NDArray[np.integer], gain: NDArray[np.float64], places: Sequence[Place]
) -> tuple[Example, ...]:
    """The frames at some places of the order of gains; a frame is taken once.

    Args:
        rows: (n,) the frames, n > 0.
        gain: (n,) of each [m]; among equals the earlier frame comes first.
        places: Where.
    """
    order = np.argsort(gain, kind="stable")
    taken: dict[int, Example] = {}
    for place in places:
        k = int(order[int(place.quantile * (len(order) - 1) + 0.5)])
        taken.setdefault(k, Example(place.words, int(rows[k]), float(gain[k])))
    return tuple(taken.values())


def frame_errors(results: Results) -> NDArray[np.float64]:
    """(n,) float64, mean over a frame's joints of their error up to `ERROR_CAP_M` [m]; NaN without a truth."""
    error = errors(results)
    has_truth = ~np.isnan(error)
    total = np.where(has_truth, np.minimum(np.where(has_truth, error, 0.0), ERROR_CAP_M), 0.0).sum(axis=1)
    n = has_truth.sum(axis=1)
    return np.where(n > 0, total / np.maximum(n, 1), np.nan)
