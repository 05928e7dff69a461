"""Probabilities that mean what they say: logistic regression, and how reliable what came out is."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

WITHIN_M = 0.1
"""A joint counts as found within this [m] (Shotton et al. 2011)."""
_FREE_RIDGE = 0.1
"""Strength of the prior of weights of the first term."""
_NEWTON_STEPS, _SHORTEST, _ARRIVED = 50, 1e-4, 1e-7


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


def fit_logistic_alike(
    values: NDArray[np.float64],
    outcome: NDArray[np.bool_],
    is_known: NDArray[np.bool_],
    ridge: float = 1.0,
    own_ridge: float = 10.0,
) -> NDArray[np.float64]:
    """Weights of logistic regressions that are alike: those of each group lie about weights that all groups share.

    A group's weights have a Gaussian prior about the shared ones, and these about 0, but for the first term, whose
    weight is nearly free; otherwise as `fit_logistic`. So a few hundred samples a group are enough for many terms.

    Args:
        values: (n, n_groups, n_terms) float, finite where known, the first term is 1.
        outcome: (n, n_groups) bool.
        is_known: (n, n_groups) bool, which samples there are.
        ridge: Strength of the prior of the shared weights, as in `fit_logistic`.
        own_ridge: Strength of the prior of a group's distance from them.

    Returns:
        (n_groups, n_terms) float64; NaN of groups without samples.

    Raises:
        ValueError: No samples at all.
    """
    if not is_known.any():
        raise ValueError("no sample is known")
    n_groups, n_terms = values.shape[1:]
    rows = values[is_known]
    centre, scale = rows.mean(axis=0), rows.std(axis=0)
    centre[0], scale[0] = 0.0, 1.0
    is_constant = scale < 1e-9
    scale = np.where(is_constant, 1.0, scale)
    standard = np.where(is_known[:, :, None] & ~is_constant, (values - centre) / scale, 0.0).transpose(1, 0, 2)
    n, n_true = is_known.sum(axis=0), (outcome & is_known).sum(axis=0)
    y = np.where(outcome, (n_true + 1.0) / (n_true + 2.0), 1.0 / (n - n_true + 2.0)).T
    penalty = np.full((1 + n_groups, n_terms), own_ridge)
    penalty[0], penalty[:, 0] = ridge, _FREE_RIDGE
    found = _newton(standard, y, is_known.T.astype(np.float64), penalty.reshape(-1))
    weights = (found[:n_terms] + found[n_terms:].reshape(n_groups, n_terms)) * ~is_constant / scale
    weights[:, 0] -= weights @ centre
    return np.where((n > 0)[:, None], weights, np.nan)


def _newton(
    terms: NDArray[np.float64],
    y: NDArray[np.float64],
    weight: NDArray[np.float64],
    penalty: NDArray[np.float64],
) -> NDArray[np.float64]:
    """((1 + n_groups) * n_terms,): the shared weights and each group's distance from them, by Newton's method.

    Args:
        terms: (n_groups, n, n_terms).
        y: (n_groups, n), 0..1.
        weight: (n_groups, n), of the samples.
        penalty: ((1 + n_groups) * n_terms,), above 0.
    """
    n_groups, _, n_terms = terms.shape
    found = np.zeros(len(penalty))

    def logits(flat: NDArray[np.float64]) -> NDArray[np.float64]:
        own = flat.reshape(1 + n_groups, n_terms)
        return np.asarray((terms @ (own[0] + own[1:])[:, :, None])[:, :, 0])

    def loss(flat: NDArray[np.float64]) -> float:
        logit = logits(flat)
        return float((weight * (np.logaddexp(0.0, logit) - y * logit)).sum() + 0.5 * (penalty * flat**2).sum())

    least = loss(found)
    for _ in range(_NEWTON_STEPS):
        p = 1.0 / (1.0 + np.exp(-np.clip(logits(found), -500.0, 500.0)))
        slope = ((weight * (p - y))[:, None, :] @ terms)[:, 0]
        curve = (terms * (weight * p * (1.0 - p))[:, :, None]).transpose(0, 2, 1) @ terms
        slopes = np.concatenate([slope.sum(axis=0)[None], slope]).reshape(-1) + penalty * found
        curves = np.zeros((1 + n_groups, n_terms, 1 + n_groups, n_terms))
        curves[0, :, 0] = curve.sum(axis=0)
        for group in range(n_groups):
            curves[1 + group, :, 1 + group] = curves[0, :, 1 + group] = curves[1 + group, :, 0] = curve[group]
        step = np.linalg.solve(curves.reshape(len(penalty), -1) + np.diag(penalty), slopes)
        size = 1.0
        while size > _SHORTEST and loss(found - size * step) > least:
            size *= 0.5
        found = found - size * step
        gain, least = least - loss(found), loss(found)
        if gain < _ARRIVED:
            break
    return found


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
