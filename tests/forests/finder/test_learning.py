"""Learned trees say what scikit-learn says, and early ends keep the examples of people."""

import numpy as np
import pytest

from forests.finder.probes import N_FEATURES
from tests.reference_finder import slow_score

ensemble = pytest.importorskip("sklearn.ensemble")


def examples(n=1500):
    rng = np.random.default_rng(5)
    x = rng.normal(size=(n, N_FEATURES)).astype(np.float32)
    y = (x[:, 0] + x[:, 300] * x[:, 2] + rng.normal(0, 0.5, n) > 0.5).astype(np.int8)
    return x, y


def test_trees_equal_those_of_scikit_learn():
    from tools.learn_finder import booster_of, grown

    x, y = examples()
    trees = grown(x, y, 12, 0)
    expected = booster_of(12, 0).fit(x, y).decision_function(x)
    assert [slow_score(row, trees) for row in x] == pytest.approx(expected, abs=1e-4)
    assert np.array_equal(grown(x, y, 12, 0).answer, trees.answer)


def test_early_ends_keep_all_but_a_share_of_the_people_and_drop_most_others():
    from tools.learn_finder import grown, with_early_ends

    x, y = examples()
    trees = with_early_ends(grown(x, y, 30, 0), x, y, 0.1)
    is_kept = np.isfinite([slow_score(row, trees) for row in x])
    assert is_kept[y == 1].mean() >= 0.9
    assert is_kept[y == 0].mean() < is_kept[y == 1].mean()
