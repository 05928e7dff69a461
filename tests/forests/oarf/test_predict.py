"""Joints from votes: where geometry puts them, as a slow twin says, and what becomes of odd images."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from forests.crops import crop_image
from forests.frames import Intrinsics, LabelTable
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.descend import PACKED_NODE, descend, flatten
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.packed import LeafTable, pack_leaves
from forests.oarf.predict import Predictor
from forests.oarf.tune import untuned
from forests.oarf.vote import LEAST_AGREEMENT, cast, choose_voters, shortened, vote_table
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE
from tests.reference_forests_predict import leaf_of, point_of, votes_of

CAMERA = Intrinsics(120.0, 118.0, 39.5, 29.5)
LABELS = LabelTable(("head", "trunk"), ("table",), ("head", "torso", "hand"))
CLASSES = ClassTable.of(LABELS, "semantic")


def model_of(trees: list[ForestTree], **changes: object) -> OARFModel:
    return OARFModel(OARFConfig(n_trees=len(trees)), LABELS, CLASSES, tuple(trees), replace(untuned(3), **changes))


def random_tree(rng: np.random.Generator, depth: int = 5, n_leaf_votes: int = 2) -> ForestTree:
    """A full tree with random decisions and random leaves, a third of whose modes are missing."""
    n_inner, n_leaves = 2**depth - 1, 2**depth
    nodes = np.zeros(n_inner + n_leaves, NODE_DTYPE)
    nodes["u"], nodes["v"] = rng.uniform(-0.5, 0.5, (2, len(nodes), 2))
    nodes["v"][rng.random(len(nodes)) < 0.5] = 0.0
    nodes["threshold"] = rng.integers(-100, 100, len(nodes))
    nodes["left"] = 2 * np.arange(len(nodes)) + 1
    nodes["leaf"] = -1
    leaves = nodes[n_inner:]
    leaves["left"] = np.arange(n_inner, len(nodes))
    leaves["leaf"] = rng.permutation(n_leaves)
    leaves["threshold"], leaves["u"], leaves["v"] = LEAF_THRESHOLD, 0.0, 0.0
    shape = n_leaves, 2, 3, n_leaf_votes
    weight = rng.uniform(0.05, 0.5, shape) * (rng.random(shape) < 0.67)
    vote = rng.normal(0.0, 0.2, (*shape, 3))
    probability = rng.dirichlet(np.ones(3), n_leaves)
    return ForestTree(nodes, pack_leaves(LeafTable(*(a.astype(np.float32) for a in (probability, vote, weight)))))


def one_leaf(offsets: np.ndarray, weight: float = 0.5, layer: int = 0) -> ForestTree:
    """A tree that says the same everywhere: one mode a joint, (3, 3) offsets [m]."""
    nodes = np.zeros(1, NODE_DTYPE)
    nodes["threshold"] = LEAF_THRESHOLD
    vote, weights = np.zeros((1, 2, 3, 1, 3), np.float32), np.zeros((1, 2, 3, 1), np.float32)
    vote[0, layer, :, 0], weights[0, layer] = offsets, weight
    return ForestTree(nodes, pack_leaves(LeafTable(np.array([[0.2, 0.3, 0.5]], np.float32), vote, weights)))


def person(rng: np.random.Generator) -> np.ndarray:
    """(60, 80) uint16: a bumpy person, 2 m away, of 20 x 44 pixels."""
    depth = np.zeros((60, 80), np.uint16)
    depth[8:52, 30:50] = 2000 + rng.integers(0, 80, (44, 20))
    depth[20:24, 36:40] = 0
    return depth


def single_pixel(column: int, row: int, z_mm: int) -> np.ndarray:
    depth = np.zeros((60, 80), np.uint16)
    depth[row, column] = z_mm
    return depth


OFFSETS = np.array([[0.0, -0.3, 0.1], [0.02, 0.1, 0.05], [0.3, 0.2, -0.1]])


def test_one_pixel_votes_for_its_point_plus_the_offset():
    estimate = Predictor(model_of([one_leaf(OFFSETS)])).predict(single_pixel(70, 5, 3100), CAMERA)
    q = np.array([(70 - 39.5) * 3.1 / 120.0, (5 - 29.5) * 3.1 / 118.0, 3.1])
    assert np.allclose(estimate.joints, q + OFFSETS, atol=1e-4)
    assert np.allclose(estimate.confidence, 0.5 * 3.1**2 / (120.0 * 118.0), rtol=1e-3)  # the pixel's area times w
    assert np.isnan(estimate.proposals[:, 1:]).all()
    assert (estimate.proposal_confidence[:, 1:] == 0).all()
    assert np.allclose(estimate.spread, 0.0, atol=1e-3)


def test_votes_weigh_with_the_squared_depth():
    depth = single_pixel(10, 10, 1000)
    depth[40, 60] = 3000
    votes, n_votes = Predictor(model_of([one_leaf(OFFSETS)])).collect_votes(depth, CAMERA)
    assert n_votes.tolist() == [1 + 1, 0] * 3
    assert np.allclose(votes[0, :2, 3], [0.5 * 1.0, 0.5 * 9.0], rtol=1e-4)


def test_collected_votes_are_the_twins():
    rng = np.random.default_rng(0)
    model = model_of([random_tree(rng), random_tree(rng)], max_offset_m=np.array([0.2, 0.4, np.inf], np.float32))
    depth = person(rng)
    predictor = Predictor(model)
    votes, n_votes = predictor.collect_votes(depth, CAMERA, n_pixels=depth.size)
    rows, columns = np.nonzero(depth)
    expected = votes_of(model, depth, CAMERA, list(zip(columns, rows, strict=True)))
    for joint in range(3):
        for layer in range(2):
            stream = 2 * joint + layer
            ours = votes[stream, : n_votes[stream]]
            twins = np.array([(*place, weight) for place, weight, of in expected[joint] if of == layer])
            assert ours.shape == twins.shape
            in_order = [a[np.lexsort(np.round(a[:, 2::-1], 2).T)] for a in (ours, twins)]
            assert np.allclose(np.sort(ours, axis=0), np.sort(twins, axis=0), atol=1.1e-3)
            assert np.isclose(in_order[0][:, 3].sum(), in_order[1][:, 3].sum(), rtol=1e-3)


def test_votes_of_people_who_face_another_way_weigh_less():
    rng = np.random.default_rng(3)
    tree, depth = random_tree(rng), person(rng)
    table = tree.leaves.unpacked()
    facing = rng.uniform(-0.7, 0.7, (*table.weight.shape, 2)).astype(np.float32)
    told = model_of([tree._replace(leaves=pack_leaves(table._replace(facing=facing)))])
    predictor, plain = Predictor(told), Predictor(model_of([tree]))
    assert predictor.reads_headings
    assert not plain.reads_headings
    leaves, points = predictor.reach_leaves(depth, CAMERA)
    toward = np.float32([np.cos(2.0), np.sin(2.0)])
    votes, count = cast(predictor.table, leaves, points, toward)
    bare, same_count = cast(predictor.table, leaves, points)
    assert (count == same_count).all()
    kept = told.trees[0].leaves.unpacked()
    seen = 0
    for joint, layer in itertools.product(range(3), range(2)):
        rows = []
        for leaf in leaves[0]:
            for k in range(2):
                if kept.weight[leaf, layer, joint, k] > 0:
                    rows.append(max(1.0 + 2.0 * kept.facing[leaf, layer, joint, k] @ toward, LEAST_AGREEMENT))
        stream = 2 * joint + layer
        ratio = votes[stream, : count[stream], 3] / bare[stream, : count[stream], 3]
        assert np.allclose(ratio, rows, rtol=1e-3)
        assert np.array_equal(votes[stream, : count[stream], :3], bare[stream, : count[stream], :3])
        seen += len(rows)
    assert seen > 500
    for heading in (np.nan, 2.0):
        one = plain.predict_joints(depth, CAMERA, heading=heading)
        assert np.array_equal(one.proposals, plain.predict(depth, CAMERA).proposals, equal_nan=True)


def test_the_lockstep_descent_is_the_single_descent():
    rng = np.random.default_rng(1)
    trees = [random_tree(rng, depth=level) for level in (7, 1, 0)]
    depth = person(rng)
    crop = crop_image(depth, CAMERA)
    rows, columns = np.nonzero(depth)
    flat = flatten([tree.nodes for tree in trees], [tree.leaves.n_leaves for tree in trees])
    leaves = np.empty((3, len(rows)), np.int32)
    in_crop = [(a - o).astype(np.int32) for a, o in ((columns, crop.origin[0, 0]), (rows, crop.origin[0, 1]))]
    focal = np.float32(CAMERA.fx), np.float32(CAMERA.fy)
    descend(crop.pixels, crop.width[0], crop.height[0], *in_crop, *focal, flat.nodes, flat.roots, leaves)
    for number, tree in enumerate(trees):
        expected = [leaf_of(tree, depth, CAMERA, u, v) for u, v in zip(columns, rows, strict=True)]
        assert np.array_equal(leaves[number] - flat.leaf_start[number], expected)
    assert len(np.unique(leaves[0])) > 10


def test_a_packed_node_is_half_a_cache_line():
    assert PACKED_NODE.itemsize == 32


def test_the_share_of_occluder_votes_is_given():
    """Two trees say the same, one from its occluder modes with a third of the weight of the other's."""
    trees = [one_leaf(OFFSETS, 0.6), one_leaf(OFFSETS, 0.2, layer=1)]
    _, evidence = Predictor(model_of(trees)).examine(single_pixel(40, 30, 2000), CAMERA)
    assert np.allclose(evidence.occluder_share, 0.25, atol=1e-3)


