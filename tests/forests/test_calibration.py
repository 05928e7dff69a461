"""Logistic regressions that are alike lie between one for all groups and one a group."""

import numpy as np
import pytest
from scipy.optimize import minimize

from forests.calibration import fit_logistic, fit_logistic_alike, logistic, probability_of


def samples(n=300, n_groups=3, seed=0):
    """Terms (n, n_groups, 3), outcomes, and the weights they were drawn with."""
    rng = np.random.default_rng(seed)
    values = rng.normal(2.0, 3.0, (n, n_groups, 3))
    values[:, :, 0] = 1.0
    weights = np.array([0.5, 1.0, -0.7]) + rng.normal(0.0, 0.3, (n_groups, 3))
    return values, rng.random((n, n_groups)) < logistic(weights, values), weights


def test_weights_are_those_of_the_least_loss():
    values, outcome, _ = samples(n=80)
    known = np.random.default_rng(1).random(outcome.shape) < 0.8
    found = fit_logistic_alike(values, outcome, known, ridge=2.0, own_ridge=5.0)
    rows = values[known]
    centre, scale = rows.mean(axis=0), rows.std(axis=0)
    centre[0], scale[0] = 0.0, 1.0
    n, n_true = known.sum(axis=0), (outcome & known).sum(axis=0)
    y = np.where(outcome, (n_true + 1) / (n_true + 2), 1 / (n - n_true + 2))

    def loss(flat):
        shared, own = flat[:3], flat[3:].reshape(3, 3)
        logit = (((values - centre) / scale) * (shared + own)).sum(axis=2)
        fit = (np.logaddexp(0, logit) - y * logit)[known].sum()
        prior = 0.1 * shared[0] ** 2 + 2.0 * (shared[1:] ** 2).sum()
        return fit + 0.5 * (prior + 0.1 * (own[:, 0] ** 2).sum() + 5.0 * (own[:, 1:] ** 2).sum())

    flat = minimize(loss, np.zeros(12), method="BFGS", options={"gtol": 1e-7}).x
    expected = (flat[:3] + flat[3:].reshape(3, 3)) / scale
    expected[:, 0] -= expected @ centre
    np.testing.assert_allclose(found, expected, atol=2e-4)


def test_far_from_alike_each_group_has_its_own_weights_and_alike_all_have_the_same():
    values, outcome, _ = samples()
    known = np.full(outcome.shape, True)
    free = fit_logistic_alike(values, outcome, known, ridge=1e-6, own_ridge=1e-6)
    own = [fit_logistic(values[:, group], outcome[:, group], ridge=1e-6) for group in range(3)]
    np.testing.assert_allclose(free[:, 1:], np.stack(own)[:, 1:], atol=0.02)
    tied = fit_logistic_alike(values, outcome, known, own_ridge=1e6)
    np.testing.assert_allclose(tied[:, 1:], tied[[0, 0, 0], 1:], atol=1e-3)


def test_few_samples_of_a_group_learn_from_the_others():
    values, outcome, weights = samples(n=2000, n_groups=5)
    known = np.full(outcome.shape, True)
    known[20:, 0] = False
    alike = fit_logistic_alike(values, outcome, known)[0]
    alone = fit_logistic(values[:20, 0], outcome[:20, 0])
    error = [np.abs(logistic(w, values[:, 0]) - logistic(weights[0], values[:, 0])).mean() for w in (alike, alone)]
    assert error[0] < 0.8 * error[1]


def test_groups_without_samples_have_no_weights_and_what_is_unknown_is_not_read():
    values, outcome, _ = samples()
    known = np.full(outcome.shape, True)
    known[:, 1] = False
    found = fit_logistic_alike(values, outcome, known)
    assert np.isnan(found[1]).all()
    values[:, 1] = 1e9
    np.testing.assert_array_equal(fit_logistic_alike(values, outcome, known), found)
    with pytest.raises(ValueError, match="no sample"):
        fit_logistic_alike(values, outcome, np.zeros_like(known))


def test_one_probability_is_that_of_many():
    values, _, weights = samples(n=20)
    weights[1] = np.nan
    expected = logistic(weights, values)
    for row, probabilities in zip(values, expected, strict=True):
        one = [probability_of(w, t) for w, t in zip(weights, row, strict=True)]
        np.testing.assert_allclose(one, probabilities, atol=1e-6)
