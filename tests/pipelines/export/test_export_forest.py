"""An exported forest reaches the leaves that the forest itself reaches, and finds the same joints."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forests.frames import FrameSubset, Intrinsics, LabelTable
from forests.growing import GrowthConfig
from forests.modelfile import write_model
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.packed import LeafTable, pack_leaves
from forests.oarf.predict import Predictor
from forests.oarf.storage import save_model
from forests.oarf.train import train
from forests.oarf.tune import untuned
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE
from pipelines.cli import main
from pipelines.commands.generate import GenerateSettings
from pipelines.corpus import Corpus
from pipelines.corpus.sequence import CorpusFrames
from pipelines.export.forest.write import to_onnx
from pipelines.generation.writing import write_shown

pytest.importorskip("onnx", reason="onnx is not installed")
runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")

SCRIPT = Path(__file__).parents[3] / "examples" / "onnx" / "run_forest.py"
CAMERA = Intrinsics(120.0, 118.0, 39.5, 29.25)
LABELS = LabelTable(("head", "trunk"), ("table",), ("head", "torso", "hand"))


def random_tree(rng, depth, n_layers, n_votes):
    """A tree of random decisions, in which some leaves lie higher than others; a third of the modes are missing."""
    levels, left = [0], []
    for node, level in enumerate(levels):  # which grow while they are read: breadth first
        is_leaf = level == depth or (level > 1 and rng.random() < 0.15)
        left.append(node if is_leaf else len(levels))
        levels += [] if is_leaf else [level + 1] * 2
    nodes = np.zeros(len(levels), NODE_DTYPE)
    nodes["left"], nodes["leaf"] = left, -1
    nodes["u"], nodes["v"] = rng.uniform(-0.6, 0.6, (2, len(nodes), 2))
    nodes["v"][rng.random(len(nodes)) < 0.5] = 0.0
    nodes["threshold"] = rng.integers(-2100, 2100, len(nodes)) // rng.choice([1, 20], len(nodes))
    leaves = np.flatnonzero(nodes["left"] == np.arange(len(nodes)))
    nodes["leaf"][leaves] = np.arange(len(leaves))
    nodes["threshold"][leaves], nodes["u"][leaves], nodes["v"][leaves] = LEAF_THRESHOLD, 0.0, 0.0
    shape = len(leaves), n_layers, len(LABELS.joints), n_votes
    weight = rng.uniform(0.05, 0.5, shape) * (rng.random(shape) < 0.67)
    vote = rng.normal(0.0, 0.2, (*shape, 3))
    probability = rng.dirichlet(np.ones(1 + n_layers), len(leaves))
    table = LeafTable(*(values.astype(np.float32) for values in (probability, vote, weight)))
    return ForestTree(nodes, pack_leaves(table))


def random_model(seed=0, n_trees=2, depth=5, mode="semantic", n_votes=2, **config):
    rng = np.random.default_rng(seed)
    n_layers = 1 if mode == "baseline" else 2
    trees = tuple(random_tree(rng, depth, n_layers, n_votes) for _ in range(n_trees))
    tuning = replace(untuned(3), max_offset_m=np.array([0.3, np.inf, 0.5], np.float32))
    tuning = replace(tuning, bandwidth_m=np.array([0.03, 0.06, 0.1], np.float32))
    options = OARFConfig(mode=mode, n_trees=n_trees, n_leaf_votes=n_votes, **config)
    return OARFModel(options, LABELS, ClassTable.of(LABELS, mode), trees, tuning)


def person(seed=1):
    """(60, 80) uint16: a bumpy person with holes, 2 m away, of 20 x 44 pixels."""
    rng = np.random.default_rng(seed)
    depth = np.zeros((60, 80), np.uint16)
    depth[8:52, 30:50] = 2000 + rng.integers(0, 80, (44, 20))
    depth[20:24, 36:40] = 0
    return depth


def session_of(graph):
    return runtime.InferenceSession(graph, providers=["CPUExecutionProvider"])


def answer_of(session, depth, camera, box=None):
    whole = (0, 0, depth.shape[1], depth.shape[0])
    inputs = {
        "depth": depth,
        "intrinsics": np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32),
        "box": np.array(box or whole, np.float32),
    }
    names = ["proposals", "confidence", "pixels", "leaves"]
    return dict(zip(names, session.run(names, inputs), strict=True))


def assert_same_leaves(model, answer, depth, camera, box=None):
    """The pixels that vote are the forest's, and reach the same leaves."""
    leaves, points = Predictor(model).reach_leaves(depth, camera, box)
    np.testing.assert_array_equal(answer["leaves"], leaves)
    rows, columns = answer["pixels"].T
    z = depth[rows, columns] / 1e3
    there = np.stack([(columns - camera.cx) * z / camera.fx, (rows - camera.cy) * z / camera.fy, z], axis=1)
    np.testing.assert_allclose(points, there, rtol=1e-5, atol=1e-5)


