"""A walk reads, decides and steps as its slow twin does; its end is known on toy scenes."""

import numpy as np
import pytest

from forests.crops import crop_image
from forests.features import probe
from forests.frames import Intrinsics
from forests.rwf.model import ExpertTree, walk_tables
from forests.rwf.walk import WalkPlan, WalkTables, read_depth, walk_joint, walk_skeleton
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE
from tests import reference_forests_rwf as reference

CAMERA = Intrinsics(100.0, 110.0, 47.5, 35.5)
INTRINSICS = np.array([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy], np.float32)
OPEN_GATE = (-np.inf, np.inf)


def plan_of(n_joints=1, step_m=0.05, gate=OPEN_GATE, n_walks=3, n_steps=12, parents=None, **changed) -> WalkPlan:
    values = {"decay": 1.0, "n_arriving": 0} | changed
    return WalkPlan(
        np.arange(n_joints, dtype=np.int32),
        np.array([-1] * n_joints if parents is None else parents, np.int32),
        np.full(n_joints, step_m, np.float32),
        np.full(n_joints, values["decay"], np.float32),
        np.full(n_joints, values["n_arriving"], np.int32),
        np.tile(np.float32(gate), (n_joints, 1)),
        n_walks,
        n_steps,
        4,
    )


def one_leaf(direction) -> ExpertTree:
    """A tree that always answers the same."""
    nodes = np.zeros(1, NODE_DTYPE)
    nodes["threshold"] = LEAF_THRESHOLD
    return ExpertTree(nodes, np.array([[direction]], np.float32), np.ones((1, 1), np.float32))


def random_tree(rng: np.random.Generator, levels=6, n_clusters=3) -> ExpertTree:
    """A full tree with random features, thresholds and directions."""
    n_inner = 2**levels - 1
    nodes = np.zeros(2 * n_inner + 1, NODE_DTYPE)
    nodes["left"] = 2 * np.arange(len(nodes)) + 1
    nodes["left"][n_inner:] = np.arange(n_inner, len(nodes))
    nodes["leaf"] = np.where(np.arange(len(nodes)) < n_inner, -1, np.arange(len(nodes)) - n_inner)
    nodes["threshold"] = np.where(nodes["leaf"] < 0, rng.integers(-300, 300, len(nodes)), LEAF_THRESHOLD)
    nodes["u"][:n_inner] = rng.uniform(-0.4, 0.4, (n_inner, 2))
    nodes["v"][:n_inner] = rng.uniform(-0.4, 0.4, (n_inner, 2)) * rng.integers(0, 2, (n_inner, 1))
    direction = rng.normal(size=(n_inner + 1, n_clusters, 3))
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    share = np.sort(rng.dirichlet(np.ones(n_clusters), n_inner + 1))[:, ::-1]
    return ExpertTree(nodes, direction.astype(np.float32), share.astype(np.float32))


def random_depth(rng: np.random.Generator) -> np.ndarray:
    """Blocks at various depths with holes between them."""
    coarse = rng.integers(1500, 2600, (9, 12)) * (rng.random((9, 12)) < 0.7)
    return np.kron(coarse, np.ones((8, 8))).astype(np.uint16)


def walked(depth, tables: WalkTables, plan: WalkPlan, start, joint=0, seed=5) -> tuple[np.ndarray, np.ndarray]:
    points = np.tile(np.float32(start), (plan.n_walks, 1))
    moments = np.empty(6)
    walk_joint(depth, INTRINSICS, tables, plan, joint, seed, points, moments)
    return points, moments


@pytest.mark.parametrize(("gate", "n_trees"), [(OPEN_GATE, 1), ((0.02, 0.3), 1), ((-0.1, 0.1), 3)])
def test_every_step_is_the_slow_twins(gate, n_trees):
    rng = np.random.default_rng(3)
    depth = random_depth(rng)
    tables = walk_tables((tuple(random_tree(rng) for _ in range(n_trees)),), 3)
    start = (0.1, -0.1, 2.0)
    plan = plan_of(gate=gate, n_steps=20, decay=0.9)
    paths = [reference.walk(depth, INTRINSICS, tables, plan, 0, 5, walk, start) for walk in range(plan.n_walks)]
    for n_steps in range(1, 21):
        points, moments = walked(depth, tables, plan._replace(n_steps=n_steps), start)
        np.testing.assert_array_equal(points, [path[n_steps] for path in paths])
        steps = np.stack([path[1 : n_steps + 1] for path in paths]).astype(np.float64)
        np.testing.assert_allclose(moments[:3], steps.mean(axis=(0, 1)), rtol=0, atol=1e-9)
        np.testing.assert_allclose(moments[3:], (steps**2).mean(axis=(0, 1)), rtol=0, atol=1e-9)
    assert len(np.unique(paths[0], axis=0)) > 10


