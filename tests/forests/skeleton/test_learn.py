"""Learned skeletons: what they gain on a forest with known faults, left for right, storage, what is not there."""

from dataclasses import replace

import numpy as np
import pytest

from forests.calibration import logistic
from forests.estimate import JointEstimate
from forests.frames import DepthFrame, FrameBatch, Intrinsics, LabelTable, is_known
from forests.skeleton import proposal
from forests.skeleton.answers import Answers, Truth, View, answers_of, cut_frame, edges_of
from forests.skeleton.decoded import LEAST_THOUGHT, decoded, decoded_facing, headings_of
from forests.skeleton.folds import answers_across
from forests.skeleton.heading import facings_of
from forests.skeleton.learn import decode_all, headings_of_all, is_outside, learn_proposals, settled
from forests.skeleton.proposal import mirrored, mirrored_answers
from forests.skeleton.storage import pack_skeleton, unpack_skeleton, without_skeleton
from storage.digested import Contents
from tests.forests.skeleton.test_decode import NAMES, bodies

CAMERA = Intrinsics(100.0, 100.0, 79.5, 59.5)
SHAPE = (120, 160)


def asked(rng, n):
    """Answers of a forest that misses a tenth of the joints by half a metre, whose second mode is then right."""
    joints = bodies(rng, n)
    proposals = np.repeat(joints[:, :, None], 3, axis=2) + rng.normal(0, 0.02, (n, len(NAMES), 3, 3))
    proposals[:, :, 1:] += rng.normal(0, 0.4, (n, len(NAMES), 2, 3))
    wrong = rng.random((n, len(NAMES))) < 0.1
    proposals[wrong, :2] = proposals[wrong, 1::-1]
    confidence = np.tile(np.float32([0.4, 0.35, 0.1]), (n, len(NAMES), 1))
    within = np.where(wrong, 0.5, 0.9)
    spread = np.full_like(within, 0.05)
    edges = np.tile(edges_of(SHAPE, CAMERA), (n, 1))
    hidden = rng.random((n, len(NAMES))) < 0.2
    facing = facings_of(joints, NAMES) * (rng.random(n) < 0.5)[:, None]
    told = (proposals, confidence, within, 0.1 + 0.8 * hidden, spread, edges, facing, rng.uniform(0.4, 1.0, n))
    return Answers(*(values.astype(np.float32) for values in told)), Truth(joints, hidden)


@pytest.fixture(scope="module")
def lessons():
    rng = np.random.default_rng(7)
    return [asked(rng, n) for n in (300, 100, 100)]


def learn_skeleton(bodies, training, validation):
    return settled(learn_proposals(NAMES, bodies, training, 0), validation, validation)


@pytest.fixture(scope="module")
def model(lessons):
    few = pytest.MonkeyPatch()
    few.setattr(proposal, "LEAST_STEPS", 0)
    few.setattr(proposal, "MOST_STEPS", 200)
    few.setattr(proposal, "N_HIDDEN", 32)
    training, validation, _ = lessons
    learned = learn_skeleton(training[1].joints, training, validation)
    again = learn_skeleton(training[1].joints, training, validation)
    few.undo()
    one, two = pack_skeleton(learned), pack_skeleton(again)
    assert all(np.array_equal(one[name], two[name], equal_nan=True) for name in one)
    return learned


def estimate_of(answers, k):
    return JointEstimate(
        answers.proposals[k],
        answers.confidence[k],
        answers.within[k],
        answers.hidden[k],
        answers.spread[k],
        CAMERA,
        heading=float(np.arctan2(*answers.facing[k, ::-1])) if answers.facing[k].any() else np.nan,
    )


def found(joints, truth):
    return (np.linalg.norm(joints - truth.joints, axis=2) < 0.1).mean()


def test_skeletons_find_more_than_first_modes(model, lessons):
    answers, truth = lessons[2]
    joints, *_ = decode_all(model, answers)
    assert found(joints, truth) > found(answers.proposals[:, :, 0], truth) + 0.02


def test_without_a_network_modes_are_chosen_by_limbs(lessons):
    training, validation, (answers, truth) = lessons
    model = learn_skeleton(training[1].joints, None, validation)
    joints, choice, *_ = decode_all(model, answers)
    assert found(joints, truth) > found(answers.proposals[:, :, 0], truth)
    assert (choice >= 0).all()


