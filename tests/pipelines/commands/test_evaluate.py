"""The command evaluate: one JSON object, a table, rows; the same for any number of threads."""

import json
import time
from dataclasses import replace

import numpy as np
import pytest

from forests.estimate import JointEstimate
from forests.modelfile import write_model
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.packed import LeafTable, pack_leaves
from forests.oarf.storage import save_model
from forests.oarf.tune import untuned
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE
from pipelines.cli import main
from pipelines.corpus import Corpus, write_corpus
from pipelines.corpus.sequence import LABELS, CorpusFrames
from pipelines.errors import UserError
from pipelines.metrics import MEASURES, read_truths
from pipelines.metrics.results import read_results
from pipelines.models.asking import Contestant, contestant_of, predict_frames
from pipelines.models.opening import open_model
from synth.vocabulary import JOINT_NAMES, OCCLUDER_CODE, JointState


def estimate_of(proposals, confidence, camera):
    unknown = np.full(len(proposals), np.nan, np.float32)
    return JointEstimate(proposals.astype(np.float32), confidence, unknown, unknown, unknown, camera)


class Oracle:
    """Knows every frame by its depth image, and answers so far beside the truth."""

    def __init__(self, corpus, error=0.0, joints=JOINT_NAMES):
        self.joints, self.box_joints = joints, ()
        self.classes = ClassTable.of(LABELS, "semantic").names
        self.error = error
        self.by_depth = {}
        at = [JOINT_NAMES.index(name) for name in joints]
        frames = CorpusFrames(corpus, corpus.split("test"))
        for place in range(len(frames)):
            frame = frames[place]
            self.by_depth[frame.depth.tobytes()] = place, frame.joints[at], frame.label

    def predict(self, depth, camera, box=None):
        place, joints, _ = self.by_depth[depth.tobytes()]
        time.sleep(0.002 * (place % 3))
        rng = np.random.default_rng(place)
        proposals = np.stack([joints, joints + 1.0], axis=1) + rng.normal(size=(len(joints), 2, 3)) * self.error
        confidence = np.tile(np.array([2.0, 1.0], np.float32) + np.float32(rng.random()), (len(joints), 1))
        return estimate_of(proposals, confidence, camera)

    def label_pixels(self, depth, camera):
        return self.by_depth[depth.tobytes()][2]


class Blind:
    """Finds nothing and labels no pixels."""

    joints, box_joints = JOINT_NAMES, ()

    def predict(self, depth, camera, box=None):
        return estimate_of(np.full((15, 1, 3), np.nan), np.zeros((15, 1), np.float32), camera)


def stump():
    """A forest of one leaf."""
    config = OARFConfig(n_trees=1)
    classes = ClassTable.of(LABELS, config.mode)
    nodes = np.zeros(1, NODE_DTYPE)
    nodes["threshold"] = LEAF_THRESHOLD
    shape = 1, 2, LABELS.n_joints, config.n_leaf_votes
    probability = np.full((1, classes.n_classes), 1 / classes.n_classes, np.float32)
    leaves = LeafTable(probability, np.zeros((*shape, 3), np.float32), np.zeros(shape, np.float32))
    tuning = replace(untuned(LABELS.n_joints), max_offset_m=np.full(LABELS.n_joints, 1.0, np.float32))
    return OARFModel(config, LABELS, classes, (ForestTree(nodes, pack_leaves(leaves)),), tuning)


@pytest.fixture
def evaluated(toy_corpus, monkeypatch, capsys):
    def run(predictor, *options, corpus=toy_corpus):
        contestant = contestant_of("forest", predictor)
        about = {"name": "forest.safetensors", "digest": "00", "config": {"n_trees": 3}}
        monkeypatch.setattr("pipelines.commands.evaluate.open_model", lambda path, _: (contestant, about))
        code = main(["evaluate", "forest.safetensors", str(corpus.path), "--resamples", "30", *options])
        out, err = capsys.readouterr()
        assert (code, err) == (0, "")
        return out

    return run


