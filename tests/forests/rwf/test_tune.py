"""What is chosen on validation frames: starts, scatter, bandwidths, and the probabilities."""

from dataclasses import replace

import numpy as np
import pytest

from forests.frames import Intrinsics, LabelTable
from forests.rwf.config import RWFConfig
from forests.rwf.evidence import OUTCOMES, TERMS, terms_of
from forests.rwf.model import ExpertTree, Limbs, RWFModel, WalkPlan
from forests.rwf.predict import Predictor, rank
from forests.rwf.tables import pack_experts
from forests.rwf.tune import View, calibrated, choose_walks
from forests.skeleton.answers import edges_of
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE

CAMERA = Intrinsics(100.0, 100.0, 47.5, 35.5)
EDGES = edges_of((72, 96), CAMERA)
NOT_CALIBRATED = np.full((len(OUTCOMES), 2, len(TERMS)), np.nan, np.float32)


def model_that_knows_offsets(*offsets):
    """Two joints, the second behind the first; each has one leaf."""
    nodes = np.zeros(1, NODE_DTYPE)
    nodes["threshold"] = LEAF_THRESHOLD
    one = np.ones((1, 1), np.float32)
    experts = tuple((ExpertTree(nodes, np.float32([[offset]]), one, 0 * one),) for offset in offsets)
    gate = np.tile(np.float32([0, np.inf]), (2, 1, 1))
    config = RWFConfig(joints=("neck", "head"), n_trees=1, n_clusters=1, n_steps=1, n_arriving=0, n_walks=16)
    narrow, wide = np.full(2, config.scatter_m, np.float32), np.full(2, config.bandwidth_m, np.float32)
    parents = np.int32([-1, 0])
    plan = WalkPlan(np.int32([0, 1]), parents, narrow, wide, np.zeros(2, np.int32), gate, np.int32([16, 16]), 1)
    labels = LabelTable(("body",), (), ("neck", "head"))
    limbs = Limbs(parents, np.float32([[0, np.inf], [0, np.inf]]))
    return RWFModel(config, labels, ("neck", "head"), pack_experts(experts), plan, limbs, NOT_CALIBRATED)


def view_of(*joints, is_occluded=(False, False)):
    empty, intrinsics = np.zeros((72, 96), np.uint16), np.float32([100, 100, 47.5, 35.5])
    return View(empty, intrinsics, np.float32([0, 0, 2]), np.float32(joints), CAMERA, np.array(is_occluded), EDGES)


@pytest.mark.parametrize(("head", "start_from"), [((0.3, 0.2, 2.0), 0), ((0.0, 0.2, 2.0), -1)])
def test_tuning_starts_a_joint_from_where_it_is_found(head, start_from):
    model = model_that_knows_offsets((0.3, 0, 0), (0, 0.2, 0))
    tuned = choose_walks(model, [view_of((0.3, 0, 2), head)] * 10)
    assert tuned.plan.start_from.tolist() == [-1, start_from]
    assert model.plan.start_from.tolist() == [-1, 0]
    assert choose_walks(model, []) is model


def test_a_joint_that_is_always_found_is_probable_and_one_never_found_is_not():
    model = model_that_knows_offsets((0.3, 0, 0), (0, 0.2, 0))
    views = [view_of((0.3, 0, 2), (5, 5, 5), is_occluded=(True, False))] * 30
    tuned = calibrated(model, views)
    estimate = Predictor(tuned).predict(views[0].depth + np.uint16(1), CAMERA, start=views[0].start)
    assert estimate.probability[0] > 0.9 > 0.1 > estimate.probability[1]
    assert estimate.hidden_probability[0] > 0.9 > 0.1 > estimate.hidden_probability[1]


def test_frames_that_do_not_know_a_joint_leave_it_without_probability():
    nowhere = (np.nan, np.nan, np.nan)
    views = [view_of((0.3, 0, 2), nowhere)] * 5
    tuned = calibrated(choose_walks(model_that_knows_offsets((0.3, 0, 0), (0, 0.2, 0)), views), views)
    assert np.isfinite(tuned.weights[:, 0]).all()
    assert np.isnan(tuned.weights[:, 1]).all()
    assert tuned.plan.scatter_m[1] == np.float32(tuned.config.scatter_m)


