"""Mean shift on cells of votes, against the exact one over all votes."""

import numpy as np
import pytest

from forests.modes import quick_bell
from forests.oarf.peaks import find_peaks
from tests.reference_forests_predict import best_mode, densities


def test_the_cheap_exponential_is_close():
    t = np.linspace(0.0, 8.0, 500, dtype=np.float32)
    values = np.array([quick_bell(x) for x in t])
    assert np.allclose(values, np.exp(-t), rtol=2.5e-3)
    assert 0.0 < quick_bell(np.float32(1e9)) < 2e-7


@pytest.mark.parametrize("n", [1, 7, 400, 3000])
def test_the_first_proposal_is_the_twins_densest_mode(n):
    """Two heaps of votes over a haze: as dense as the best to 1 %, and the density agrees to 5 %."""
    rng = np.random.default_rng(n)
    width = 0.08
    for _ in range(5):
        centres = rng.uniform(-1.0, 1.0, (2, 3)) + np.array([0.0, 0.0, 3.0])
        heaps = centres[rng.integers(0, 2, n)] + rng.normal(0.0, 0.05, (n, 3))
        places = np.where(rng.random((n, 1)) < 0.6, heaps, rng.uniform(-1.0, 4.0, (n, 3))).astype(np.float32)
        weights = rng.uniform(0.1, 2.0, n).astype(np.float32)
        votes = np.concatenate([places, weights[:, None]], axis=1)[None]
        proposals, density = np.empty((1, 3, 3), np.float32), np.empty((1, 3), np.float32)
        spread, share = np.empty(1, np.float32), np.empty(1, np.float32)
        find_peaks(votes, np.array([n]), 1, np.array([width], np.float32), proposals, density, spread, share)
        expected = best_mode(places.astype(float), weights.astype(float), width)
        best = densities(expected[None], places, weights, width)
        found = densities(proposals[0, :1], places, weights, width)
        assert found > 0.99 * best
        assert np.isclose(density[0, 0], best, rtol=0.05)
        is_near = np.linalg.norm(places - proposals[0, 0], axis=1) < 2 * width
        squares = ((places - proposals[0, 0]) ** 2).sum(axis=1)
        deviation = np.sqrt(np.average(squares[is_near], weights=weights[is_near]))
        assert np.isclose(spread[0], deviation, rtol=0.15, atol=2e-3)


def test_further_proposals_are_other_heaps_by_falling_density():
    rng = np.random.default_rng(5)
    centres = np.array([[0.0, 0.0, 2.0], [0.6, 0.0, 2.0], [0.0, 0.7, 2.2]])
    sizes = (300, 200, 100)
    places = np.concatenate([c + rng.normal(0.0, 0.02, (n, 3)) for c, n in zip(centres, sizes, strict=True)])
    votes = np.zeros((2, 400, 4), np.float32)
    votes[0, :400, :3], votes[1, :200, :3] = places[:400], places[400:]
    votes[..., 3] = 1.0
    proposals, density = np.empty((1, 4, 3), np.float32), np.empty((1, 4), np.float32)
    spread, share = np.empty(1, np.float32), np.empty(1, np.float32)
    count = np.array([400, 200])
    find_peaks(votes, count, 2, np.array([0.08], np.float32), proposals, density, spread, share)
    assert np.allclose(proposals[0, :3], centres, atol=0.01)
    assert np.isnan(proposals[0, 3]).all()
    assert density[0, 0] > density[0, 1] > density[0, 2] > density[0, 3] == 0
    assert share[0] == 0.0  # the second stream holds other heaps
