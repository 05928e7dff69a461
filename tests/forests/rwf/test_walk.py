"""A walk reads, decides and steps as its slow twin does; its end is known on toy scenes."""

import numpy as np
import pytest

from forests.crops import crop_image
from forests.features import probe
from forests.frames import Intrinsics
from forests.rwf.model import ExpertTree, WalkPlan
from forests.rwf.tables import WEIGHT_ONE, WalkTables, pack_experts, walk_tables
from forests.rwf.walk import describe_votes, gather, read_depth, walk_joint, walk_skeleton
from forests.skeleton.answers import edges_of
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE
from tests import reference_forests_rwf as reference

CAMERA = Intrinsics(100.0, 110.0, 47.5, 35.5)
INTRINSICS = np.array([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy], np.float32)
OPEN_GATE = (0.0, np.inf)
EDGES = edges_of((72, 96), CAMERA)


def plan_of(
    n_joints=1, scatter_m=0.05, gates=(OPEN_GATE,), n_walks=5, n_steps=4, parents=None, **changed
) -> WalkPlan:
    values = {"bandwidth_m": 0.1, "n_arriving": 0} | changed
    return WalkPlan(
        np.arange(n_joints, dtype=np.int32),
        np.array([-1] * n_joints if parents is None else parents, np.int32),
        np.full(n_joints, scatter_m, np.float32),
        np.full(n_joints, values["bandwidth_m"], np.float32),
        np.full(n_joints, values["n_arriving"], np.int32),
        np.tile(np.float32(gates), (n_joints, 1, 1)),
        np.full(n_joints, n_walks, np.int32),
        n_steps,
    )


def tables_of(grown) -> WalkTables:
    return walk_tables(pack_experts(grown))


def one_leaf(*offsets, share=None) -> ExpertTree:
    """A tree that always answers the same."""
    nodes = np.zeros(1, NODE_DTYPE)
    nodes["threshold"] = LEAF_THRESHOLD
    n = len(offsets)
    share = np.full((1, n), 1 / n, np.float32) if share is None else np.float32([share])
    return ExpertTree(nodes, np.float32([offsets]), share, np.zeros((1, n), np.float32))


def random_tree(rng: np.random.Generator, levels=6, n_clusters=3) -> ExpertTree:
    """A full tree with random features, thresholds, offsets, shares and spreads."""
    n_inner = 2**levels - 1
    nodes = np.zeros(2 * n_inner + 1, NODE_DTYPE)
    nodes["left"] = 2 * np.arange(len(nodes)) + 1
    nodes["left"][n_inner:] = np.arange(n_inner, len(nodes))
    nodes["leaf"] = np.where(np.arange(len(nodes)) < n_inner, -1, np.arange(len(nodes)) - n_inner)
    nodes["threshold"] = np.where(nodes["leaf"] < 0, rng.integers(-300, 300, len(nodes)), LEAF_THRESHOLD)
    nodes["u"][:n_inner] = rng.uniform(-0.4, 0.4, (n_inner, 2))
    nodes["v"][:n_inner] = rng.uniform(-0.4, 0.4, (n_inner, 2)) * rng.integers(0, 2, (n_inner, 1))
    offset = rng.normal(0, 0.1, (n_inner + 1, n_clusters, 3))
    share = np.sort(rng.dirichlet(np.ones(n_clusters), n_inner + 1))[:, ::-1]
    share[::2, -1] = 0.0
    share /= share.sum(axis=1, keepdims=True)
    spread = rng.uniform(0, 0.2, share.shape)
    return ExpertTree(nodes, *(values.astype(np.float32) for values in (offset, share, spread)))


def random_depth(rng: np.random.Generator) -> np.ndarray:
    """Blocks at various depths with holes between them."""
    coarse = rng.integers(1500, 2600, (9, 12)) * (rng.random((9, 12)) < 0.7)
    return np.kron(coarse, np.ones((8, 8))).astype(np.uint16)