def test_modes_longer_than_lambda_do_not_vote():
    lengths = np.linalg.norm(OFFSETS, axis=1)
    limits = np.array([lengths[0] - 0.01, lengths[1] + 0.01, np.inf], np.float32)
    predictor = Predictor(model_of([one_leaf(OFFSETS)], max_offset_m=limits))
    estimate = predictor.predict(single_pixel(40, 30, 2000), CAMERA)
    assert np.isnan(estimate.joints).any(axis=1).tolist() == [True, False, False]
    assert estimate.confidence[0] == 0


def test_shortening_a_table_is_packing_it_with_one_lambda():
    leaves = [random_tree(np.random.default_rng(k)).leaves for k in range(2)]
    table = shortened(vote_table(leaves, np.full(3, np.inf, np.float32)), 0.3)
    packed = vote_table(leaves, np.full(3, 0.3, np.float32))
    assert 0 < len(packed.entries) == len(table.entries)
    assert np.array_equal(table.entries, packed.entries)
    assert np.array_equal(table.start, packed.start)


def test_a_person_twice_as_far_is_found_twice_as_far():
    """Moved along the rays: the same pixels at twice the depth; there is one leaf without an offset."""
    rng = np.random.default_rng(2)
    depth = person(rng)
    predictor = Predictor(model_of([one_leaf(np.zeros((3, 3)))]))
    box = (38, 30, 42, 34)
    near, far = predictor.predict(depth, CAMERA, box), predictor.predict(depth * 2, CAMERA, box)
    assert np.allclose(far.joints[:, 2] / near.joints[:, 2], 2.0, atol=0.02)
    assert np.allclose(far.joints_2d, near.joints_2d, atol=0.3)


