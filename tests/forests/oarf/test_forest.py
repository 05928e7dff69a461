"""A regression forest as its users hold it: trained from arrays, asked with a depth image, cloned, repeated."""

import itertools
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from sklearn.base import clone

from forests.frames import FrameBatch, FrameSubset, Intrinsics, LabelTable
from forests.growing import GrowthConfig
from forests.kinds import load_model
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.forest import OcclusionAwareForest
from forests.oarf.model import ForestTree
from forests.oarf.predict import Predictor
from forests.oarf.train import train

CAMERA = Intrinsics(100.0, 100.0, 47.5, 35.5)
LABELS = LabelTable(("head", "trunk", "leg"), ("table", "box"), ("head", "trunk", "foot"))
CONFIG = OARFConfig(
    learn_skeleton=False,
    n_trees=2,
    n_pixels=150,
    n_occluder_pixels=100,
    n_voting_pixels=300,
    growth=GrowthConfig(max_depth=10, n_candidates=100, min_samples_leaf=3, max_offset_m=0.6),
)


def people(n: int, seed: int) -> FrameBatch:
    """Upright people of boxes, 2-3 m away; a table (low and wide) or a box (tall and narrow) hides the legs.

    A table stands where the foot is on the left, a box where it is on the right: what hides says where.
    """
    rng = np.random.default_rng(seed)
    shape = (n, 72, 96)
    depth, label = np.zeros(shape, np.uint16), np.zeros(shape, np.uint8)
    body_depth, body_label = depth.copy(), label.copy()
    joints = np.zeros((n, 3, 3), np.float32)
    is_occluded = np.zeros((n, 3), bool)
    for i in range(n):
        z = rng.uniform(2.0, 3.0)
        x = rng.uniform(-0.4, 0.4)
        side = rng.integers(2)
        foot = x + (-0.15, 0.15)[side]
        for part, (left, top, right, bottom) in enumerate(
            [(x - 0.1, -0.75, x + 0.1, -0.5), (x - 0.2, -0.5, x + 0.2, 0.2), (foot - 0.08, 0.2, foot + 0.08, 0.8)]
        ):
            _fill(body_depth[i], body_label[i], z, (left, top, right, bottom), part + 1)
        depth[i], label[i] = body_depth[i], body_label[i]
        joints[i] = [[x, -0.62, z + 0.1], [x, -0.15, z + 0.1], [foot, 0.75, z + 0.1]]
        if i % 4:
            box = (x - 0.5, 0.25, x + 0.5, 0.8) if side == 0 else (x - 0.3, 0.25, x + 0.3, 0.8)
            _fill(depth[i], label[i], z - 0.25, box, 4 + side)
            is_occluded[i, 2] = True
    return FrameBatch(depth, label, joints, CAMERA, LABELS, body_depth, body_label, is_occluded)


def _fill(depth: np.ndarray, label: np.ndarray, z: float, box: tuple[float, ...], value: int) -> None:
    left, right = (int(np.clip(CAMERA.fx * x / z + CAMERA.cx, 0, 96)) for x in (box[0], box[2]))
    top, bottom = (int(np.clip(CAMERA.fy * y / z + CAMERA.cy, 0, 72)) for y in (box[1], box[3]))
    depth[top:bottom, left:right], label[top:bottom, left:right] = round(1000 * z), value


TRAINING, TEST = people(120, 0), people(40, 1)


@pytest.fixture(scope="module")
def forest() -> OcclusionAwareForest:
    return OcclusionAwareForest(CONFIG).fit(TRAINING)


def assert_same_leaves(one: ForestTree, two: ForestTree) -> None:
    assert one.leaves.shape == two.leaves.shape
    for a, b in zip(one.leaves[2:], two.leaves[2:], strict=True):
        assert a.tobytes() == b.tobytes()


def errors_of(forest: OcclusionAwareForest, frames: FrameBatch) -> np.ndarray:
    estimates = np.stack([forest.predict(frame.depth, CAMERA).joints for frame in frames])
    return np.linalg.norm(estimates - frames.joints, axis=2)


def test_joints_of_people_never_seen_are_found(forest):
    """Behind the objects too: within 10 cm for nine in ten."""
    errors = errors_of(forest, TEST)
    assert (errors < 0.1).mean(axis=0).min() > 0.9


def test_pixels_are_labelled_with_parts_and_occluders(forest):
    n_right = n_pixels = 0
    for frame in TEST:
        labelled = forest.label_pixels(frame.depth, CAMERA)
        assert np.array_equal(labelled > 0, frame.depth > 0)
        n_right += (labelled == frame.label)[frame.label > 0].sum()
        n_pixels += (frame.label > 0).sum()
    assert n_right / n_pixels > 0.85


def test_hidden_joints_are_told_from_visible_ones(forest):
    hidden = np.stack([forest.predict(frame.depth, CAMERA).hidden_probability for frame in TEST])
    is_hidden = TEST.is_occluded
    assert np.median(hidden[is_hidden]) > 0.5 > np.median(hidden[:, :2])


@pytest.mark.parametrize("mode", ["baseline", "occluders", "semantic"])
def test_every_mode_has_its_classes(mode):
    n_occluders = {"baseline": 0, "occluders": 1, "semantic": 2}[mode]
    model = train(FrameSubset(TRAINING, tuple(range(20))), replace(CONFIG, mode=mode, n_trees=1))
    assert model.classes.n_classes == 3 + n_occluders
    for tree in model.trees:
        assert tree.leaves.n_classes == 3 + n_occluders
        assert np.allclose(tree.leaves.probabilities().sum(axis=1), 1.0, atol=1e-3)
        assert tree.leaves.shape[1] == (1 if mode == "baseline" else 2)


