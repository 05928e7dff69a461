"""Paired tests between two methods that answered on the same frames."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.metrics.measures import statistics_of
from pipelines.metrics.resampling import (
    N_RESAMPLES,
    FrameWeights,
    Mean,
    Statistic,
    draw_frames,
    every_frame_once,
    interval,
)
from pipelines.metrics.results import Results, Truths, same_frames


@dataclass(frozen=True)
class Difference:
    """How much higher a measure is for the first method than for the second; NaN where there is nothing to count.

    Attributes:
        first: The measure of the first method.
        second: The measure of the second.
        estimate: Their difference.
        low: Lower end of its 95 % interval, from the bootstrap over frames.
        high: Upper end.
        p_value: Of the sign-flip test: how often a difference as large comes up when each frame's answers are
            given to either method by the toss of a coin.
    """

    first: float
    second: float
    estimate: float
    low: float
    high: float
    p_value: float


def compare(
    first: Results,
    second: Results,
    is_counted: NDArray[np.bool_],
    rng: np.random.Generator,
    n_resamples: int = N_RESAMPLES,
) -> Mapping[str, Difference]:
    """Compares two methods, measure by measure.

    Args:
        first: A method's answers.
        second: Another's on the same frames and joints.
        is_counted: (n, n_joints) bool, the group.
        rng: Draws frames and tosses coins.
        n_resamples: Of the bootstrap and of the test, each.

    Raises:
        ValueError: The methods answered on different frames.
    """
    return compare_seeds([(first, second)], is_counted, rng, n_resamples)


def compare_seeds(
    pairs: Sequence[tuple[Results, Results]],
    is_counted: NDArray[np.bool_],
    rng: np.random.Generator,
    n_resamples: int = N_RESAMPLES,
) -> Mapping[str, Difference]:
    """Compares the means of two methods over several trainings; arguments and errors as for `compare`.

    A resample draws frames, and a coin gives a frame's answers to either method, for all trainings alike.

    Args:
        pairs: Answers of the two methods by training, all on the same frames.
        is_counted: (n, n_joints) bool, the group.
        rng: Draws frames and tosses coins.
        n_resamples: Of the bootstrap and of the test, each.
    """
    truths = pairs[0][0].truths
    for results in (item for pair in pairs for item in pair):
        if not same_frames(truths, results.truths):
            names = " and ".join(sorted({item.method for pair in pairs for item in pair}))
            raise ValueError(f"{names} must be scored on the same frames and joints")
    twice = np.concatenate([is_counted, is_counted])
    trainings = [statistics_of(_side_by_side(first, second), twice) for first, second in pairs]
    drawn = draw_frames(len(truths), n_resamples, rng)
    coins = rng.integers(0, 2, (n_resamples, len(truths)), dtype=np.int16)
    means = {name: Mean(tuple(training[name] for training in trainings)) for name in trainings[0]}
    return {name: _difference(statistic, drawn, coins) for name, statistic in means.items()}


def _difference(statistic: Statistic, drawn: FrameWeights, coins: FrameWeights) -> Difference:
    once = every_frame_once(drawn.shape[1])
    nobody, swapped = np.zeros_like(drawn), 1 - coins
    first, second = _both(statistic, once, nobody[:1])
    estimate, resampled = float(_less(first, second)[0]), _less(*_both(statistic, drawn, nobody))
    flipped = _less(*_both(statistic, coins, swapped))
    is_as_large = np.abs(flipped[~np.isnan(flipped)]) >= abs(estimate) - 1e-12
    p_value = np.nan if np.isnan(estimate) else (1.0 + is_as_large.sum()) / (1.0 + len(is_as_large))
    ends = interval(estimate, resampled)
    return Difference(float(first[0]), float(second[0]), estimate, *ends, float(p_value))


def _both(statistic: Statistic, own: FrameWeights, others: FrameWeights) -> tuple[np.ndarray, np.ndarray]:
    """The statistic of each method, that counts its own frames and, after a swap, the other's."""
    return statistic(np.hstack([own, others])), statistic(np.hstack([others, own]))


def _less(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Differences; those of two infinite values are unknown."""
    is_known = np.isfinite(first) | np.isfinite(second)
    return np.subtract(first, second, out=np.full(len(first), np.nan), where=is_known)


def _side_by_side(first: Results, second: Results) -> Results:
    """Two methods as one with twice the frames.

    Confidences become ranks within their method, which changes neither's average precision and lets a swap mix
    methods whose confidences have different units.
    """
    k = max(first.proposals.shape[2], second.proposals.shape[2])
    both = [_ranked(_padded(item, k)) for item in (first, second)]
    names = ("proposals", "proposal_confidence", "probability", "hidden_probability", "seconds")
    answers = {name: np.concatenate([getattr(item, name) for item in both]) for name in names}
    return Results(f"{first.method} {second.method}", _twice(first.truths), **answers)


def _padded(results: Results, n_proposals: int) -> Results:
    pad = ((0, 0), (0, 0), (0, n_proposals - results.proposals.shape[2]))
    return replace(
        results,
        proposals=np.pad(results.proposals, (*pad, (0, 0)), constant_values=np.nan),
        proposal_confidence=np.pad(results.proposal_confidence, pad),
    )


def _ranked(results: Results) -> Results:
    from scipy.stats import rankdata

    ranks: NDArray[np.float32] = np.zeros_like(results.proposal_confidence)
    is_made = np.isfinite(results.proposals[..., 0])
    for joint in range(ranks.shape[1]):
        row, place = np.nonzero(is_made[:, joint])
        ranks[row, joint, place] = rankdata(results.proposal_confidence[row, joint, place]) / max(1, len(row))
    return replace(results, proposal_confidence=ranks)


def _twice(truths: Truths) -> Truths:
    values = vars(truths).items()
    twice: dict[str, Any] = {name: np.concatenate([v, v]) for name, v in values if isinstance(v, np.ndarray)}
    return replace(truths, **twice)