def document_of(out):
    assert out.count("\n") == 1

    def refuse(name):
        raise AssertionError(f"{name} is no JSON")

    return json.loads(out, parse_constant=refuse)


def test_an_oracle_scores_one(evaluated, toy_corpus):
    document = document_of(evaluated(Oracle(toy_corpus), "--json"))
    # Its second proposals are wrong but less confident than all the first.
    assert document["map_10cm"] == document["accuracy_10cm"] == document["accuracy_2d"] == 1.0
    assert document["mean_error_cm"] == document["missing"] == 0.0
    assert document["map_10cm_ci"] == [1.0, 1.0]
    assert document["n_frames"] == 30
    assert document["n_joints"] == 450
    assert document["pixels"]["class_accuracy"] == 1.0
    assert document["corpus"]["digest"] == toy_corpus.digest
    assert document["model"]["config"] == {"n_trees": 3}
    assert document["configuration"]["split"] == "test"


def test_every_group_has_every_measure(evaluated, toy_corpus):
    document = document_of(evaluated(Oracle(toy_corpus, 0.05), "--json"))
    states = ("visible", "occluded", "self_occluded", "outside", "non_occluded")
    tables = ("by_joint", "by_hiding_class", "by_object_in_frame", "by_visible_fraction", "by_family")
    groups = [document[name] for name in states] + [g for name in tables for g in document[name].values()]
    for group in [document, *groups]:
        assert {"n_frames", "n_joints", *MEASURES, *(f"{name}_ci" for name in MEASURES)} <= set(group)
    counts = [document[name]["n_joints"] for name in states]
    assert sum(counts[:4]) == document["n_joints"] == counts[1] + counts[4]
    assert list(document["by_joint"]) == list(JOINT_NAMES)


def test_a_blind_predictor_has_nulls_and_no_warning(evaluated):
    document = document_of(evaluated(Blind(), "--json"))
    assert document["map_10cm"] == document["accuracy_10cm"] == document["auc_20cm"] == 0.0
    assert document["mean_error_cm"] is document["median_error_cm"] is document["pixels"] is None
    assert document["missing"] == 1.0
    assert " nan" not in evaluated(Blind())


def test_the_scores_do_not_depend_on_threads(evaluated, toy_corpus, tmp_path):
    documents, rows = [], []
    for n_threads in ("1", "2"):
        path = tmp_path / f"{n_threads}.npz"
        out = evaluated(Oracle(toy_corpus, 0.05), "--json", "--threads", n_threads, "--rows", str(path))
        documents.append(document_of(out) | {"seconds_per_frame": 0})
        rows.append(dict(np.load(path)))
    assert documents[0] == documents[1]
    for name in rows[0].keys() - {"seconds"}:
        np.testing.assert_array_equal(rows[0][name], rows[1][name])


def test_the_rows_hold_answers_and_truth(evaluated, toy_corpus, tmp_path):
    path = tmp_path / "rows.npz"
    document = document_of(evaluated(Oracle(toy_corpus, 0.05), "--json", "--rows", str(path), "--limit", "7"))
    (results,), context = read_results(path)
    assert context["corpus"] == document["corpus"]
    assert len(results.truths) == document["n_frames"] == 7
    np.testing.assert_array_equal(results.truths.xyz, toy_corpus.arrays("joints", results.truths.frame))
    error = np.linalg.norm(results.proposals[:, :, 0] - results.truths.xyz, axis=2)
    assert (error <= 0.1).mean() == document["accuracy_10cm"]


def test_only_the_joints_of_the_model_are_scored(evaluated, toy_corpus):
    document = document_of(evaluated(Oracle(toy_corpus, joints=("torso", "head")), "--json"))
    assert list(document["by_joint"]) == ["torso", "head"]
    assert document["n_joints"] == 60
    assert document["map_10cm"] == 1.0