def test_classes_follow_from_labels_and_mode():
    lookup = {mode: ClassTable.of(LABELS, mode).of_label(LABELS) for mode in ("baseline", "occluders", "semantic")}
    assert lookup["semantic"][1:].tolist() == [0, 1, 2, 3, 4]
    assert lookup["occluders"][1:].tolist() == [0, 1, 2, 3, 3]
    assert lookup["baseline"][1:4].tolist() == [0, 1, 2]


def test_the_same_seed_trains_the_same_forest_on_any_number_of_threads(forest):
    again = OcclusionAwareForest(CONFIG, n_threads=2).fit(TRAINING)
    other = train(TRAINING, replace(CONFIG, seed=1, n_trees=1))
    for one, two in zip(forest.model_.trees, again.model_.trees, strict=True):
        assert one.nodes.tobytes() == two.nodes.tobytes()
        assert_same_leaves(one, two)
    for name in ("max_offset_m", "bandwidth_m", "within_weights", "hidden_weights"):
        first, second = (getattr(f.model_.tuning, name) for f in (forest, again))
        assert first.tobytes() == second.tobytes(), name
    assert other.trees[0].nodes.tobytes() != forest.model_.trees[0].nodes.tobytes()


def test_it_is_an_estimator_of_scikit_learns_kind(forest):
    copy = clone(forest)
    assert not hasattr(copy, "model_")
    assert copy.get_params() == forest.get_params()
    changed = copy.set_params(config__growth__max_depth=4, config__mode="occluders", n_threads=2)
    assert changed.config.growth.max_depth == 4
    assert changed.config.mode == "occluders"
    assert changed.n_threads == 2
    assert changed.config.n_pixels == CONFIG.n_pixels
    with pytest.raises(ValueError, match=r"'config__depth' is unknown; known are config, "):
        copy.set_params(config__depth=3)


def test_a_forest_that_is_not_fitted_says_so():
    with pytest.raises(ValueError, match="call fit first"):
        OcclusionAwareForest(CONFIG).predict(TEST.depth[0], CAMERA)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mode": "semantics"}, "mode 'semantics' is unknown; known are baseline, occluders, semantic"),
        ({"n_trees": 0}, "n_trees=0 must be in 1"),
        ({"n_voting_pixels": -5}, "n_voting_pixels=-5 must be in 1"),
        ({"leaf_bandwidth_m": 50.0}, "must be in 0.001..1.0"),
    ],
)
def test_settings_out_of_range_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(CONFIG, **changes)


def test_training_needs_frames():
    with pytest.raises(ValueError, match="no training frames"):
        train(FrameSubset(TRAINING, ()), CONFIG)


def test_an_interrupted_training_goes_on_after_the_last_finished_tree():
    frames, config = FrameSubset(TRAINING, tuple(range(30))), replace(CONFIG, n_trees=3)
    kept: dict[int, object] = {}

    class Store:
        """Stops the training as the second tree is kept."""

        def __init__(self, stops: bool) -> None:
            self.stops = stops

        def load(self, tree):
            return kept.get(tree)

        def save(self, tree, grown):
            kept[tree] = grown
            if self.stops and tree == 1:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(frames, config, checkpoint=Store(True))
    first = dict(kept)
    resumed = train(frames, config, checkpoint=Store(False))
    assert all(kept[tree] is first[tree] for tree in (0, 1))
    whole = train(frames, config)
    for one, two in zip(resumed.trees, whole.trees, strict=True):
        assert one.nodes.tobytes() == two.nodes.tobytes()
        assert_same_leaves(one, two)


def test_a_tree_that_was_lost_is_grown_again_in_its_place():
    """Such as one whose file was damaged: the trees after it stay where they are."""
    frames, config = FrameSubset(TRAINING, tuple(range(20))), replace(CONFIG, n_trees=3)
    whole = train(frames, config)

    class Store:
        """Holds all trees but the first."""

        saved: ClassVar[list[int]] = []

        def load(self, tree):
            return whole.trees[tree] if tree else None

        def save(self, tree, grown):
            self.saved.append(tree)

    mended = train(frames, config, checkpoint=Store())
    assert Store.saved == [0]
    for one, two in zip(mended.trees, whole.trees, strict=True):
        assert one.nodes.tobytes() == two.nodes.tobytes()
        assert_same_leaves(one, two)


def test_progress_rises_to_one():
    shares: list[float] = []
    train(FrameSubset(TRAINING, tuple(range(10))), replace(CONFIG, n_trees=1), on_progress=shares.append)
    assert shares[-1] == 1.0
    assert all(b >= a for a, b in itertools.pairwise(shares))


def test_a_forest_that_learned_skeletons_answers_one_body_and_can_be_asked_without(tmp_path):
    names = ("head", "neck", "torso")
    labels = LabelTable(LABELS.parts, LABELS.occluders, names)
    frames, test = replace(TRAINING, labels=labels), replace(TEST, labels=labels)
    plain = OcclusionAwareForest(CONFIG).fit(frames, test)
    learned = OcclusionAwareForest(replace(CONFIG, learn_skeleton=True)).fit(frames, test)
    assert plain.model_.skeleton is None
    assert learned.model_.skeleton is not None
    path = tmp_path / "forest"
    learned.save(path)
    for index in range(8):
        depth = test.depth[index]
        one_by_one = plain.predict(depth, CAMERA)
        whole, read = learned.predict(depth, CAMERA), load_model(path).predict(depth, CAMERA)
        np.testing.assert_array_equal(whole.proposals, read.proposals)
        apart = Predictor(replace(learned.model_, skeleton=None)).predict(depth, CAMERA)
        np.testing.assert_array_equal(apart.proposals, one_by_one.proposals)
        assert whole.joints.shape == one_by_one.joints.shape
        assert np.isfinite(whole.joints).all()