def assert_alike(model, session, depth, camera, box=None):
    """The same leaves, joints within 1 mm, confidences within 0.1 %; gives the graph's answer."""
    answer = answer_of(session, depth, camera, box)
    assert_same_leaves(model, answer, depth, camera, box)
    ours = Predictor(model).predict(depth, camera, box)
    np.testing.assert_allclose(answer["proposals"][:, 0], ours.joints, atol=1e-3)
    np.testing.assert_allclose(answer["proposals"], ours.proposals, atol=1e-2)  # the others are not settled
    np.testing.assert_allclose(answer["confidence"], ours.proposal_confidence, rtol=1e-3, atol=1e-9)
    return answer


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """Generated frames: 20 to learn from, and 8 others."""
    settings = GenerateSettings(tmp_path_factory.mktemp("generated") / "corpus", frames=28, seed=5)
    write_shown(settings.out, settings.order(), 1)
    return CorpusFrames(Corpus.open(settings.out), range(28))


@pytest.fixture(scope="module")
def trained(frames):
    growth = GrowthConfig(max_depth=12, n_candidates=100)
    config = OARFConfig(n_trees=2, n_pixels=200, n_occluder_pixels=200, learn_skeleton=False, growth=growth)
    return train(FrameSubset(frames, tuple(range(20))), config)


def test_joints_of_generated_frames_are_those_of_the_forest(trained, frames):
    session = session_of(to_onnx(trained))
    for k in range(20, 28):
        answer = assert_alike(trained, session, frames[k].depth, frames[k].camera)
        assert len(answer["pixels"]) == 500


@pytest.mark.parametrize("mode", ["baseline", "occluders", "semantic"])
@pytest.mark.parametrize(("n_trees", "depth", "n_votes"), [(1, 0, 1), (1, 3, 2), (3, 7, 3)])
def test_every_pixel_reaches_its_leaf(mode, n_trees, depth, n_votes):
    model = random_model(n_trees, n_trees, depth, mode, n_votes, n_voting_pixels=4800)
    image = person()
    answer = assert_alike(model, session_of(to_onnx(model)), image, CAMERA)
    np.testing.assert_array_equal(answer["pixels"], np.argwhere(image))


@pytest.mark.parametrize("n_voting_pixels", [1, 7, 100, 863, 864, 865])
def test_the_same_pixels_vote(n_voting_pixels):
    model = random_model(n_voting_pixels=n_voting_pixels)
    session = session_of(to_onnx(model))
    bar = np.zeros((60, 80), np.uint16)
    bar[31, 4:76] = 3000  # between the rows that would be read
    for image in (person(), bar, np.full((60, 80), 1500, np.uint16)):
        assert_same_leaves(model, answer_of(session, image, CAMERA), image, CAMERA)