def test_a_joint_is_outside_where_it_was_outside_the_validation_images():
    model = model_that_knows_offsets((0.3, 0, 0), (0, 0.2, 0))
    inside, outside = view_of((0.3, 0, 2), (0.3, 0.2, 2)), view_of((0.3, 0, 2), (0.3, 5, 2))
    start = np.float32([0, 0, 2])
    for views, expected in (([inside], [0, 0]), ([outside], [0, 1]), ([inside, *[outside] * 5], [0, 1])):
        tuned = calibrated(model, views * 20)
        said = Predictor(tuned).predict(inside.depth + np.uint16(1), CAMERA, start=start).outside_probability
        np.testing.assert_array_equal(said > 0.5, expected)


def test_terms_tell_how_far_behind_the_surface_and_inside_the_image_a_joint_lies():
    depth = np.zeros((72, 96), np.uint16)
    depth[:, :48] = 2000
    places = [(-0.2, 0, 2.1), (-0.2, 0, 9.0), (0.4, 0, 2.1), (-50, 0, 2.1), (0, 0, 0)]
    ends = np.float32([[(*place, 0.5), (0, 0, 1, 0.25)] for place in places])
    said = np.tile(np.float32([0.05, 1.0, 0.25]), (5, 1))
    intrinsics = np.float32([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy])
    values = terms_of(ends, said, np.int32([-1, 0, 0, 2, 3]), depth, intrinsics, EDGES)
    assert values.shape == (5, len(TERMS))
    np.testing.assert_allclose(values[:, 0], 1)
    np.testing.assert_allclose(values[:, 1], np.log(0.5))
    np.testing.assert_allclose(values[:, 2], 0.5)
    np.testing.assert_allclose(values[:3, TERMS.index("behind")], [0.1, 0.5, 0], atol=1e-6)
    np.testing.assert_allclose(values[:4, TERMS.index("no_surface")], [0, 0, 1, 1])
    np.testing.assert_allclose(values[:4, TERMS.index("inside")], [0.5, 0.5, 0.5, -0.5])
    np.testing.assert_allclose(values[:, TERMS.index("parent_inside")], [0.5, 0.5, 0.5, 0.5, -0.5])
    near = np.float32([[(0.0, 0.1, 0.5, 1.0)]])
    near = terms_of(near, said[:1], np.int32([-1]), depth, intrinsics, EDGES)
    np.testing.assert_allclose(near[0, TERMS.index("inside")], 0.5 * EDGES[3] - 0.1, atol=1e-6)
    assert np.isfinite(values).all()


def test_confidences_are_probabilities_and_fall():
    rng = np.random.default_rng(0)
    share = -np.sort(-rng.uniform(0, 0.6, (50, 4)).astype(np.float32))
    share[:10, 2:] = 0
    within = rng.uniform(0, 1, 50).astype(np.float32)
    confidence, untold = np.empty_like(share), np.empty_like(share)
    for own, chance, out, plain in zip(share, within, confidence, untold, strict=True):
        rank(own, chance, out)
        rank(own, np.nan, plain)
    np.testing.assert_array_equal(confidence[:, 0], within)
    assert (np.diff(confidence, axis=1) <= 0).all()
    assert (confidence.sum(axis=1) <= 1 + 1e-6).all()
    assert ((confidence == 0) == (share == 0)).all()
    np.testing.assert_array_equal(untold, share)


@pytest.mark.parametrize("name", ["scatter_m", "bandwidth_m"])
def test_the_settings_of_the_config_are_tried_too(name):
    model = model_that_knows_offsets((0.3, 0, 0), (0, 0.2, 0))
    odd = replace(model, config=replace(model.config, **{name: 0.031}))
    view = view_of((0.3, 0, 2), (0.3, 0.2, 2))
    assert choose_walks(odd, [view]).plan.start_from.tolist() == [-1, 0]