def test_the_table_shows_states_and_joints(evaluated, toy_corpus):
    lines = evaluated(Oracle(toy_corpus, 0.05)).splitlines()
    assert "30 frames" in lines[0]
    words = [line.split()[0] for line in lines[2:] if line.strip()]
    assert words[:4] == ["all", "occluded", "non_occluded", "visible"]
    assert set(JOINT_NAMES) < set(words)
    assert max(map(len, lines)) <= 110


def test_pixels_can_be_left_out(evaluated, toy_corpus):
    assert document_of(evaluated(Oracle(toy_corpus), "--json", "--no-pixels"))["pixels"] is None


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--split", "tset"), "split 'tset' is unknown; known are train, val, test"),
        (("--sensor", "kinect_v9"), "sensor 'kinect_v9' is unknown"),
    ],
)
def test_wrong_options_are_one_line(evaluated, toy_corpus, options, sentence, monkeypatch, capsys):
    evaluated(Blind())
    assert main(["evaluate", "m", str(toy_corpus.path), *options]) == 1
    err = capsys.readouterr().err
    assert sentence in err
    assert err.count("\n") == 1


def test_a_corpus_without_the_split_is_told(order, tmp_path, evaluated, toy_corpus, capsys):
    evaluated(Blind())
    write_corpus(tmp_path / "c", order(3))
    assert main(["evaluate", "m", str(tmp_path / "c")]) == 1
    assert "has no frames of the split test" in capsys.readouterr().err


def test_a_forest_is_read_from_its_file(tmp_path):
    path = tmp_path / "stump.safetensors"
    save_model(path, stump())
    contestant, about = open_model(path)
    assert contestant.method == "stump"
    assert contestant.joints == JOINT_NAMES
    assert contestant.labeller is not None
    assert len(contestant.labeller.classes) == 38
    assert about["kind"] == "oarf"
    assert about["config"]["mode"] == "semantic"
    assert len(about["digest"]) == 64


def test_a_file_that_is_no_forest_is_one_line(tmp_path, toy_corpus, capsys):
    foreign, other = tmp_path / "foreign", tmp_path / "other"
    foreign.write_text("no model, but long enough to be one")
    write_model(other, "tree house", {}, {})
    expected = {
        tmp_path / "nothing": "there is no model file",
        foreign: "is no model file",
        other: "of kind 'tree house'; known are oarf, rwf",
    }
    for path, sentence in expected.items():
        assert main(["evaluate", str(path), str(toy_corpus.path)]) == 1
        err = capsys.readouterr().err
        assert sentence in err
        assert err.count("\n") == 1


def test_an_unknown_joint_and_a_wrong_shape_are_told(toy_corpus):
    indices = toy_corpus.split("test")[:2]
    frames, truths = CorpusFrames(toy_corpus, indices), read_truths(toy_corpus, indices)
    with pytest.raises(UserError, match="joints tail are unknown"):
        predict_frames(Contestant("forest", Blind(), ("tail",)), frames, truths)
    with pytest.raises(
        UserError, match=r"returned proposals of shape \(15, 1, 3\), must be \(2, n_proposals, 3\)"
    ):
        predict_frames(Contestant("forest", Blind(), ("head", "neck")), frames, truths)


def test_the_truth_names_what_hides_a_joint(toy_corpus):
    truths = read_truths(toy_corpus, toy_corpus.indices)
    is_occluded = truths.state == JointState.OCCLUDED
    assert (truths.hiding_class[~is_occluded] == 0).all()
    tables = toy_corpus.arrays("occluder")
    for place in np.flatnonzero(is_occluded.any(axis=1))[:40]:
        u, v = np.rint(Corpus.camera(toy_corpus, place).project(truths.xyz[place])).astype(int).T
        for joint in np.flatnonzero(is_occluded[place]):
            if tables[place, v[joint], u[joint]]:
                assert truths.hiding_class[place, joint] == OCCLUDER_CODE["table"]
    has_table = truths.object_classes == 1 << OCCLUDER_CODE["table"]
    assert (has_table == (truths.frame % 4 != 0)).all()
    assert truths.families == ("free", "table")
