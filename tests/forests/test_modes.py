"""Mean shift finds the tops of the density, and how much weight climbs to each."""

import numpy as np
import pytest

from forests.modes import MERGED, WeightedPoints, bell, find_modes, keep_heaviest
from tests import reference_forests_modes as twin

B = 0.05


def modes_of(points, weights=None, bandwidth=B, n_starts=10_000, n_modes=50):
    """(modes, weights, densities of all found) of (n, 3) points."""
    points = np.asarray(points, float)
    weights = np.ones(len(points)) if weights is None else np.asarray(weights, float)
    found = np.full((max(len(points), 1), 5), np.nan)
    n = find_modes(WeightedPoints(*np.ascontiguousarray(points.T), weights), bandwidth, n_starts, found)
    kept = min(n, n_modes)
    mode, weight = np.zeros((n_modes, 3), np.float32), np.zeros(n_modes, np.float32)
    density = found[:n, 4].copy()
    keep_heaviest(found, n, mode, weight)
    return mode[:kept], weight[:kept], density


def cloud(seed: int, n: int = 60, spread: float = 0.05) -> np.ndarray:
    """Three lumps, a few strays."""
    rng = np.random.default_rng(seed)
    centre = rng.normal(0, 0.2, (3, 3))[rng.choice(3, n, p=[0.5, 0.3, 0.2])]
    points = centre + rng.normal(0, spread, (n, 3))
    points[: n // 10] = rng.uniform(-1, 1, (n // 10, 3))
    return points


def test_the_kernel_is_the_gaussian_above_its_floor():
    for t in np.linspace(0.0, 32.0, 999):
        assert bell(t / 32) == pytest.approx(np.exp(-t), rel=2e-6)


@pytest.mark.parametrize("seed", range(6))
def test_modes_and_weights_are_those_of_the_slow_twin(seed):
    """Lumps of a third of the bandwidth: no point lies between two basins."""
    points = cloud(seed, spread=B / 3)
    weights = np.random.default_rng(seed).uniform(0.5, 2.0, len(points))
    mode, weight, _ = modes_of(points, weights)
    expected, ended = twin.mean_shift(points, weights, B)
    assert len(mode) == len(expected)
    assert weight == pytest.approx(ended, rel=1e-5)
    assert np.abs(mode - expected).max() < 0.02 * B


@pytest.mark.parametrize("seed", range(6))
def test_the_densest_mode_is_the_top_that_an_optimiser_finds(seed):
    points = cloud(seed, n=30)
    weights = np.random.default_rng(seed).uniform(0.5, 2.0, len(points))
    mode, _, density = modes_of(points, weights)
    top = twin.highest_place(points, weights, B)
    assert np.linalg.norm(mode - top, axis=1).min() < 0.03 * B
    assert density.max() == pytest.approx(twin.density(points, weights, top, B), rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_a_mode_is_a_fixed_point_of_the_plain_step(seed):
    """In wide clouds too, where basins are a matter of millimetres."""
    points = cloud(seed, n=200, spread=0.1)
    mode, _, _ = modes_of(points)
    for place in mode.astype(float):
        kernel = np.exp(-((points - place) ** 2).sum(axis=1) / B**2)
        assert np.linalg.norm(kernel @ points / kernel.sum() - place) < 0.003 * B


def test_two_clusters_far_apart_give_their_means_and_weights():
    """Much tighter than the bandwidth, a cluster's mode is its weighted mean."""
    rng = np.random.default_rng(0)
    one, two = rng.normal([[[0.3, 0.0, 0.0]], [[-0.3, 0.1, 0.0]]], 0.002, (2, 40, 3))
    weights = rng.uniform(1.0, 2.0, 65)
    points = np.concatenate([one, two[:25]])
    mode, weight, _ = modes_of(points, weights)
    assert weight == pytest.approx([weights[:40].sum(), weights[40:].sum()], rel=1e-6)
    assert np.allclose(mode[0], np.average(one, axis=0, weights=weights[:40]), atol=1e-4)
    assert np.allclose(mode[1], np.average(two[:25], axis=0, weights=weights[40:]), atol=1e-4)


@pytest.mark.parametrize("n", [1, 2, 17])
def test_points_in_one_place_are_one_mode_there(n):
    mode, weight, density = modes_of(np.full((n, 3), [0.1, -0.2, 3.0]))
    assert np.allclose(mode, [[0.1, -0.2, 3.0]], atol=1e-6)
    assert weight.tolist() == [n]
    assert density == pytest.approx([n], rel=1e-5)


@pytest.mark.parametrize(("gap", "n_expected"), [(1.2, 1), (1.6, 2)])
def test_two_points_have_a_mode_each_beyond_the_square_root_of_two_bandwidths(gap, n_expected):
    mode, weight, _ = modes_of([[0.0, 0.0, 0.0], [gap * B, 0.0, 0.0]])
    assert len(mode) == n_expected
    assert weight.sum() == 2.0


def test_no_points_and_points_without_weight_have_no_modes():
    assert len(modes_of(np.empty((0, 3)))[0]) == 0
    assert len(modes_of(cloud(0), np.zeros(60))[0]) == 0


@pytest.mark.parametrize("n_starts", [5, 10_000])
def test_a_point_without_weight_is_as_good_as_absent(n_starts):
    points, weights = cloud(1), np.ones(60)
    weights[::3] = 0.0
    mode, weight, _ = modes_of(points, weights, n_starts=n_starts)
    assert weight.sum() == pytest.approx(40.0)
    if n_starts > 60:
        expected, expected_weight, _ = modes_of(points[weights > 0])
        assert np.allclose(mode, expected, atol=1e-6)
        assert np.array_equal(weight, expected_weight)


def test_modes_move_with_the_points_and_scale_with_the_bandwidth():
    points = cloud(2)
    mode, weight, _ = modes_of(points)
    moved, moved_weight, _ = modes_of(points + np.array([1.0, -2.0, 0.5]))
    larger, larger_weight, _ = modes_of(4.0 * points, bandwidth=4.0 * B)
    assert np.allclose(moved, mode + np.float32([1.0, -2.0, 0.5]), atol=1e-6)
    assert np.allclose(larger, 4.0 * mode, atol=1e-6)
    assert np.array_equal(moved_weight, weight)
    assert np.array_equal(larger_weight, weight)


def test_the_order_of_the_points_does_not_matter_to_separate_lumps():
    points = cloud(3, spread=B / 3)
    mode, weight, _ = modes_of(points)
    other, other_weight, _ = modes_of(points[np.random.default_rng(0).permutation(60)])
    assert np.array_equal(other_weight, weight)
    has_lump = weight > 1
    assert np.abs(other - mode)[has_lump].max() < 0.02 * B


@pytest.mark.parametrize("n_starts", [1, 7, 64])
def test_with_fewer_starts_the_weights_still_add_up(n_starts):
    points = cloud(4, n=300)
    weights = np.random.default_rng(4).uniform(0, 1, 300)
    mode, weight, _ = modes_of(points, weights, n_starts=n_starts)
    assert 1 <= len(mode) <= n_starts
    assert weight.sum() == pytest.approx(weights.sum(), rel=1e-5)
    assert (np.diff(weight) <= 0).all()
    apart = np.linalg.norm(mode[:, None] - mode[None], axis=2)[np.triu_indices(len(mode), 1)]
    assert (apart >= MERGED * B * 0.999).all()


def test_the_heaviest_mode_comes_first_and_the_denser_of_equals():
    found = np.array([[0, 0, 0, 2, 1.0], [1, 0, 0, 5, 1.0], [2, 0, 0, 2, 3.0]], float)
    mode, weight = np.full((4, 3), 9, np.float32), np.full(4, 9, np.float32)
    keep_heaviest(found, 3, mode, weight)
    assert weight.tolist() == [5, 2, 2, 9]
    assert mode[:, 0].tolist() == [1, 2, 0, 9]