def test_a_mirrored_frame_gives_the_mirrored_skeleton(model, lessons):
    answers, _ = lessons[2]
    joints, choice, *_ = decode_all(model, answers)
    mirror = model.prior.mirror
    other, choice_there, *_ = decode_all(model, mirrored_answers(answers, mirror))
    np.testing.assert_allclose(mirrored(other, mirror), joints, atol=1e-5)
    assert (choice_there[:, mirror] == choice).all()


def test_headings_are_learned_and_those_of_mirrored_frames_are_mirrored(model, lessons):
    answers, truth = lessons[2]
    bare = answers._replace(facing=np.zeros_like(answers.facing))
    headings = headings_of_all(model, bare)
    true = np.arctan2(*facings_of(truth.joints, NAMES).T[::-1])
    apart = np.abs((headings - true + np.pi) % (2 * np.pi) - np.pi)
    assert np.median(apart) < np.radians(45)
    there = headings_of_all(model, mirrored_answers(bare, model.prior.mirror))
    np.testing.assert_allclose(np.cos(there + headings), 1.0, atol=1e-5)


def test_the_likeliest_heading_is_answered_and_the_second_kept_if_it_is_worth_it(model, lessons):
    answers, _ = lessons[2]
    n_alternatives = 0
    for k in range(40):
        asked = []

        def ask(heading, k=k, asked=asked):
            asked.append(heading)
            return replace(estimate_of(answers, k), heading=heading)

        given = decoded_facing(model, ask, SHAPE, 3)
        first, second = headings_of(model, replace(estimate_of(answers, k), heading=np.nan), SHAPE)
        assert np.isnan(asked[0])
        assert given.heading == asked[1] == first.angle
        assert given.heading_probability == first.probability >= second.probability
        assert (given.alternative is not None) == (second.probability >= LEAST_THOUGHT)
        if given.alternative is not None:
            n_alternatives += 1
            assert given.alternative.heading == second.angle
            assert abs(np.cos(first.angle - second.angle)) <= 1
    assert n_alternatives > 0


def test_probabilities_hold_for_whole_images_and_for_those_that_end_on_the_person(lessons):
    training, validation, (answers, truth) = lessons
    rng = np.random.default_rng(8)

    def cut(given, true):
        """The image ends at the hips; what a forest says of joints beyond, as surely as of others, is wrong."""
        edges = given.edges.copy()
        edges[:, 3] = np.median(true.joints[..., 1] / true.joints[..., 2], axis=1)
        beyond = is_outside(true.joints, edges)
        proposals = given.proposals.copy()
        proposals[beyond] += rng.normal(0.0, 0.5, proposals[beyond].shape).astype(np.float32)
        return given._replace(edges=edges, proposals=proposals), true

    bare = learn_proposals(NAMES, training[1].joints, None, 0)
    model = settled(bare, validation, cut(*validation))
    for given, true in ((answers, truth), cut(answers, truth)):
        joints, _, terms, *_ = decode_all(model, given)
        near = np.linalg.norm(joints - true.joints, axis=2) < 0.1
        came_true = (near, true.is_hidden, is_outside(true.joints, given.edges))
        for weights, outcome in zip(model.weights, came_true, strict=True):
            assert logistic(weights[None], terms).mean() == pytest.approx(outcome.mean(), abs=0.1)


def test_images_without_a_person_are_told_from_those_with_one(lessons):
    training, (answers, truth), (other, _) = lessons
    rng = np.random.default_rng(3)

    def deserted(given):
        share = rng.uniform(0.0, 0.5, len(given.body_share)).astype(np.float32)
        return given._replace(confidence=0.1 * given.confidence, within=0.3 * given.within, body_share=share)

    bare = learn_proposals(NAMES, training[1].joints, None, 0)
    model = settled(bare, (answers, truth), (answers, truth), (deserted(answers), truth))
    assert np.isnan(learn_skeleton(training[1].joints, None, (answers, truth)).person_weights).all()
    for given, is_person in ((other, True), (deserted(other), False)):
        said = [decoded(model, estimate_of(given, k), SHAPE, 1).person_probability > 0.5 for k in range(50)]
        assert np.mean(said) == pytest.approx(float(is_person), abs=0.1)


