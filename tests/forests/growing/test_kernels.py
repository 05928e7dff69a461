"""Gains are what scipy and plain sums say; thresholds lie between the bins."""

import numpy as np
import pytest
from scipy.stats import entropy

from forests.features import FEATURE_LIMIT_MM
from forests.growing import DIRECTION_ONE
from forests.growing.bins import bin_threshold, bin_values, inner_range
from forests.growing.gain import LOG_ONE, direction_gain, entropy_gain, n_log_n_table
from forests.growing.splitting import _nth_largest
from tests import reference_forests_growing as reference


def unit_directions(n: int, seed: int = 0) -> np.ndarray:
    """(n, 3) int16 directions."""
    vectors = np.random.default_rng(seed).normal(size=(n, 3))
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.round(vectors * DIRECTION_ONE).astype(np.int16)


def test_entropy_gain_is_what_scipy_says():
    rng = np.random.default_rng(4)
    table = n_log_n_table(300)
    assert table[0] == table[1] == 0
    for n_classes, n_bins in ((1, 3), (2, 4), (7, 9), (40, 33)):
        columns = rng.integers(0, n_classes, 300).astype(np.int32)
        bins = np.minimum(rng.integers(0, n_bins, 300), columns + rng.integers(0, n_bins, 300)) % n_bins
        total = np.bincount(columns, minlength=n_classes).astype(np.uint32)
        counts, left = np.empty(n_bins * n_classes, np.uint32), np.empty(n_classes, np.uint32)
        gain, last = entropy_gain(
            (bins * n_classes).astype(np.int32), columns, total, n_bins, 10, table, counts, left
        )
        gains = [
            reference.information_gain(columns, bins > b) if 10 <= (bins > b).sum() <= 290 else -1.0
            for b in range(n_bins - 1)
        ]
        assert gain / 300 == pytest.approx(max(gains), abs=1e-6)
        assert gains[last] == pytest.approx(max(gains), abs=1e-6)
    assert entropy([0.5, 0.5]) * 300 == pytest.approx((table[300] - 2 * table[150]) / LOG_ONE)


def test_direction_gain_is_the_fall_of_the_deviation():
    rng = np.random.default_rng(4)
    directions = unit_directions(300)
    bins = (directions[:, 0] + rng.integers(0, 20000, 300)) // 6000 % 9
    sums = np.empty(36, np.int64)
    gain, last = direction_gain((bins * 4).astype(np.int32), directions.astype(np.int32), 9, 10, sums)
    gains = [
        reference.deviation_fall(directions, bins > b) if 10 <= (bins > b).sum() <= 290 else -1.0 for b in range(8)
    ]
    assert gain / DIRECTION_ONE**2 == pytest.approx(max(gains))
    assert last == np.argmax(gains)


@pytest.mark.parametrize(("low", "high"), [(-1999, 1999), (-3, 40), (7, 7), (0, 0), (-731, 1200)])
@pytest.mark.parametrize("n_inner", [2, 31, 255])
def test_thresholds_lie_between_the_bins(low, high, n_inner):
    """A value is above the threshold of bin k if, and only if, its bin is above k."""
    values = np.arange(-FEATURE_LIMIT_MM, FEATURE_LIMIT_MM + 1, dtype=np.int32)
    bins = np.empty(len(values), np.int32)
    bin_values(values, np.int32(low), np.int32(high), n_inner, 1, bins)
    assert (bins[0], bins[-1]) == (0, n_inner + 1)
    assert (np.diff(bins) >= 0).all()
    assert set(np.unique(bins)) <= set(range(n_inner + 2))
    for number in np.unique(bins[:-1]):
        threshold = bin_threshold(number, np.int32(low), np.int32(high), n_inner)
        assert np.array_equal(values > threshold, bins > number)


def test_the_inner_range_leaves_cut_values_out():
    assert inner_range.py_func(np.array([2000, -2000, 5, -7, 2000], np.int32)) == (-7, 5)
    assert inner_range.py_func(np.array([2000, -2000], np.int32)) == (0, 0)


@pytest.mark.parametrize("n", [1, 3, 50])
def test_the_nth_largest_is_numpys(n):
    """Ties and as many values as are asked for included."""
    rng = np.random.default_rng(n)
    for values in (rng.random(50), rng.integers(0, 4, 50).astype(float), np.full(50, -1.0)):
        assert _nth_largest(values, np.empty(n)) == np.sort(values)[-n]
