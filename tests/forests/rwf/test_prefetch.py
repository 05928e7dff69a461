"""What walkers fetch early is not changed."""

import numpy as np
import pytest
from numba import njit

from forests.rwf.descend import prefetch


@njit
def read_early(values, place):
    prefetch(values, place + 1000)
    prefetch(values, place)
    return values[place]


@pytest.mark.parametrize("dtype", [np.int16, np.float64, [("a", np.int16), ("b", np.int32)]])
def test_an_element_is_the_same_after_it_was_fetched_and_none_need_be_there(dtype):
    values = np.arange(8).astype(dtype)
    assert read_early(values, 5) == values[5]