def test_a_person_moved_in_the_image_votes_alike():
    """By whole pixels: the same decisions, points moved by what a pixel is at their depth."""
    rng = np.random.default_rng(3)
    depth = person(rng)
    predictor = Predictor(model_of([random_tree(rng), random_tree(rng)]))
    moved = np.roll(depth, 12, axis=1)
    camera = Intrinsics(CAMERA.fx, CAMERA.fy, CAMERA.cx + 12, CAMERA.cy)
    here, there = predictor.predict(depth, CAMERA), predictor.predict(moved, camera)
    assert np.allclose(here.joints, there.joints, atol=1e-5, equal_nan=True)


def test_voters_are_spread_evenly_over_the_foreground():
    depth = person(np.random.default_rng(4))
    crop = crop_image(depth, CAMERA)
    width, height = crop.width[0], crop.height[0]
    n_foreground = np.count_nonzero(depth)
    for wanted in (1, 10, 100, 500, n_foreground, 10 * n_foreground):
        columns, rows, stands_for = choose_voters(crop.pixels, width, 1, 1, width - 1, height - 1, wanted)
        n = min(wanted, n_foreground)
        assert len(columns) == len(set(zip(columns, rows, strict=True))) == n
        assert stands_for == n_foreground / n
        assert depth[rows + crop.origin[0, 1], columns + crop.origin[0, 0]].all()
        if n >= 100:
            upper = (rows + crop.origin[0, 1] < 30).mean()
            assert abs(upper - np.count_nonzero(depth[:30]) / n_foreground) < 0.08


