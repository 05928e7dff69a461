"""Resamples of frames, and statistics that are counted again on each of them."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

FrameWeights = NDArray[np.int16]
"""(n_resamples, n_frames): how often each frame counts in each resample."""

N_RESAMPLES = 2000
LEVEL = 0.95
"""Share of the resamples inside a confidence interval."""


class Statistic(Protocol):
    """A number that is counted from frames."""

    def __call__(self, weights: FrameWeights) -> NDArray[np.float64]:
        """(n_resamples,) its value on each resample; NaN where the resample holds nothing to count."""
        ...


@dataclass(frozen=True)
class Mean:
    """The mean of statistics, each of the same frames.

    Attributes:
        statistics: One or more.
    """

    statistics: tuple[Statistic, ...]

    def __call__(self, weights: FrameWeights) -> NDArray[np.float64]:
        """(n_resamples,) means; NaN where one of the statistics is."""
        return np.mean([statistic(weights) for statistic in self.statistics], axis=0)


@dataclass(frozen=True)
class Ratio:
    """A sum over frames divided by another: a share or a mean.

    Attributes:
        numerator: (n_frames,) float64.
        denominator: (n_frames,) float64.
    """

    numerator: NDArray[np.float64]
    denominator: NDArray[np.float64]

    def __call__(self, weights: FrameWeights) -> NDArray[np.float64]:
        """(n_resamples,) ratios; NaN where the denominator is 0."""
        ratio = np.full(len(weights), np.nan)
        _fill_ratios(self.numerator, self.denominator, weights, ratio)
        return ratio


@dataclass(frozen=True)
class Median:
    """The median of values that frames hold several of.

    Attributes:
        values: (n,) float64, rising; may be infinite.
        frame: (n,) int32, the frame of each.
    """

    values: NDArray[np.float64]
    frame: NDArray[np.int32]

    @classmethod
    def of(cls, values: NDArray[np.float64], frame: NDArray[np.integer]) -> "Median":
        """Sorts the values."""
        order = np.argsort(values, kind="stable")
        return cls(values[order], frame[order].astype(np.int32))

    def __call__(self, weights: FrameWeights) -> NDArray[np.float64]:
        """(n_resamples,) medians; NaN where there is no value."""
        median = np.full(len(weights), np.nan)
        _fill_medians(self.values, self.frame, weights, median)
        return median


@njit(cache=True, nogil=True)
def _fill_ratios(
    numerator: NDArray[np.float64], denominator: NDArray[np.float64], weights: FrameWeights, ratio: NDArray
) -> None:
    for resample in range(len(weights)):
        above, below = 0.0, 0.0
        for i in range(len(numerator)):
            above += weights[resample, i] * numerator[i]
            below += weights[resample, i] * denominator[i]
        if below > 0.0:
            ratio[resample] = above / below


@njit(cache=True, nogil=True)
def _fill_medians(
    values: NDArray[np.float64], frame: NDArray[np.int32], weights: FrameWeights, median: NDArray
) -> None:
    for resample in range(len(weights)):
        weight = weights[resample]
        n = 0
        for i in range(len(frame)):
            n += weight[frame[i]]
        if n == 0:
            continue
        n_below, i = 0, -1
        while n_below <= (n - 1) // 2:
            i += 1
            n_below += weight[frame[i]]
        lower = values[i]
        while n_below <= n // 2:
            i += 1
            n_below += weight[frame[i]]
        median[resample] = (lower + values[i]) / 2.0


def every_frame_once(n_frames: int) -> FrameWeights:
    """(1, n_frames) int16: the frames themselves."""
    return np.ones((1, n_frames), np.int16)


def draw_frames(n_frames: int, n_resamples: int, rng: np.random.Generator) -> FrameWeights:
    """Draws `n_frames` of the frames with replacement, for each resample of the bootstrap.

    Args:
        n_frames: Frames there are.
        n_resamples: Resamples.
        rng: Draws.

    Returns:
        (n_resamples, n_frames) int16, counts.
    """
    counts = np.empty((n_resamples, n_frames), np.int16)
    for row in counts:
        row[:] = np.bincount(rng.integers(0, n_frames, n_frames), minlength=n_frames)
    return counts


def draw_together(group: NDArray[np.int64], n_resamples: int, rng: np.random.Generator) -> FrameWeights:
    """The same for frames that are drawn in groups, as the people of one scene, who are alike.

    Args:
        group: (n_frames,) number of each frame's group.
        n_resamples: Resamples.
        rng: Draws.

    Returns:
        (n_resamples, n_frames) int16, counts; those of `draw_frames` where each frame is a group, in rising order.
    """
    numbers, of_frame = np.unique(group, return_inverse=True)
    return np.ascontiguousarray(draw_frames(len(numbers), n_resamples, rng)[:, of_frame])


def interval(estimate: float, values: NDArray[np.float64], level: float = LEVEL) -> tuple[float, float]:
    """The bias-corrected percentile interval of a bootstrap (Efron and Tibshirani 1993, chapter 14).

    Where as many resamples lie above the estimate as below, it is the plain percentile interval. Average precision
    rises when frames are drawn twice; the correction takes that back. The ends are values that occurred, so that
    they may be infinite.

    Args:
        estimate: The statistic on the frames themselves.
        values: (n_resamples,) of the statistic; NaN is left out.
        level: Share of the values inside.

    Returns:
        Lower and upper end; NaN if there is no value.
    """
    from scipy.special import ndtr, ndtri

    known = np.sort(values[~np.isnan(values)])
    n = len(known)
    if not n or np.isnan(estimate):
        return np.nan, np.nan
    below = (np.searchsorted(known, estimate, "left") + np.searchsorted(known, estimate, "right")) / 2.0
    shift = 2.0 * ndtri(np.clip(below / n, 1.0 / n, 1.0 - 1.0 / n)) if n > 2 else 0.0
    reach = ndtri((1.0 + level) / 2.0)
    low, high = known[int(ndtr(shift - reach) * (n - 1))], known[-1 - int(ndtr(-shift - reach) * (n - 1))]
    return float(min(low, estimate)), float(max(high, estimate))