def walked(depth, tables: WalkTables, plan: WalkPlan, start, seed=5, n_ends=3) -> tuple[np.ndarray, np.ndarray]:
    """Ends and votes of one joint."""
    votes = np.empty((plan.n_walks[0] * plan.n_steps * tables.vote.shape[1], 4), np.float32)
    ends = np.empty((n_ends, 4), np.float32)
    n = walk_joint(depth, INTRINSICS, tables, plan, 0, seed, np.float32(start), votes, ends)
    return ends, votes[:n]


@pytest.mark.parametrize("gates", [(OPEN_GATE,), ((0.3, 0.6),), (OPEN_GATE, (9.0, 9.0), (0.1, 0.2))])
def test_every_vote_is_the_slow_twins(gates):
    rng = np.random.default_rng(3)
    depth = random_depth(rng)
    tables = tables_of((tuple(random_tree(rng) for _ in gates),))
    plan, centre, expected = plan_of(gates=gates), np.float32([0.1, -0.1, 2.0]), []
    for n_steps in range(1, plan.n_steps + 1):
        expected.append(reference.votes(depth, INTRINSICS, tables, plan, 0, 5, n_steps - 1, centre))
        ends, votes = walked(depth, tables, plan._replace(n_steps=n_steps), (0.1, -0.1, 2.0), n_ends=1)
        np.testing.assert_allclose(votes, np.concatenate(expected), rtol=0, atol=1e-6)
        # What the next step starts from is a mode, but not of as many starts as the last one's.
        gather(votes, 0.1, 6, ends)
        centre = ends[0, :3]
    for n_arriving in (1, 2, 3):
        later = plan._replace(n_arriving=np.int32([n_arriving]))
        votes = walked(depth, tables, later._replace(n_steps=n_arriving + 1), (0.1, -0.1, 2.0))[1]
        assert 0 < len(votes) <= plan.n_walks[0] * 3
    assert len(np.unique(np.concatenate(expected), axis=0)) > 30


def test_ends_are_modes_of_the_votes_with_their_density_densest_first():
    rng = np.random.default_rng(0)
    bundles = [(0.0, 0.0, 2.0, 40), (0.5, 0.0, 2.0, 25), (0.0, -0.6, 2.5, 10)]
    votes = np.concatenate([rng.normal((x, y, z), 0.03, (n, 3)) for x, y, z, n in bundles])
    votes = np.float32(np.c_[votes, rng.uniform(0.5, 1.5, len(votes))])[rng.permutation(75)]
    ends = np.empty((5, 4), np.float32)
    gather(votes, 0.1, 30, ends)
    for end, bundle in zip(ends, bundles, strict=False):
        assert np.linalg.norm(end[:3] - bundle[:3]) < 0.02
        np.testing.assert_allclose(end[:3], reference.climb(votes, 0.1, end[:3]), atol=2e-3)
        np.testing.assert_allclose(end[3], reference.density(votes, 0.1, end[:3]), rtol=5e-3)
    assert np.isnan(ends[3:, :3]).all()
    assert (ends[3:, 3] == 0).all()
    assert (np.diff(ends[:, 3]) <= 0).all()


def test_a_vote_that_is_always_right_is_where_the_walk_ends():
    """Walkers that know the joint from wherever they stand: each step's leaf would be another, so one step."""
    wall = np.full((72, 96), 2000, np.uint16)
    tables = tables_of(((one_leaf((0.3, 0.0, 0.1)),),))
    ends, votes = walked(wall, tables, plan_of(n_steps=1, n_walks=200, scatter_m=0.02), (0.0, 0.0, 2.0))
    np.testing.assert_allclose(ends[0, :3], [0.3, 0.0, 2.11], atol=0.015)
    said = np.empty(3, np.float32)
    describe_votes(votes, ends[0], EDGES, said)
    assert 0.02 < said[0] < 0.04
    assert said[1:] == pytest.approx([1.0, 0.0])


