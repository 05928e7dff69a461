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


def test_early_ends_keep_the_people_who_are_found_and_drop_most_others():
    from tools.learn_finder import grown, with_early_ends

    x, y = examples()
    whole = grown(x, y, 30, 0)
    trees = with_early_ends(whole, x, y)
    full, early = (np.array([slow_score(row, kind) for row in x]) for kind in (whole, trees))
    is_kept = np.isfinite(early)
    assert np.array_equal(full[is_kept], early[is_kept])
    assert is_kept[(y == 1) & (full > 0)].all()
    assert is_kept[y == 0].mean() < 0.7
