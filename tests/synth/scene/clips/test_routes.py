"""Ways through rooms: as short as another library's, free all along, and none where there is none."""

import itertools

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from synth.scene.clips.routes import Router, _shortest
from synth.scene.room.occupancy import Occupancy


def cluttered(seed, share):
    rng = np.random.default_rng(seed)
    is_taken = rng.random((40, 30)) < share
    is_taken[0, 0] = is_taken[-1, -1] = False
    return is_taken


def by_dijkstra(is_taken):
    """Length of the shortest way between opposite corners, by scipy."""
    n_x, n_y = is_taken.shape
    rows, cols, ways = [], [], []
    for a in range(n_x):
        for b in range(n_y):
            for da in (-1, 0, 1):
                for db in (-1, 0, 1):
                    c, d = a + da, b + db
                    if (da or db) and 0 <= c < n_x and 0 <= d < n_y:
                        if is_taken[a, b] or is_taken[c, d] or is_taken[a, d] or is_taken[c, b]:
                            continue
                        rows.append(a * n_y + b)
                        cols.append(c * n_y + d)
                        ways.append(np.hypot(da, db))
    graph = coo_array((ways, (rows, cols)), shape=(n_x * n_y, n_x * n_y)).tocsr()
    return dijkstra(graph, indices=0)[-1]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("share", [0.1, 0.3, 0.45])
def test_ways_are_shortest(seed, share):
    is_taken = cluttered(seed, share)
    cells = np.empty((is_taken.size, 2), np.int64)
    n = _shortest(is_taken, 0, 0, 39, 29, cells)
    expected = by_dijkstra(is_taken)
    if not np.isfinite(expected):
        assert n == 0
        return
    way = cells[:n]
    assert tuple(way[0]) == (39, 29)
    assert tuple(way[-1]) == (0, 0)
    assert not is_taken[way[:, 0], way[:, 1]].any()
    assert np.hypot(*np.diff(way, axis=0).T).sum() == pytest.approx(expected)


def walled(gap):
    """A floor of 4 by 4 m with a wall across, but for a gap [m]."""
    floor = Occupancy(4.0, 4.0)
    floor.take(np.stack([np.zeros(60), np.linspace(-2.0, 2.0 - gap, 60)], axis=1), 0.05)
    return floor


def test_ways_go_round_what_is_in_the_way():
    router = Router(walled(1.2), 0.2)
    start, goal = np.array([-1.2, -1.0]), np.array([1.2, -1.0])
    path = router.path(start, goal)
    assert path is not None
    np.testing.assert_allclose(path[[0, -1]], [start, goal])
    dense = np.concatenate([a + np.linspace(0, 1, 40)[:, None] * (b - a) for a, b in itertools.pairwise(path)])
    assert router.floor.is_free(dense)
    assert dense[:, 1].max() > 0.8
    assert len(path) <= 6


def test_there_is_no_way_through_a_gap_that_is_too_narrow():
    start, goal = np.array([-1.2, -1.0]), np.array([1.2, -1.0])
    assert Router(walled(0.3), 0.2).path(start, goal) is None
    assert Router(walled(1.2), 0.2).path(start, np.array([0.0, -1.0])) is None
