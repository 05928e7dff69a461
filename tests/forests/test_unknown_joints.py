"""Frames that lack joints: what is not told is not learned, and all else is learned as if it were."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from forests.boxes import upper_body_box
from forests.crops import Crops
from forests.frames import FrameBatch
from forests.growing import GrownTree
from forests.oarf.config import OARFConfig
from forests.oarf.forest import OcclusionAwareForest
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model, save_model
from forests.oarf.train import train
from forests.oarf.tune import DEFAULT_BANDWIDTH_M, tune
from forests.rwf.points import draw_way_points, farthest_behind
from forests.rwf.predict import Predictor as Walker
from forests.rwf.skeleton import measure_limbs, starts_of
from forests.rwf.storage import load_model as load_walks
from forests.rwf.storage import pack_model as pack_walks
from forests.rwf.storage import save_model as save_walks
from forests.rwf.train import train as train_rwf
from forests.samples import TrainingSet
from tests.forests.oarf import test_forest as regression
from tests.forests.oarf import test_leaves as leaves
from tests.forests.rwf import test_forest as walks

FOOT = 2
"""The last of three joints in both toy worlds."""


def without(frames: FrameBatch, joint: int, lacking: np.ndarray | slice = slice(None)) -> FrameBatch:
    """The frames, some of which do not know a joint."""
    joints = frames.joints.copy()
    joints[lacking, joint] = np.nan
    return replace(frames, joints=joints)


# Leaves


def unknown_in(training: TrainingSet, joint: int, frames: np.ndarray) -> TrainingSet:
    joints = training.joints.copy()
    joints[frames, joint] = np.nan
    return training._replace(joints=joints)


def only_frames(
    training: TrainingSet, classes: np.ndarray, grown: GrownTree, frames: np.ndarray
) -> tuple[TrainingSet, np.ndarray, GrownTree]:
    """The same leaves without the samples of other frames."""
    is_kept = np.isin(training.samples.frame, frames)
    number = np.cumsum(is_kept) - 1
    members = [grown.order[a:b] for a, b in itertools.pairwise(grown.leaf_start)]
    members = [number[own[is_kept[own]]].astype(np.int32) for own in members]
    leaf_start = np.concatenate([[0], np.cumsum([len(own) for own in members])]).astype(np.int64)
    samples = type(training.samples)(*(column[is_kept] for column in training.samples))
    grown = GrownTree(grown.nodes, leaf_start, np.concatenate(members))
    return training._replace(samples=samples), classes[is_kept], grown


def test_a_joint_that_no_frame_knows_gets_no_modes_and_the_others_keep_theirs():
    training, classes, grown = leaves.world()
    full = leaves.table_of(training, classes, grown)
    table = leaves.table_of(unknown_in(training, 1, np.arange(leaves.N_FRAMES)), classes, grown)
    assert not table.weight[:, :, 1].any()
    assert not table.vote[:, :, 1].any()
    assert table.probability.tobytes() == full.probability.tobytes()
    for mine, theirs in ((table.vote, full.vote), (table.weight, full.weight)):
        assert np.delete(mine, 1, axis=2).tobytes() == np.delete(theirs, 1, axis=2).tobytes()


@pytest.mark.parametrize("n_drawn", [400, 20])
def test_a_leaf_says_of_a_joint_what_it_would_say_without_the_frames_that_lack_it(n_drawn):
    """To the byte: modes, and weights, which are shares of the samples that know the joint."""
    training, classes, grown = leaves.world()
    lacking = np.arange(0, leaves.N_FRAMES, 3)
    table = leaves.table_of(unknown_in(training, 1, lacking), classes, grown, n_drawn=n_drawn)
    knowing = np.setdiff1d(np.arange(leaves.N_FRAMES), lacking)
    alone = leaves.table_of(*only_frames(training, classes, grown, knowing), n_drawn=n_drawn)
    full = leaves.table_of(training, classes, grown, n_drawn=n_drawn)
    for name in ("vote", "weight"):
        mine, theirs = getattr(table, name), getattr(alone, name)
        assert mine[:, :, 1].tobytes() == theirs[:, :, 1].tobytes()
        assert np.delete(mine, 1, axis=2).tobytes() == np.delete(getattr(full, name), 1, axis=2).tobytes()
    assert not np.array_equal(table.weight[:, :, 1], full.weight[:, :, 1])


def test_weights_of_a_joint_add_up_to_one_over_both_layers():
    training, classes, grown = leaves.world((300, 90, 700))
    training = unknown_in(training, 1, np.arange(10))
    table = leaves.table_of(training, classes, grown, n_leaf_votes=60)
    assert table.weight.sum(axis=(1, 3)) == pytest.approx(1.0, abs=1e-5)


# Regression forests


@pytest.fixture(scope="module")
def forests():
    """Trained on all joints, and on frames of which none tells the foot."""
    held_out = regression.people(30, 2)
    full = train(regression.TRAINING, regression.CONFIG, validation=held_out)
    partial = train(without(regression.TRAINING, FOOT), regression.CONFIG, validation=without(held_out, FOOT))
    return full, partial


def test_a_regression_forest_without_a_joint_is_the_full_one_in_all_others(forests):
    full, partial = forests
    for mine, theirs in zip(partial.trees, full.trees, strict=True):
        assert mine.nodes.tobytes() == theirs.nodes.tobytes()
        shares, *learned = mine.leaves.unpacked()[:3]
        other_shares, *whole = theirs.leaves.unpacked()[:3]
        assert shares.tobytes() == other_shares.tobytes()
        for of_mine, of_theirs in zip(learned, whole, strict=True):
            assert of_mine[:, :, :FOOT].tobytes() == of_theirs[:, :, :FOOT].tobytes()
    for name, values in vars(partial.tuning).items():
        assert values[:FOOT].tobytes() == getattr(full.tuning, name)[:FOOT].tobytes()
    frame = regression.TEST[0]
    answer, whole = (Predictor(model).predict(frame.depth, frame.camera) for model in (partial, full))
    assert answer.proposals[:FOOT].tobytes() == whole.proposals[:FOOT].tobytes()
    assert answer.probability[:FOOT].tobytes() == whole.probability[:FOOT].tobytes()


def test_an_unlearned_joint_is_nan_without_confidence_also_out_of_a_file(forests, tmp_path):
    save_model(tmp_path / "model", forests[1])
    for model in (forests[1], load_model(tmp_path / "model")):
        frame = regression.TEST[0]
        answer = Predictor(model).predict(frame.depth, frame.camera)
        assert np.isnan(answer.proposals[FOOT]).all()
        assert not answer.proposal_confidence[FOOT].any()
        assert np.isnan([answer.probability[FOOT], answer.hidden_probability[FOOT]]).all()
        assert np.isfinite(answer.proposals[:FOOT, 0]).all()


def test_a_joint_that_two_frames_of_three_lack_is_found_as_confidently():
    lacking = np.arange(len(regression.TRAINING)) % 3 > 0
    forest = OcclusionAwareForest(regression.CONFIG).fit(without(regression.TRAINING, FOOT, lacking))
    full = OcclusionAwareForest(regression.CONFIG).fit(regression.TRAINING)
    assert (regression.errors_of(forest, regression.TEST)[:, FOOT] < 0.1).mean() > 0.85
    confidence = [
        np.mean([each.predict(frame.depth, frame.camera).confidence[FOOT] for frame in regression.TEST])
        for each in (forest, full)
    ]
    assert confidence[0] == pytest.approx(confidence[1], rel=0.35)


def test_validation_frames_that_lack_a_joint_leave_it_untuned(forests):
    held_out = regression.people(30, 2)
    tuned = tune(forests[0], without(held_out, FOOT)).tuning
    assert np.isinf(tuned.max_offset_m[FOOT])
    assert tuned.bandwidth_m[FOOT] == np.float32(DEFAULT_BANDWIDTH_M)
    assert np.isnan(tuned.within_weights[FOOT]).all()
    assert np.isnan(tuned.hidden_weights[FOOT]).all()
    for name, values in vars(tuned).items():
        assert values[:FOOT].tobytes() == getattr(forests[0].tuning, name)[:FOOT].tobytes()


def test_a_joint_is_tuned_on_the_frames_that_know_it(forests):
    """As on these frames alone; a frame that knows nothing changes nothing."""
    held_out = regression.people(30, 2)
    lacking = np.arange(30) >= 20
    tuned = tune(forests[0], without(held_out, FOOT, lacking)).tuning
    few = FrameBatch(
        *(getattr(held_out, name)[:20] for name in ("depth", "label", "joints")),
        held_out.camera, held_out.labels,
        *(getattr(held_out, name)[:20] for name in ("body_depth", "body_label", "is_occluded")),
    )  # fmt: skip
    alone = tune(forests[0], few).tuning
    for name, values in vars(tuned).items():
        np.testing.assert_array_equal(values[FOOT], getattr(alone, name)[FOOT])


def test_frames_that_know_nothing_teach_nothing():
    strangers = walks.people(60, 0)
    strangers = replace(strangers, joints=np.full_like(strangers.joints, np.nan))
    nobody = replace(regression.TRAINING, joints=np.full_like(regression.TRAINING.joints, np.nan))
    with pytest.raises(ValueError, match="none of the 120 frames knows a joint"):
        train(nobody, regression.CONFIG)
    with pytest.raises(ValueError, match="none of the 60 frames knows any of head, neck, foot"):
        train_rwf(strangers, walks.CONFIG)


def test_without_objects_all_modes_grow_the_same_trees_and_cast_the_same_votes():
    people = regression.people(40, 0)
    bare = replace(
        people, depth=people.body_depth, label=people.body_label, is_occluded=np.zeros_like(people.is_occluded)
    )
    models = [
        train(bare, OARFConfig(mode, 1, growth=regression.CONFIG.growth, n_pixels=100), validation=bare)
        for mode in ("baseline", "occluders", "semantic")
    ]
    for model in models[1:]:
        assert model.trees[0].nodes.tobytes() == models[0].trees[0].nodes.tobytes()
        assert not model.trees[0].leaves.unpacked().weight[:, 1:].any()
        answers = [Predictor(each).predict(people.depth[1], people.camera) for each in (model, models[0])]
        assert answers[0].proposals.tobytes() == answers[1].proposals.tobytes()
        assert np.isfinite(answers[0].hidden_probability).all()


@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_a_joint_is_known_as_a_whole(value):
    joints = regression.TRAINING.joints.copy()
    joints[3, 1, 2] = value
    with pytest.raises(ValueError, match="NaN in all coordinates where unknown"):
        replace(regression.TRAINING, joints=joints)


# Random walk forests


def test_a_walk_forest_without_a_joint_is_the_forest_of_the_other_joints(tmp_path):
    """To the byte the one that was told to leave it out; its file says which joints it answers."""
    frames, held_out = walks.people(60, 0), walks.people(10, 1)
    config = replace(walks.CONFIG, box_joints=("head",))
    for lacking, others in ((2, ("head", "neck")), (1, ("head", "foot"))):
        partial = train_rwf(without(frames, lacking), config, validation=without(held_out, lacking))
        chosen = train_rwf(frames, replace(config, joints=others), validation=held_out)
        assert partial.joints == chosen.joints == others
        for name, values in pack_walks(partial).items():
            assert values.tobytes() == pack_walks(chosen)[name].tobytes()
    save_walks(tmp_path / "model", partial)
    walker = Walker(load_walks(tmp_path / "model"))
    assert walker.model.joints == ("head", "foot")
    assert np.isfinite(walker.predict(frames.depth[0], frames.camera).joints).all()


def test_a_parent_that_some_frames_lack_and_a_joint_that_validation_lacks():
    frames, held_out = walks.people(90, 0), walks.people(20, 1)
    lacking = np.arange(90) % 2 == 0
    full = train_rwf(frames, walks.CONFIG, validation=held_out)
    model = train_rwf(without(frames, 1, lacking), walks.CONFIG, validation=without(held_out, FOOT))
    assert model.joints == full.joints
    assert model.limbs.parent.tolist() == full.limbs.parent.tolist()
    assert np.isnan(model.weights[:, FOOT]).all()
    assert np.isfinite(model.weights[:, :FOOT]).all()
    assert model.plan.start_from[FOOT] == 1
    assert model.plan.scatter_m[FOOT] == np.float32(walks.CONFIG.scatter_m)
    test = walks.people(30, 2)
    boxes = [upper_body_box(frame.joints[:2], frame.camera, 0.1) for frame in test]
    found = [Walker(model).predict(f.depth, f.camera, box=box).joints for f, box in zip(test, boxes, strict=True)]
    assert (np.linalg.norm(np.stack(found) - test.joints, axis=2)[:, :FOOT] < 0.15).mean() > 0.8


def test_frames_that_lack_a_joint_give_no_points_and_leave_the_others_theirs():
    crops = Crops(
        np.full(4 * 64, 2000, np.uint16),
        np.arange(4) * 64,
        *np.full((2, 4), 8, np.int32),
        np.zeros((4, 2), np.int32),
        np.tile(np.float32([50.0, 50.0, 3.5, 3.5]), (4, 1)),
    )
    joints = np.random.default_rng(0).normal([0, 0, 2], 0.1, (4, 3)).astype(np.float32)
    starts, gate = np.zeros_like(joints) + np.float32([0, 0, 2]), np.float32([0.1, 0.2])
    full = draw_way_points(crops, joints, starts, gate, 10, 0.5, 0.3, 0.1, 0, 0)
    joints[[0, 2]] = np.nan
    partial = draw_way_points(crops, joints, starts, gate, 10, 0.5, 0.3, 0.1, 0, 0)
    is_kept = np.isin(full.samples.frame, (1, 3))
    for mine, theirs in zip(partial.samples, full.samples, strict=True):
        assert np.array_equal(mine, theirs[is_kept])
    assert np.array_equal(partial.offsets, full.offsets[is_kept])
    assert np.isfinite(farthest_behind(crops, joints, 0.0))
    assert np.isinf(farthest_behind(crops, np.full_like(joints, np.nan), 0.0))


def test_ways_start_at_the_nearest_ancestor_that_the_frame_knows():
    """Foot below knee below hip; the last frame knows none of its ancestors."""
    joints = np.arange(4 * 3 * 3, dtype=np.float32).reshape(4, 3, 3)
    joints[1:, 1] = joints[2:, 0] = np.nan
    starts = -np.ones((4, 3), np.float32)
    places = starts_of(joints, np.int32([-1, 0, 1]), 2, starts)
    assert np.array_equal(places, [joints[0, 1], joints[1, 0], *starts[2:]])
    assert np.array_equal(starts_of(joints, np.int32([-1, 0, 1]), 0, starts), starts)


def test_limbs_are_measured_where_both_ends_are_known():
    joints = np.zeros((5, 3, 3), np.float32)
    joints[:, 1, 0] = 1.0, 2.0, 3.0, 4.0, 90.0
    joints[4, 0] = joints[:, 2] = np.nan
    limbs = measure_limbs(joints, np.int32([-1, 0, 1]), 0.0)
    assert limbs.length_m.tolist() == [[0, np.inf], [1, 4], [0, np.inf]]


def test_a_box_is_that_of_the_known_joints():
    joints = regression.TRAINING.joints[0].copy()
    joints[1] = np.nan
    camera = regression.CAMERA
    assert upper_body_box(joints, camera, 0.1) == upper_body_box(joints[[0, 2]], camera, 0.1)
    assert upper_body_box(np.full_like(joints, np.nan), camera, 0.1) is None
