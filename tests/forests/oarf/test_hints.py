"""Forests that are told more than depth: learned, kept in files, asked; and refused where they are told too little."""

from dataclasses import replace

import numpy as np
import pytest

from forests.crops import CropWriter
from forests.frames import DepthFrame, Hints, Intrinsics, LabelTable
from forests.growing import GrowthConfig
from forests.oarf.config import OARFConfig
from forests.oarf.descend import leaves_with_hints, with_hints
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model, pack_model, save_model, unpack_model
from forests.oarf.train import to_body, train
from forests.records import to_json
from forests.samples import Samples, gather
from tests import reference_forests_growing as reference

CAMERA = Intrinsics(60.0, 62.0, 31.5, 23.5)
LABELS = LabelTable(("left", "right"), ("table", "box"), ("head", "hand"))
CONFIG = OARFConfig(
    learn_skeleton=False,
    n_trees=2,
    n_pixels=80,
    n_occluder_pixels=80,
    n_voting_pixels=60,
    growth=GrowthConfig(max_depth=6, n_candidates=30, n_finalists=10, min_samples_leaf=5),
)


class Scenes:
    """Flat people before flat objects; what is what, and where the joints are, only hints can tell."""

    labels = LABELS

    def __init__(self, n: int, seed: int, tells: tuple[str, ...] = ("classes", "facts")) -> None:
        rng = np.random.default_rng(seed)
        self.frames = []
        for _ in range(n):
            side = int(rng.integers(0, 2))
            depth = np.zeros((44, 60), np.uint16)
            depth[4:40, 8:52] = 2000
            label = np.zeros((44, 60), np.uint8)
            label[4:24, 8:52] = 1 + side
            label[24:40, 8:52] = 3 + int(rng.integers(0, 2))
            joints = np.array([[0.3 - 0.6 * side, -0.4, 2.0], [0.5 - side, 0.1, 2.1]], np.float32)
            hints = Hints(
                label if "classes" in tells else None,
                np.array([1000 * side], np.int16) if "facts" in tells else np.zeros(0, np.int16),
            )
            hidden = np.zeros(2, bool)
            self.frames.append(DepthFrame(depth, label, depth, label, joints, hidden, CAMERA, hints))

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> DepthFrame:
        return self.frames[index]


def blind(scenes: Scenes) -> Scenes:
    """The same without hints."""
    scenes.frames = [replace(frame, hints=None) for frame in scenes.frames]
    return scenes


@pytest.fixture(scope="module")
def model():
    return train(Scenes(24, 0), CONFIG, validation=Scenes(6, 1))


def mean_error(predictor: Predictor, frames: Scenes) -> float:
    errors = []
    for frame in frames.frames:
        joints = predictor.given(frame.hints).predict(frame.depth, frame.camera).joints
        errors.append(np.linalg.norm(joints - frame.joints, axis=1))
    return float(np.mean(errors))


@pytest.mark.parametrize("tells", [("classes",), ("facts",), ("classes", "facts")])
def test_what_depth_does_not_show_is_learned_from_hints(tells):
    told = train(Scenes(24, 0, tells), CONFIG, validation=Scenes(6, 1, tells))
    plain = train(blind(Scenes(24, 0)), CONFIG, validation=blind(Scenes(6, 1)))
    assert all(tree.hints is None for tree in plain.trees)
    test = Scenes(8, 2, tells)
    assert mean_error(Predictor(told), test) < 0.05
    assert mean_error(Predictor(plain), test) > 0.2


def test_a_forest_that_is_told_the_same_of_all_frames_is_the_one_that_is_told_nothing():
    same = Scenes(12, 0)
    same.frames = [replace(frame, hints=Hints(facts=np.zeros(0, np.int16))) for frame in same.frames]
    ours, theirs = (pack_model(train(frames, CONFIG)) for frames in (same, blind(Scenes(12, 0))))
    assert ours.keys() == theirs.keys()
    assert all(ours[name].tobytes() == theirs[name].tobytes() for name in ours)


