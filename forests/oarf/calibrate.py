"""Probabilities that mean what they say: logistic regression on what a forest saw of a joint; reliability."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize

TERMS = (
    "one",
    "log_confidence",
    "second_to_first",
    "spread",
    "occluder_share",
    "behind",
    "behind_occluder",
    "no_surface",
)
"""What the probabilities are regressed on, in the order of the weights; see `terms`."""

WITHIN_M = 0.1
"""A joint counts as found within this [m] (Shotton et al. 2011)."""

_LEAST_CONFIDENCE = 1e-6
_MOST_BEHIND_M = 0.5


class Evidence(NamedTuple):
    """What a forest saw of every joint of one image.

    Attributes:
        confidence: (n_joints, n_proposals) float, falling, 0 where missing [m^2].
        spread: (n_joints,) float, of the votes around the first proposal [m]; NaN without votes.
        occluder_share: (n_joints,) float, share of their weight that occluder modes cast; NaN without votes.
        behind: (n_joints,) float, how far the joint lies behind the surface seen at its pixel [m]; NaN where there
            is none.
        occluder_probability: (n_joints,) float, that this surface is an occluder; NaN where there is none.
    """

    confidence: NDArray[np.float32]
    spread: NDArray[np.float32]
    occluder_share: NDArray[np.float32]
    behind: NDArray[np.float32]
    occluder_probability: NDArray[np.float32]


def terms(evidence: Evidence) -> NDArray[np.float64]:
    """(n_joints, len(TERMS)) float64, finite: the terms of the logistic regressions."""
    first = np.maximum(evidence.confidence[:, 0].astype(np.float64), _LEAST_CONFIDENCE)
    second = evidence.confidence[:, 1] / first if evidence.confidence.shape[1] > 1 else np.zeros_like(first)
    behind = np.clip(np.nan_to_num(evidence.behind), -_MOST_BEHIND_M, _MOST_BEHIND_M)
    return np.stack(
        [
            np.ones_like(first),
            np.log(first),
            second,
            np.nan_to_num(evidence.spread),
            np.nan_to_num(evidence.occluder_share),
            behind,
            behind * np.nan_to_num(evidence.occluder_probability),
            np.isnan(evidence.behind).astype(np.float64),
        ],
        axis=1,
    )


def logistic(weights: NDArray[np.float32], values: NDArray[np.float64]) -> NDArray[np.float32]:
    """1 / (1 + exp(-w . t)), (...,) float32, of weights w and terms t (..., n_terms); NaN of NaN weights."""
    logit = np.clip((weights * values).sum(axis=-1), -30.0, 30.0)
    return (1.0 / (1.0 + np.exp(-logit))).astype(np.float32)


def fit_logistic(values: ArrayLike, outcome: ArrayLike, ridge: float = 1.0) -> NDArray[np.float64]:
    """Weights of a logistic regression: the most probable ones, with a Gaussian prior on all but the first.

    Terms are standardised for the prior; the weights apply to the terms as they are. The outcomes are drawn
    in from 0 and 1 as in Platt 1999, so that a joint that is never hidden gets a small probability, not zero.

    Args:
        values: (n, n_terms) float, the first term is 1.
        outcome: (n,) bool.
        ridge: Strength of the prior: `ridge / 2 * |w|^2` is added to the negative log-likelihood.

    Returns:
        (n_terms,) float64.

    Raises:
        ValueError: No samples, shapes that do not fit, or terms that are not finite.
    """
    t, y = np.asarray(values, np.float64), np.asarray(outcome, np.float64)
    if t.ndim != 2 or len(t) == 0 or y.shape != t.shape[:1] or not np.isfinite(t).all():
        raise ValueError(f"terms {t.shape} and outcomes {y.shape} must be (n, n_terms) finite and (n,), n > 0")
    centre, scale = t.mean(axis=0), t.std(axis=0)
    centre[0], scale[0] = 0.0, 1.0
    is_constant = scale < 1e-9
    standard = (t - centre) / np.where(is_constant, 1.0, scale)
    n_true = y.sum()
    y = np.where(y > 0.5, (n_true + 1.0) / (n_true + 2.0), 1.0 / (len(y) - n_true + 2.0))
    penalty = np.full(t.shape[1], ridge)
    penalty[0] = 0.0

    def loss(w: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        logit = standard @ w
        value = np.logaddexp(0.0, logit).sum() - y @ logit + 0.5 * (penalty * w * w).sum()
        p = 1.0 / (1.0 + np.exp(-np.clip(logit, -500.0, 500.0)))
        return float(value), standard.T @ (p - y) + penalty * w

    w = minimize(loss, np.zeros(t.shape[1]), jac=True, method="L-BFGS-B").x
    w = np.where(is_constant, 0.0, w / np.where(is_constant, 1.0, scale))
    w[0] -= (w * centre).sum()
    return w


class Reliability(NamedTuple):
    """How often what was called p came true, by bins of p.

    Attributes:
        predicted: (n_bins,) float64, mean probability; NaN in empty bins.
        observed: (n_bins,) float64, share that came true; NaN in empty bins.
        n_samples: (n_bins,) int64.
    """

    predicted: NDArray[np.float64]
    observed: NDArray[np.float64]
    n_samples: NDArray[np.int64]

    @property
    def expected_error(self) -> float:
        """Expected calibration error: mean of |predicted - observed|, weighted by the bins' samples."""
        filled = self.n_samples > 0
        gap = np.abs(self.predicted[filled] - self.observed[filled])
        return float((gap * self.n_samples[filled]).sum() / self.n_samples.sum())


def reliability(probability: ArrayLike, outcome: ArrayLike, n_bins: int = 10) -> Reliability:
    """Compares probabilities with what came true in bins of equal width.

    Args:
        probability: (n,) float in 0..1.
        outcome: (n,) bool.
        n_bins: Bins.

    Raises:
        ValueError: No values, shapes that differ, or probabilities that are none.
    """
    p, y = np.asarray(probability, np.float64), np.asarray(outcome, np.float64)
    if p.ndim != 1 or len(p) == 0 or p.shape != y.shape:
        raise ValueError(f"probabilities {p.shape} and outcomes {y.shape} must be (n,) both, n > 0")
    if not (p.min() >= 0.0 and p.max() <= 1.0):
        raise ValueError(f"probabilities span {p.min()}..{p.max()}, must be in 0..1")
    if n_bins < 1:
        raise ValueError(f"n_bins={n_bins} must be at least 1")
    place = np.minimum((p * n_bins).astype(np.int64), n_bins - 1)
    count = np.bincount(place, minlength=n_bins)
    divisor = np.where(count > 0, count, np.nan)
    predicted = np.bincount(place, p, n_bins) / divisor
    observed = np.bincount(place, y, n_bins) / divisor
    return Reliability(predicted, observed, count)
