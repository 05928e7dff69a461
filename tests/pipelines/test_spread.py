"""Evenly spread places: rising, within range, as many as asked, as even as whole numbers can be."""

import numpy as np
import pytest

from pipelines.spread import at_most, evenly_spread, first_to_last


@pytest.mark.parametrize("n_things", [1, 2, 7, 100, 101])
@pytest.mark.parametrize("n_taken", [0, 1, 3, 7, 100, 250])
def test_each_thing_is_taken_as_often_as_the_others_within_one(n_things, n_taken):
    places = evenly_spread(n_things, n_taken)
    assert len(places) == n_taken
    counts = np.bincount(places, minlength=n_things)
    assert len(counts) == n_things
    assert (np.diff(places) >= 0).all()
    assert np.ptp(counts) <= 1
    if 0 < n_taken <= n_things:
        assert places[0] == 0
        assert np.ptp(np.diff(places, append=n_things)) <= 1


def test_nothing_is_spread_over_nothing():
    assert len(evenly_spread(0, 0)) == len(at_most(0, 5)) == len(at_most(0, 0)) == len(first_to_last(0, 3)) == 0
    with pytest.raises(ValueError, match="n_taken=2 of 0 things must be 0"):
        evenly_spread(0, 2)


def test_a_limit_of_none_takes_all():
    for limit in (0, 9, 10):
        np.testing.assert_array_equal(at_most(9, limit), np.arange(9))
    np.testing.assert_array_equal(at_most(9, 3), [0, 3, 6])


@pytest.mark.parametrize("limit", [1, 2, 5, 12])
@pytest.mark.parametrize("n_things", [1, 3, 12, 13, 400])
def test_the_first_and_the_last_are_among_them(n_things, limit):
    places = first_to_last(n_things, limit)
    assert len(places) == min(n_things, limit)
    assert (np.diff(places) > 0).all()
    assert places[0] == 0
    assert limit == 1 or places[-1] == n_things - 1