def test_pixels_reach_the_leaves_that_the_twin_says(model):
    frame = Scenes(1, 7)[0]
    rng = np.random.default_rng(0)
    depth = (frame.depth + rng.integers(-60, 60, frame.depth.shape) * (frame.depth > 0)).astype(np.uint16)
    classes = rng.integers(0, 5, depth.shape).astype(np.uint8)
    hints = Hints(classes, frame.hints.facts)
    with CropWriter(2**20) as writer:
        left, top = writer.add(depth, CAMERA, hints)
        crops = writer.finish()
    rows, columns = np.divmod(rng.permutation(34 * 42)[:150], 42)
    rows, columns = (rows + 1).astype(np.int32), (columns + 1).astype(np.int32)
    z_mm = depth[rows + top, columns + left]
    samples = Samples(np.zeros(150, np.int32), columns, rows, z_mm, np.ones(150, np.uint8))
    predictor = Predictor(model)
    told = with_hints(crops.pixels, int(crops.width[0]), int(crops.height[0]), left, top, CAMERA, hints)
    ours = leaves_with_hints(predictor._trees, told, columns, rows)
    for number, tree in enumerate(model.trees):
        theirs = reference.descend_with_hints(crops, samples, tree.nodes, tree.hints)
        assert np.array_equal(ours[number] - predictor._trees.leaf_start[number], theirs)


def test_a_forest_comes_out_of_its_file_as_it_was(model, tmp_path):
    path = tmp_path / "told.safetensors"
    save_model(path, model)
    again = load_model(path)
    for ours, theirs in zip(model.trees, again.trees, strict=True):
        assert np.array_equal(ours.hints, theirs.hints)
        assert ours.hints.any()
    frame = Scenes(1, 5)[0]
    answers = [Predictor(m).given(frame.hints).predict(frame.depth, CAMERA).proposals for m in (model, again)]
    assert np.array_equal(*answers, equal_nan=True)


def test_asking_without_the_hints_is_refused(model):
    frame, predictor = Scenes(1, 5)[0], Predictor(model)
    message = "the trees of this forest ask for hints, which must be given: 1 facts and classes of pixels"
    for hints in (None, Hints(), Hints(frame.hints.classes), Hints(facts=frame.hints.facts)):
        with pytest.raises(ValueError, match=message):
            predictor.given(hints).predict(frame.depth, CAMERA)
    turned = Hints(np.ascontiguousarray(frame.hints.classes.T), frame.hints.facts)
    with pytest.raises(ValueError, match=r"classes of shape \(60, 44\), must be that of the depth, \(44, 60\)"):
        predictor.given(turned).predict(frame.depth, CAMERA)
    with pytest.raises(ValueError, match="ask for hints"):
        predictor.label_pixels(frame.depth, CAMERA)


def test_a_file_that_asks_for_facts_that_nobody_tells_is_refused_before_a_kernel_runs(model):
    metadata = {"config": to_json(model.config), "labels": to_json(model.labels)}
    arrays = pack_model(model)
    with pytest.raises(ValueError, match="array hints is int32"):
        unpack_model(arrays | {"tree0.hints": arrays["tree0.hints"].astype(np.int32)}, metadata)
    with pytest.raises(ValueError, match="array hints is"):
        unpack_model(arrays | {"tree0.hints": arrays["tree0.hints"][1:]}, metadata)
    far = arrays["tree0.hints"].copy()
    far[0] = -(2**15)
    frame = Scenes(1, 5)[0]
    damaged = unpack_model(arrays | {"tree0.hints": far}, metadata)
    with pytest.raises(ValueError, match="32768 facts"):
        Predictor(damaged).given(frame.hints).predict(frame.depth, CAMERA)


def test_a_forest_that_asks_for_nothing_takes_no_hints():
    plain = Predictor(train(blind(Scenes(6, 0)), CONFIG))
    assert plain.given(Scenes(1, 0)[0].hints) is plain
    assert not plain.asks_for_hints


def test_the_body_layer_is_learned_without_hints():
    training = gather(Scenes(3, 0), "body", 20, 0, 0)
    assert len(training.crops.classes) == 0
    assert training.crops.facts.size == 0


def test_offsets_lead_to_the_middle_of_the_known_joints():
    frames = Scenes(3, 0)
    unknown = np.full((2, 3), np.nan, np.float32)
    half = np.where([[True], [False]], frames[1].joints, np.nan).astype(np.float32)
    frames.frames[1] = replace(frames[1], joints=half)
    frames.frames[2] = replace(frames[2], joints=unknown)
    training = gather(frames, "composite", 20, 20, 0)
    offsets = to_body(training)
    points, frame = training.samples.points(training.crops), training.samples.frame
    middles = [frames[0].joints.mean(axis=0), frames[1].joints[0]]
    for number, middle in enumerate(middles):
        mine = frame == number
        assert np.abs(offsets[mine] - 1000 * (middle - points[mine])).max() <= 0.51
    assert not offsets[frame == 2].any()
