"""Scores of a condition: each method's mean over seeds, and paired differences between methods."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.metrics import MEASURES, by_state, every_frame_once, interval, statistics_of
from pipelines.metrics.comparing import compare_seeds
from pipelines.metrics.document import number
from pipelines.metrics.resampling import FrameWeights, Mean
from pipelines.metrics.results import Results, Truths

Answers = Mapping[str, Sequence[Results]]
"""What each method answered, by seed; all on the same frames."""

GROUPS = ("occluded", "visible", "non_occluded")
"""Groups of joints that are told beside all of them."""
PAIRS: tuple[tuple[str, str], ...] = (
    ("semantic", "occluders"),
    ("occluders", "baseline"),
    ("semantic", "baseline"),
    ("rwf", "rwf_body"),
    ("semantic", "rwf"),
    ("heat", "heat_body"),
    ("heat_object", "heat"),
    ("heat_classes", "heat_object"),
    ("heat", "semantic"),
)
"""Methods that are compared: by how much the first is above the second."""


@dataclass(frozen=True)
class Resampling:
    """How intervals and p-values are drawn; the same for every method and condition.

    Attributes:
        n: Resamples.
        seed: Of their drawing.
    """

    n: int
    seed: int = 0

    def rng(self) -> np.random.Generator:
        """A generator at its beginning."""
        return np.random.default_rng(self.seed)


def groups_of(truths: Truths) -> dict[str, NDArray[np.bool_]]:
    """(n, n_joints) bool by name: all joints under "", then `GROUPS`."""
    states = by_state(truths)
    return {"": np.ones(truths.state.shape, np.bool_)} | {name: states[name] for name in GROUPS}


def row_scores(seeds: Sequence[Results], weights: FrameWeights) -> dict:
    """A method's measures as JSON values, each the mean over seeds.

    Beside each measure: `_ci`, the 95 % interval of that mean over test frames; `_by_seed`; `_sd`, the standard
    deviation over seeds, None of a single one. The groups hold the same under their names.

    Args:
        seeds: Its answers by seed, on the same frames.
        weights: (n_resamples, n_frames) int16, resamples of the frames.
    """
    document: dict = {"n_seeds": len(seeds), "n_frames": len(seeds[0].truths)}
    for name, is_counted in groups_of(seeds[0].truths).items():
        values = _group_scores(seeds, is_counted, weights)
        document |= {name: values} if name else values
    return document


def _group_scores(seeds: Sequence[Results], is_counted: NDArray[np.bool_], weights: FrameWeights) -> dict:
    statistics = [statistics_of(results, is_counted) for results in seeds]
    once = every_frame_once(is_counted.shape[0])
    document: dict = {"n_joints": int(is_counted.sum())}
    for name in MEASURES:
        by_seed = np.array([float(of_seed[name](once)[0]) for of_seed in statistics])
        estimate = float(by_seed.mean())
        ends = interval(estimate, Mean(tuple(of_seed[name] for of_seed in statistics))(weights))
        document[name] = number(estimate)
        document[f"{name}_ci"] = None if document[name] is None else [number(end) for end in ends]
        document[f"{name}_by_seed"] = [number(value) for value in by_seed]
        is_spread = len(seeds) > 1 and np.isfinite(by_seed).all()
        document[f"{name}_sd"] = number(by_seed.std(ddof=1)) if is_spread else None
    return document


def pair_scores(answers: Answers, resampling: Resampling) -> dict[str, dict]:
    """The paired differences of a condition as JSON values, by "first - second".

    Seeds are paired by their number; methods that answer other joints are not. Each measure holds first, second,
    estimate, ci and p_value; the groups hold the same under their names.
    """
    documents = {}
    for first, second in PAIRS:
        pairs = list(zip(answers.get(first, ()), answers.get(second, ()), strict=False))
        if pairs and pairs[0][0].truths.joints == pairs[0][1].truths.joints:
            documents[f"{first} - {second}"] = pair_document(pairs, resampling)
    return documents


def pair_document(pairs: Sequence[tuple[Results, Results]], resampling: Resampling) -> dict:
    """A paired difference as JSON values.

    Args:
        pairs: Answers of the two methods by seed, on the same frames and joints.
        resampling: How intervals and p-values are drawn.
    """
    document: dict = {"n_seeds": len(pairs)}
    for name, is_counted in groups_of(pairs[0][0].truths).items():
        differences = compare_seeds(pairs, is_counted, resampling.rng(), resampling.n)
        values = {
            measure: {
                "first": number(difference.first),
                "second": number(difference.second),
                "estimate": number(difference.estimate),
                "ci": [number(difference.low), number(difference.high)],
                "p_value": number(difference.p_value),
            }
            for measure, difference in differences.items()
        }
        document |= {name: values} if name else values
    return document