def test_votes_outside_the_image_are_counted_by_their_weight():
    left, top, right, _ = EDGES.tolist()
    votes = np.float32([[0, 0, 2, 1], [2.02 * right, 0, 2, 2], [0, 2.02 * top, 2, 3], [1.98 * left, 0, 2, 4]])
    said = np.empty(3, np.float32)
    describe_votes(votes, votes[0], EDGES, said)
    assert said[1:] == pytest.approx([2.5, 0.5])


def test_a_leaf_with_two_clusters_has_two_ends_by_their_shares():
    wall = np.full((72, 96), 2000, np.uint16)
    tables = tables_of(((one_leaf((0.4, 0.0, 0.0), (-0.4, 0.0, 0.0), share=(0.7, 0.3)),),))
    ends, _ = walked(wall, tables, plan_of(n_steps=1, n_walks=50, scatter_m=0.01), (0.0, 0.0, 2.0))
    np.testing.assert_allclose(ends[:2, 0], [0.4, -0.4], atol=0.01)
    np.testing.assert_allclose(ends[:2, 3] / ends[:2, 3].sum(), [0.7, 0.3], atol=0.01)
    assert ends[2, 3] == 0


def test_scattered_clusters_weigh_less():
    sharp, wide = one_leaf((0.4, 0.0, 0.0)), one_leaf((-0.4, 0.0, 0.0))
    wide = wide._replace(spread=np.float32([[0.1]]))
    tables = tables_of(((sharp, wide),))
    np.testing.assert_allclose(tables.vote[:, 0, 3] / WEIGHT_ONE, [1.0, 0.125], atol=2e-5)


def test_the_gate_snaps_points_to_the_surface_and_lets_go_where_nothing_is():
    depth = np.zeros((72, 96), np.uint16)
    depth[:, :60] = 2000
    for z, gate, expected in (
        (2.2, (0.3, 1.0), 2.0),
        (1.5, (0.3, 1.0), 2.0),
        (2.5, (0.3, 1.0), 2.5),
        (4.0, (0.3, 1.0), 3.0),
        (4.0, (0.3, 0.2), 2.0),
    ):
        _, _, place = reference.place(depth, np.float32([-0.1, 0.0, z]), INTRINSICS, np.float32(gate))
        np.testing.assert_allclose(place, np.float32([-0.1 * expected / z, 0.0, expected]), rtol=1e-6)
        still = tables_of(((one_leaf((0.0, 0.0, 0.0)),),))
        _, votes = walked(depth, still, plan_of(gates=(gate,), scatter_m=1e-6, n_steps=1), (-0.1, 0.0, z))
        np.testing.assert_allclose(votes[:, 2], expected, atol=1e-5)
    _, votes = walked(depth, still, plan_of(gates=((0.3, 1.0),), scatter_m=1e-6, n_steps=1), (0.8, 0.0, 2.6))
    np.testing.assert_allclose(votes[:, 2], 2.6, atol=1e-5)


def test_a_joint_starts_from_its_parents_estimate():
    wall = np.full((72, 96), 2000, np.uint16)
    right, down = one_leaf((1.0, 0.0, 0.0)), one_leaf((0.0, 1.0, 0.0))
    tables = tables_of(((right,), (down,), (down,)))
    plan = plan_of(3, n_steps=1, scatter_m=1e-4, parents=[-1, 0, -1])
    ends, said = np.empty((3, 2, 4), np.float32), np.empty((3, 3), np.float32)
    walk_skeleton(wall, INTRINSICS, tables, plan, np.float32([0, 0, 2]), 0, EDGES, ends, said)
    np.testing.assert_allclose(ends[:, 0, :3], [[1, 0, 2], [1, 1, 2], [0, 1, 2]], atol=1e-3)
    np.testing.assert_allclose(said[:, 0], 0.0, atol=1e-3)
    np.testing.assert_allclose(said[:, 1], 1.0)
    np.testing.assert_array_equal(said[:, 2] > 0.99, [True, True, True])


