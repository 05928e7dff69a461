"""A second forest that may ask what a first one predicts of pixels."""

from dataclasses import replace

import numpy as np
import pytest

from forests.frames import DepthFrame, Hints, Intrinsics, LabelTable
from forests.growing import GrowthConfig
from forests.oarf.config import OARFConfig
from forests.oarf.context import PredictedFrames, train_with_context
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model, pack_model, save_model, unpack_model
from forests.oarf.train import train
from forests.records import to_json

CAMERA = Intrinsics(60.0, 62.0, 31.5, 23.5)
LABELS = LabelTable(("head", "trunk"), ("table", "box"), ("head", "hand"))
CONFIG = OARFConfig(
    learn_skeleton=False,
    n_trees=2,
    n_pixels=60,
    n_occluder_pixels=60,
    n_voting_pixels=40,
    growth=GrowthConfig(max_depth=5, n_candidates=30, n_finalists=10, min_samples_leaf=5),
)


class Scenes:
    """A head over a trunk over an object, at random places; the object's class shows in its depth."""

    labels = LABELS

    def __init__(self, n: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.frames = []
        for _ in range(n):
            top, left, kind = int(rng.integers(4, 12)), int(rng.integers(6, 30)), int(rng.integers(0, 2))
            depth, label = np.zeros((44, 60), np.uint16), np.zeros((44, 60), np.uint8)
            depth[top : top + 8, left + 4 : left + 12], label[top : top + 8, left + 4 : left + 12] = 2000, 1
            depth[top + 8 : top + 20, left : left + 16], label[top + 8 : top + 20, left : left + 16] = 2050, 2
            depth[top + 20 : top + 28, left - 5 : left + 21] = 1900 - 150 * kind
            label[top + 20 : top + 28, left - 5 : left + 21] = 3 + kind
            depth[depth > 0] += rng.integers(0, 40, (depth > 0).sum()).astype(np.uint16)
            u, v = left + 8 - CAMERA.cx, top + 4 - CAMERA.cy
            head = np.array([u * 2 / CAMERA.fx, v * 2 / CAMERA.fy, 2.05])
            joints = np.stack([head, head + np.array([0.0, 0.5, 0.1 - 0.2 * kind])]).astype(np.float32)
            nothing = np.zeros(2, bool)
            self.frames.append(DepthFrame(depth, label, depth, label * (label < 3), joints, nothing, CAMERA))

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> DepthFrame:
        return self.frames[index]


class Store:
    """A `TreeStore` in memory."""

    def __init__(self, trees=()):
        self.trees = dict(trees)

    def load(self, tree):
        return self.trees.get(tree)

    def save(self, tree, grown):
        self.trees[tree] = grown


@pytest.fixture(scope="module")
def model():
    return train_with_context(Scenes(20, 0), CONFIG, validation=Scenes(6, 1))


def bytes_of(model) -> dict[str, bytes]:
    return {name: values.tobytes() for name, values in pack_model(model).items()}


def test_the_second_forest_is_told_what_the_first_predicts(model):
    first = train(Scenes(20, 0), CONFIG)
    assert bytes_of(model.context) == bytes_of(first)
    assert any(tree.hints is not None and (tree.hints > 0).any() for tree in model.trees)
    predictor, told = Predictor(model), Predictor(replace(model, context=None))
    assert not predictor.asks_for_hints
    assert told.asks_for_hints
    for frame in Scenes(3, 2).frames:
        hints = Predictor(first).hints_of(frame.depth, CAMERA)
        ours, theirs = predictor.predict(frame.depth, CAMERA), told.given(hints).predict(frame.depth, CAMERA)
        assert np.array_equal(ours.proposals, theirs.proposals, equal_nan=True)
        assert np.array_equal(ours.probability, theirs.probability)
        assert np.linalg.norm(ours.joints - frame.joints, axis=1).max() < 0.2
        assert np.array_equal(
            predictor.label_pixels(frame.depth, CAMERA), told.given(hints).label_pixels(frame.depth, CAMERA)
        )


def test_what_is_told_of_a_training_frame_comes_from_a_forest_that_has_not_seen_it():
    frames = Scenes(7, 0)

    class Named:
        def __init__(self, number):
            self.number = number

        def hints_of(self, depth, camera):
            return Hints(np.full(depth.shape, self.number, np.uint8))

    labelled = PredictedFrames(frames, [Named(1), Named(2)])
    told = [int(labelled[k].hints.classes[0, 0]) for k in range(len(labelled))]
    assert told == [1, 1, 1, 2, 2, 2, 2]
    assert (labelled.labels, len(labelled)) == (LABELS, 7)
    learned = []

    class Watched(Scenes):
        def __getitem__(self, index):
            learned.append(index)
            return super().__getitem__(index)

    train_with_context(Watched(7, 0), replace(CONFIG, n_trees=1))
    assert learned == [*range(7), *range(3, 7), *range(3), *range(7)]


def test_the_model_is_the_same_for_any_threads_and_after_interruptions(model):
    store = Store()
    again = train_with_context(Scenes(20, 0), CONFIG, validation=Scenes(6, 1), n_threads=2, checkpoint=store)
    assert bytes_of(again) == bytes_of(model)
    assert sorted(store.trees) == list(range(6))
    for lost in (0, 2, 5):
        kept = Store({number: tree for number, tree in store.trees.items() if number != lost})
        resumed = train_with_context(Scenes(20, 0), CONFIG, validation=Scenes(6, 1), checkpoint=kept)
        assert bytes_of(resumed) == bytes_of(model)


def test_both_forests_come_out_of_their_file(model, tmp_path):
    path = tmp_path / "context.safetensors"
    save_model(path, model)
    assert bytes_of(load_model(path)) == bytes_of(model)
    metadata = {"config": to_json(model.config), "labels": to_json(model.labels)}
    arrays = pack_model(model)
    nested = {f"context.{name}": values for name, values in arrays.items() if name.startswith("context.")}
    with pytest.raises(ValueError, match="asks for labels itself"):
        unpack_model(arrays | nested, metadata)
    first = {name: values for name, values in arrays.items() if name != "context.tree0.threshold"}
    with pytest.raises(ValueError, match="array threshold is missing"):
        unpack_model(first, metadata)


def test_too_few_frames_are_refused():
    with pytest.raises(ValueError, match="1 training frames cannot be divided into 2 folds"):
        train_with_context(Scenes(1, 0), CONFIG)


def test_hints_merge_the_body_parts_and_name_the_objects(model):
    predictor = Predictor(model.context)
    frame = Scenes(1, 3)[0]
    labels, hints = predictor.label_pixels(frame.depth, CAMERA), predictor.hints_of(frame.depth, CAMERA).classes
    assert {1, 2} <= set(np.unique(labels))
    assert labels.max() > 2
    lookup = np.array([0, 1, 1, 2, 3], np.uint8)
    assert np.array_equal(hints, lookup[labels])