def test_a_line_between_the_rows_votes():
    depth = np.zeros((60, 80), np.uint16)
    depth[31, :] = 2000
    for wanted in (1, 3, 20):
        _, n_votes = Predictor(model_of([one_leaf(OFFSETS)])).collect_votes(depth, CAMERA, n_pixels=wanted)
        assert n_votes[0] == wanted


def test_only_pixels_in_the_box_vote():
    depth = single_pixel(10, 10, 2000)
    depth[40, 60] = 3000
    predictor = Predictor(model_of([one_leaf(np.zeros((3, 3)))]))
    found = predictor.predict(depth, CAMERA, box=(50, 30, 200, 45))
    assert np.allclose(found.joints, point_of(depth, CAMERA, 60, 40), atol=1e-3)
    assert np.allclose(found.proposal_confidence[:, 1:], 0)


@pytest.mark.parametrize("box", [(500, 0, 600, 50), (-50, -50, -10, -10), (0, 55, 5, 60)])
def test_a_box_beside_everything_gives_no_joints(box):
    estimate = Predictor(model_of([one_leaf(OFFSETS)])).predict(person(np.random.default_rng(0)), CAMERA, box=box)
    assert np.isnan(estimate.proposals).all()
    assert (estimate.proposal_confidence == 0).all()


def test_an_empty_image_gives_no_joints_and_no_labels():
    predictor = Predictor(model_of([random_tree(np.random.default_rng(0))]))
    depth = np.zeros((60, 80), np.uint16)
    estimate = predictor.predict(depth, CAMERA)
    assert np.isnan(estimate.proposals).all()
    assert (estimate.confidence == 0).all()
    assert np.isnan(estimate.joints_2d).all()
    assert not predictor.label_pixels(depth, CAMERA).any()


def test_a_person_at_the_border_is_looked_at_like_any_other():
    depth = np.full((60, 80), 1500, np.uint16)
    predictor = Predictor(model_of([random_tree(np.random.default_rng(0))]))
    assert np.isfinite(predictor.predict(depth, CAMERA).joints).all()
    assert predictor.label_pixels(depth, CAMERA).all()


def test_integers_of_any_width_are_depth_and_metres_are_not():
    depth = person(np.random.default_rng(0))
    predictor = Predictor(model_of([one_leaf(OFFSETS)]))
    wide, narrow = predictor.predict(depth.astype(np.int64), CAMERA), predictor.predict(depth, CAMERA)
    assert np.array_equal(wide.joints, narrow.joints)
    with pytest.raises(ValueError, match="must be integer millimetres"):
        predictor.predict(depth / 1000.0, CAMERA)
    with pytest.raises(ValueError, match=r"must be \(height, width\)"):
        predictor.label_pixels(depth[None], CAMERA)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"box": (30, 10, 30, 50)}, r"box \(30, 10, 30, 50\) is empty"),
        ({"n_pixels": 0}, "n_pixels=0 must be at least 1"),
        ({"n_proposals": 0}, "n_proposals=0 must be at least 1"),
    ],
)
def test_senseless_arguments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Predictor(model_of([one_leaf(OFFSETS)])).predict(single_pixel(0, 0, 2000), CAMERA, **arguments)