def test_the_same_seed_walks_the_same_walk_and_another_seed_another():
    rng = np.random.default_rng(0)
    depth, tables = random_depth(rng), tables_of(((random_tree(rng),),))
    first, again = (walked(depth, tables, plan_of(), (0, 0, 2.0), seed=7)[1] for _ in range(2))
    other = walked(depth, tables, plan_of(), (0, 0, 2.0), seed=8)[1]
    np.testing.assert_array_equal(first, again)
    assert other.shape != first.shape or (first != other).any()


def test_walkers_scatter_as_wide_as_the_plan_says():
    empty = np.zeros((72, 96), np.uint16)
    tables = tables_of(((one_leaf((0.0, 0.0, 0.0)),),))
    _, votes = walked(empty, tables, plan_of(n_walks=4000, n_steps=1, scatter_m=0.1), (0.0, 0.0, 2.0))
    off = votes[:, :3] - np.float32([0, 0, 2.0])
    np.testing.assert_allclose(off.mean(axis=0), 0.0, atol=4 * 0.1 / np.sqrt(4000))
    np.testing.assert_allclose(off.std(axis=0), 0.1, rtol=0.04)


def test_walkers_cover_the_cube_evenly():
    """Of 64 of them, each of four slices along each axis has 16, or nearly so; by chance the spread would be 3.5."""
    empty = np.zeros((72, 96), np.uint16)
    tables = tables_of(((one_leaf((0.0, 0.0, 0.0)),),))
    for seed in range(20):
        _, votes = walked(empty, tables, plan_of(n_walks=64, n_steps=1, scatter_m=0.1), (0.0, 0.0, 2.0), seed)
        side = 0.1 * np.sqrt(3.0)
        for axis, middle in enumerate((0.0, 0.0, 2.0)):
            in_slice, _ = np.histogram(votes[:, axis], middle + side * np.linspace(-1.001, 1.001, 5))
            assert in_slice.sum() == 64
            assert np.abs(in_slice - 16).max() <= 3


def test_the_image_reads_as_the_crop_that_trees_are_grown_on():
    rng = np.random.default_rng(1)
    depth = np.zeros((72, 96), np.uint16)
    depth[20:60, 30:80] = random_depth(rng)[:40, :50]
    crops = crop_image(depth, CAMERA)
    left, top = crops.origin[0]
    half = np.float32(0.5)
    for _ in range(2000):
        # Sixteenths of a pixel: sums that both coordinate systems hold exactly.
        x, y = rng.integers(-40, 140), rng.integers(-40, 110)
        dx, dy = np.float32(rng.integers(-800, 800, 2) / 16)
        from_image = read_depth(depth, np.float32(x + half + dx), np.float32(y + half + dy))
        from_crop = probe(
            crops.pixels, 0, crops.width[0], crops.height[0], np.float32(x - left + half),
            np.float32(y - top + half), np.float32(1), np.float32(1), dx, dy,
        )  # fmt: skip
        assert from_image == from_crop


@pytest.mark.parametrize("start", [(0.0, 0.0, 2.0), (50.0, 0.0, 2.0), (0.0, 0.0, 0.0), (1e6, -1e6, 0.3)])
def test_walks_stay_finite_wherever_they_start_and_whatever_they_see(start):
    rng = np.random.default_rng(2)
    tables = tables_of(((random_tree(rng),),))
    for depth in (np.zeros((72, 96), np.uint16), random_depth(rng), np.full((1, 1), 65535, np.uint16)):
        ends, votes = walked(depth, tables, plan_of(gates=((0.0, 0.2),)), start)
        assert np.isfinite(ends[0]).all()
        assert np.isfinite(votes).all()
        assert 0 < ends[0, 3] <= 1.01