def test_of_many_frames_evenly_spread_ones_are_answered(monkeypatch):
    monkeypatch.setattr("forests.skeleton.folds.MOST_FRAMES", 150)
    rng = np.random.default_rng(5)
    joints = bodies(rng, 400)
    empty = np.zeros((400, 2, 3), np.uint16)
    labels = LabelTable(("head", "trunk"), ("table",), NAMES)
    frames = FrameBatch(empty, empty.astype(np.uint8), joints, CAMERA, labels)
    asked = []

    def train_apart(others, fold):
        def answering(own, view):
            assert not set(own.indices) & set(others.indices)
            asked.append(own.indices)
            nothing = np.zeros((len(own), len(NAMES), 1), np.float32)
            answers = Answers(*(nothing for _ in Answers._fields))
            return answers, Truth(nothing, nothing)

        return answering

    answers_across(frames, train_apart, False, 2)
    assert [len(numbers) for numbers in asked] == [67] * 8
    assert np.diff(asked[0]).max() == 3
    for whole, cut in zip(asked[::2], asked[1::2], strict=True):
        assert whole == cut


def test_forests_are_shown_frames_whole_cut_or_without_the_person():
    rng = np.random.default_rng(4)
    joints = bodies(rng, 1)[0]
    label = np.zeros(SHAPE, np.uint8)
    label[10:100, 40:120], label[60:100, 40:120] = 1, 3
    depth = np.where(label > 0, 3000, 0).astype(np.uint16)
    labels = LabelTable(("head", "trunk"), ("table",), NAMES)
    frames = FrameBatch(depth[None], label[None], joints[None], CAMERA, labels)
    seen = []

    def ask(frame, heading, _edges):
        seen.append((frame.depth, heading))
        n = len(NAMES)
        nothing = np.zeros((n, 1), np.float32)
        return JointEstimate(joints[:, None], nothing, nothing[:, 0], nothing[:, 0], nothing[:, 0], CAMERA)

    headings = np.float32([0.5])
    for view in (View(), View(is_cut=True), View(is_deserted=True), View(headings=headings)):
        answers, truth = answers_of(ask, frames, view)
        np.testing.assert_array_equal(truth.joints[0], joints)
        told = [[np.cos(0.5), np.sin(0.5)]] if view.headings is not None else [[0.0, 0.0]]
        np.testing.assert_allclose(answers.facing, told, atol=1e-6)
    whole, cut, deserted, told = seen
    np.testing.assert_array_equal(whole[0], depth)
    assert 0 < (cut[0] > 0).sum() < (depth > 0).sum()
    np.testing.assert_array_equal(deserted[0], depth * (label == 3))
    assert told[1] == 0.5
    assert np.isnan([each[1] for each in (whole, cut, deserted)]).all()


def test_every_limb_is_as_long_as_one_that_was_seen(model, lessons):
    joints, *_ = decode_all(model, lessons[2][0])
    prior = model.prior
    length = np.linalg.norm(joints - joints[:, prior.parent], axis=2)[:, prior.parent >= 0]
    low, high = prior.length_m[prior.parent >= 0].T
    assert ((length > low / 1.05) & (length < high * 1.05)).all()


def test_an_answer_is_the_skeleton_before_the_other_modes(model, lessons):
    answers, _ = lessons[2]
    joints, choice, *_ = decode_all(model, answers)
    for k in range(10):
        given = decoded(model, estimate_of(answers, k), SHAPE, 3)
        np.testing.assert_array_equal(given.joints, joints[k])
        assert given.proposals.shape == (len(NAMES), 3, 3)
        assert (np.diff(given.proposal_confidence, axis=1) <= 0).all()
        assert ((given.proposal_confidence > 0) == is_known(given.proposals)).all()
        np.testing.assert_allclose(given.confidence, given.probability, atol=2e-6)
        for values in (given.probability, given.hidden_probability, given.outside_probability):
            assert ((values >= 0) & (values <= 1)).all()
        first = choice[k] == 0
        np.testing.assert_array_equal(given.proposals[first, 1], answers.proposals[k, first, 1])