def test_a_damaged_forest_is_refused():
    tree = random_tree(np.random.default_rng(0))
    endless = tree.nodes.copy()
    endless["left"][3] = 0
    with pytest.raises(ValueError, match="children do not follow"):
        Predictor(model_of([ForestTree(endless, tree.leaves)]))
    far = tree.leaves._replace(vote=np.full_like(tree.leaves.vote, 32500))
    lacking = tree.leaves._replace(vote=tree.leaves.vote[:-1], weight=tree.leaves.weight[:-1])
    for leaves, message in ((far, "within 32000 mm"), (lacking, "has_vote has")):
        with pytest.raises(ValueError, match=message):
            Predictor(model_of([ForestTree(tree.nodes, leaves)]))
    with pytest.raises(ValueError, match="at least one tree"):
        flatten([], [])


def test_labels_are_the_likeliest_classes_of_the_mean_of_the_trees():
    rng = np.random.default_rng(6)
    trees = [random_tree(rng), random_tree(rng)]
    depth = person(rng)
    predictor = Predictor(model_of(trees))
    probability, labels = predictor.class_probabilities(depth, CAMERA), predictor.label_pixels(depth, CAMERA)
    assert np.array_equal(labels > 0, depth > 0)
    assert not probability[depth == 0].any()
    for row, column in ((8, 30), (20, 41), (51, 49)):
        leaves = [leaf_of(tree, depth, CAMERA, column, row) for tree in trees]
        mean = np.mean(
            [tree.leaves.probabilities()[leaf] for tree, leaf in zip(trees, leaves, strict=True)], axis=0
        )
        assert np.allclose(probability[row, column], mean, atol=1e-6)
        assert labels[row, column] == mean.argmax() + 1


def test_what_lies_at_a_joints_pixel_is_seen():
    """The torso's place is 0.4 m behind a surface, the head's beside the person, the hand's outside the image."""
    depth = person(np.random.default_rng(0))
    q = point_of(depth, CAMERA, 45, 40)
    box = (45, 40, 46, 41)
    offsets = np.array([[0.2, 0.0, 0.0], [0.0, 0.0, 0.4], [5.0, 0.0, 0.0]])
    _, evidence = Predictor(model_of([one_leaf(offsets)])).examine(depth, CAMERA, box)
    place = q + offsets[1]
    u, v = (round(f * c / place[2] + o) for f, c, o in ((120.0, place[0], 39.5), (118.0, place[1], 29.5)))
    assert np.allclose(evidence.behind[1], place[2] - depth[v, u] * 1e-3, atol=1e-3)
    assert np.allclose(evidence.occluder_probability[1], 0.5, atol=1e-4)
    assert np.isnan(evidence.behind[[0, 2]]).all()


def test_the_same_image_gives_the_same_bytes():
    rng = np.random.default_rng(7)
    model, depth = model_of([random_tree(rng) for _ in range(3)]), person(rng)
    one, two = (Predictor(model).predict(depth, CAMERA, n_pixels=300) for _ in range(2))
    for name in ("proposals", "proposal_confidence", "spread"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes()
    assert np.isnan(one.probability).all()  # not calibrated


def test_votes_of_a_joint_are_those_that_its_modes_come_from():
    rng = np.random.default_rng(3)
    predictor = Predictor(model_of([random_tree(rng), random_tree(rng)]))
    depth = person(rng)
    votes, n_votes = predictor.collect_votes(depth, CAMERA)
    estimate = predictor.predict_joints(depth, CAMERA)
    for joint in range(3):
        told = predictor.joint_votes(joint, depth, CAMERA)
        for layer in range(2):
            stream = 2 * joint + layer
            np.testing.assert_array_equal(
                told.points[told.is_hider == layer], votes[stream, : n_votes[stream], :3]
            )
            np.testing.assert_array_equal(told.weight[told.is_hider == layer], votes[stream, : n_votes[stream], 3])
        n = len(told.modes)
        assert n > 0
        np.testing.assert_array_equal(told.modes, estimate.proposals[joint, :n])
        np.testing.assert_array_equal(told.share, estimate.proposal_confidence[joint, :n])


def test_nothing_votes_in_an_empty_image():
    told = Predictor(model_of([one_leaf(OFFSETS)])).joint_votes(0, np.zeros((60, 80), np.uint16), CAMERA)
    assert len(told.points) == len(told.weight) == len(told.is_hider) == len(told.modes) == 0
