import numpy as np
import pytest

from synth.geometry import extent, thinned, within

RNG = np.random.default_rng(0)


@pytest.mark.parametrize("n", [1, 7, 500])
def test_the_extent_is_that_of_numpy(n):
    points = RNG.normal(size=(n, 3))
    low, high = extent(points)
    np.testing.assert_array_equal(low, points.min(axis=0))
    np.testing.assert_array_equal(high, points.max(axis=0))


def test_no_points_have_a_crossed_extent():
    low, high = extent(np.empty((0, 3)))
    assert (low > high).all()


def test_points_within_a_box_are_those_that_no_axis_excludes():
    points = RNG.uniform(-1, 1, (400, 3)).round(1)  # some lie on the border
    low, high = np.array([-0.5, -0.2, -0.9]), np.array([0.5, 0.7, 0.4])
    want = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
    assert 0 < len(want) < len(points)
    np.testing.assert_array_equal(within(points, low, high), want)


@pytest.mark.parametrize("cell", [0.05, 0.3, 5.0])
def test_thinned_points_are_the_first_of_each_cell(cell):
    points = RNG.normal(size=(600, 3))
    cells = np.floor(points / cell).astype(int)
    first = np.sort(np.unique(cells, axis=0, return_index=True)[1])
    np.testing.assert_array_equal(thinned(points, cell), points[first])
