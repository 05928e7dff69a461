"""Probabilities that mean what they say: logistic regression, and how reliable what came out is."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

WITHIN_M = 0.1
"""A joint counts as found within this [m] (Shotton et al. 2011)."""


def logistic(weights: NDArray[np.float32], values: NDArray[np.float64]) -> NDArray[np.float32]:
    """1 / (1 + exp(-w . t)), (...,) float32, of weights w and terms t (..., n_terms); NaN of NaN weights."""
    logit = np.clip((weights * values).sum(axis=-1), -30.0, 30.0)
    return (1.0 / (1.0 + np.exp(-logit))).astype(np.float32)


@njit(cache=True, nogil=True, inline="always")
def probability_of(weights: np.ndarray, terms: np.ndarray) -> float:
    """1 / (1 + exp(-w . t)) of weights w and terms t (n_terms,), as `logistic`; NaN of NaN weights."""
    logit = 0.0
    for i in range(len(weights)):
        logit += weights[i] * terms[i]
    if np.isnan(logit):
        return np.nan
    return 1.0 / (1.0 + math.exp(-min(max(logit, -30.0), 30.0)))


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
    # Costs half a second to import, which those who only ask a forest need not wait for.
    from scipy.optimize import minimize

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