BOXES = [(35.5, 10.2, 44.0, 50.0), (-20.0, -5.0, 200.0, 15.5), (30.2, 8.0, 30.8, 52.0), (60.0, 0.0, 80.0, 60.0)]


@pytest.mark.parametrize("box", BOXES)
def test_pixels_outside_a_box_do_not_vote(box):
    model = random_model(n_voting_pixels=200)
    assert_alike(model, session_of(to_onnx(model)), person(), CAMERA, box)


def odd_images():
    empty, corner, far = (np.zeros((60, 80), np.uint16) for _ in range(3))
    corner[0, 0], corner[59, 79] = 700, 900
    far[20:40, 20:60] = 65535
    one = np.zeros((1, 1), np.uint16)
    return {"empty": empty, "corners": corner, "far": far, "nothing at all": one, "a pixel": one + np.uint16(2000)}


@pytest.mark.parametrize("name", odd_images())
def test_odd_images_are_answered_as_by_the_forest(name):
    model, image = random_model(), odd_images()[name]
    answer = assert_alike(model, session_of(to_onnx(model)), image, CAMERA)
    if not image.any():
        assert answer["leaves"].shape == (2, 0)
        assert np.isnan(answer["proposals"]).all()
        assert not answer["confidence"].any()


def test_a_joint_without_votes_is_not_found():
    model = random_model()
    model = replace(model, tuning=replace(model.tuning, max_offset_m=np.array([1e-4, 1.0, 1.0], np.float32)))
    answer = assert_alike(model, session_of(to_onnx(model)), person(), CAMERA)
    assert np.isnan(answer["proposals"][0]).all()
    assert np.isfinite(answer["proposals"][1:, 0]).all()


def test_the_same_forest_gives_the_same_bytes():
    assert to_onnx(random_model()) == to_onnx(random_model())


def test_the_command_writes_what_the_script_runs(trained, frames, tmp_path):
    save_model(tmp_path / "forest.safetensors", trained)
    assert main(["export-model", str(tmp_path / "forest.safetensors")]) == 0
    assert (tmp_path / "forest.onnx").read_bytes() == to_onnx(trained)
    frame = frames[21]
    np.save(tmp_path / "depth.npy", frame.depth)
    numbers = map(str, (frame.camera.fx, frame.camera.fy, frame.camera.cx, frame.camera.cy))
    words = [str(SCRIPT), str(tmp_path / "forest.onnx"), str(tmp_path / "depth.npy"), *numbers]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    theirs = [json.loads(line) for line in done.stdout.splitlines()]
    assert [item["joint"] for item in theirs] == list(trained.labels.joints)
    ours = Predictor(trained).predict(frame.depth, frame.camera)
    np.testing.assert_allclose([item["xyz"] for item in theirs], ours.joints, atol=1e-3)
    np.testing.assert_allclose([item["confidence"] for item in theirs], ours.confidence, atol=1e-3)


def test_forests_that_ask_for_hints_are_refused(tmp_path, capsys):
    model = random_model()
    hints = np.zeros(len(model.trees[0].nodes), np.int16)
    hints[0] = -1
    asks = replace(model, trees=(model.trees[0]._replace(hints=hints), *model.trees[1:]))
    for number, refused in enumerate((asks, replace(model, context=model))):
        path = tmp_path / f"{number}.safetensors"
        save_model(path, refused)
        assert main(["export-model", str(path)]) == 1
        [line] = capsys.readouterr().err.strip().splitlines()
        assert f"{path} cannot be exported: its trees ask for hints beside depth" in line
        assert not path.with_suffix(".onnx").exists()


def test_other_kinds_are_refused(tmp_path, capsys):
    write_model(tmp_path / "m", "rwf", {}, {})
    assert main(["export-model", str(tmp_path / "m")]) == 1
    known = "models that can be exported: orientation, heatmap, oarf"
    assert f"holds a model of kind 'rwf'; {known}" in capsys.readouterr().err