def test_a_walk_in_one_direction_ends_where_its_steps_add_up():
    wall = np.full((72, 96), 2000, np.uint16)
    tables = walk_tables(((one_leaf((0.6, 0.0, 0.8)),),), 1)
    points, moments = walked(wall, tables, plan_of(n_steps=10, n_arriving=4), (0.0, 0.0, 2.0))
    np.testing.assert_allclose(points, np.tile([0.3, 0.0, 2.4], (3, 1)), atol=1e-5)
    mean_steps = np.arange(5, 11).mean()
    np.testing.assert_allclose(moments[:3], [0.03 * mean_steps, 0.0, 2.0 + 0.04 * mean_steps], atol=1e-5)


def test_the_gate_holds_points_behind_the_surface_and_lets_go_where_nothing_is():
    depth = np.zeros((72, 96), np.uint16)
    depth[:, :60] = 2000
    still, nearer = (walk_tables(((one_leaf((0.0, 0.0, z)),),), 1) for z in (0.0, -1.0))
    plan = plan_of(gate=(0.05, 0.3), n_steps=10)
    on_wall, _ = walked(depth, still, plan, (-0.1, 0.0, 2.6))
    np.testing.assert_allclose(on_wall, np.tile([-0.1 * 2.3 / 2.6, 0.0, 2.3], (3, 1)), atol=1e-5)
    on_wall, _ = walked(depth, nearer, plan, (-0.1, 0.0, 2.6))
    np.testing.assert_allclose(on_wall[:, 2], 2.05, atol=1e-5)
    off_wall, _ = walked(depth, nearer, plan, (0.8, 0.0, 2.6))
    np.testing.assert_allclose(off_wall[:, 2], 2.1, atol=1e-5)


def test_a_joint_starts_from_its_parents_estimate():
    wall = np.full((72, 96), 2000, np.uint16)
    right, down = one_leaf((1.0, 0.0, 0.0)), one_leaf((0.0, 1.0, 0.0))
    tables = walk_tables(((right,), (down,), (down,)), 1)
    plan = plan_of(3, n_steps=4, n_arriving=3, parents=[-1, 0, -1])
    joints, spread = np.empty((3, 3), np.float32), np.empty(3, np.float32)
    walk_skeleton(wall, INTRINSICS, tables, plan, np.float32([0, 0, 2]), 0, joints, spread)
    np.testing.assert_allclose(joints, [[0.2, 0, 2], [0.2, 0.2, 2], [0, 0.2, 2]], atol=1e-6)
    np.testing.assert_allclose(spread, 0.0, atol=1e-3)


def test_clusters_are_drawn_by_their_shares():
    wall = np.full((72, 96), 2000, np.uint16)
    nodes = one_leaf((0, 0, 0)).nodes
    direction = np.float32([[[1, 0, 0], [-1, 0, 0], [0, 1, 0]]])
    tree = ExpertTree(nodes, direction, np.float32([[0.75, 0.25, 0.0]]))
    points, _ = walked(
        wall, walk_tables(((tree,),), 3), plan_of(step_m=0.001, n_walks=50, n_steps=80), (0, 0, 2.0)
    )
    assert np.abs(points[:, 1]).max() == 0.0
    share_right = (points[:, 0].mean() / 0.08 + 1) / 2
    assert abs(share_right - 0.75) < 4 * np.sqrt(0.75 * 0.25 / 4000)
    only_first, _ = walked(wall, walk_tables(((tree,),), 1), plan_of(step_m=0.001, n_steps=80), (0, 0, 2.0))
    np.testing.assert_allclose(only_first[:, 0], 0.08, atol=1e-6)


def test_the_same_seed_walks_the_same_walk_and_another_seed_another():
    rng = np.random.default_rng(0)
    depth, tables = random_depth(rng), walk_tables(((random_tree(rng),),), 3)
    first, again = (walked(depth, tables, plan_of(), (0, 0, 2.0), seed=7)[0] for _ in range(2))
    other = walked(depth, tables, plan_of(), (0, 0, 2.0), seed=8)[0]
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    assert (first[0] != first[1]).any()


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
    tables = walk_tables(((random_tree(rng),),), 3)
    for depth in (np.zeros((72, 96), np.uint16), random_depth(rng), np.full((1, 1), 65535, np.uint16)):
        points, moments = walked(depth, tables, plan_of(gate=(0.0, 0.2)), start)
        assert np.isfinite(points).all()
        assert np.isfinite(moments).all()
        assert (points[:, 2] > 0).all()