def test_what_nobody_voted_for_is_filled_in_and_an_empty_image_stays_empty(model, lessons):
    answers, truth = lessons[2]
    proposals, confidence = answers.proposals.copy(), answers.confidence.copy()
    proposals[:, 4], confidence[:, 4] = np.nan, 0.0
    joints, choice, terms, *_ = decode_all(model, answers._replace(proposals=proposals, confidence=confidence))
    assert np.isfinite(joints).all()
    assert np.isfinite(terms).all()
    assert (choice[:, 4] == -1).all()
    assert np.median(np.linalg.norm(joints - truth.joints, axis=2)[:, 4]) < 0.5
    nothing = answers._replace(proposals=np.full_like(proposals, np.nan), confidence=np.zeros_like(confidence))
    given = decoded(model, estimate_of(nothing, 0), SHAPE, 2)
    assert np.isnan(given.joints).all()
    assert (given.confidence == 0).all()


def test_a_model_file_keeps_it_and_can_do_without(model, lessons):
    arrays = pack_skeleton(model)
    loaded = unpack_skeleton(arrays, NAMES)
    answers, _ = lessons[2]
    for one, two in zip(decode_all(model, answers), decode_all(loaded, answers), strict=True):
        np.testing.assert_array_equal(one, two)
    assert unpack_skeleton({}, NAMES) is None
    bare = without_skeleton(Contents("oarf", arrays | {"kept": np.zeros(1)}, {}))
    assert list(bare.arrays) == ["kept"]


@pytest.mark.parametrize(
    ("name", "damage", "message"),
    [
        ("skeleton.deviation", np.zeros_like, "deviations"),
        ("skeleton.length_m", lambda values: values[:, ::-1].copy(), "ends before it begins"),
        ("skeleton.log_size", lambda values: values[:0], "sizes of people"),
        ("skeleton.network.w1", lambda values: np.full_like(values, np.nan), "not finite"),
        ("skeleton.network.w2", lambda values: values[:, :-1].copy(), "must be"),
        ("skeleton.rules", np.zeros_like, "reach"),
        ("skeleton.weights", lambda values: np.full_like(values, np.inf), "not finite"),
    ],
)
def test_damaged_arrays_are_refused(model, name, damage, message):
    arrays = pack_skeleton(model)
    arrays[name] = damage(arrays[name])
    with pytest.raises(ValueError, match=message):
        unpack_skeleton(arrays, NAMES)


def test_joints_beyond_the_edge_of_a_cut_image_are_outside():
    rng = np.random.default_rng(2)
    depth = np.full(SHAPE, 3000, np.uint16)
    for k in range(40):
        joints = bodies(rng, 1)[0]
        frame = DepthFrame(depth, depth > 0, depth, depth > 0, joints, np.zeros(len(NAMES), bool), CAMERA)
        whole = edges_of(SHAPE, CAMERA)
        cut, edges = cut_frame(frame, joints, whole, np.random.default_rng(k))
        u, v = (CAMERA.fx * joints[:, i] / joints[:, 2] + (CAMERA.cx, CAMERA.cy)[i] for i in (0, 1))
        row, column = np.round(v).astype(int), np.round(u).astype(int)
        inside = (row >= 0) & (row < SHAPE[0]) & (column >= 0) & (column < SHAPE[1])
        is_shown = inside.copy()
        is_shown[inside] = cut.depth[row[inside], column[inside]] > 0
        np.testing.assert_array_equal(is_outside(joints[None], edges[None])[0], ~is_shown)
        assert not is_outside(joints[None], whole[None])[0][inside].any()


def test_unknown_joints_are_not_learned_from(lessons):
    (answers, truth), validation, _ = lessons
    joints = truth.joints.copy()
    joints[:, 1] = np.nan
    model = learn_skeleton(joints, None, validation)
    assert model.prior.deviation[1] == np.inf
    lost = (validation[0], Truth(np.full_like(validation[1].joints, np.nan), validation[1].is_hidden))
    untold = learn_skeleton(truth.joints, None, lost)
    assert np.isnan(untold.weights).all()
    given = decoded(untold, estimate_of(answers, 0), SHAPE, 3)
    np.testing.assert_array_equal(given.probability, answers.within[0])
    assert np.isnan(given.outside_probability).all()
