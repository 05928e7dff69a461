"""Joints that a data set defines otherwise: the offset is found on other frames, and turns with people."""

import functools
import json
from dataclasses import replace

import numpy as np
import pytest
from toy_results import results_of, truths_of
from toy_source import ToySource

from forests.estimate import JointEstimate
from pipelines.cli import main
from pipelines.corpus import Corpus, Order, write_corpus
from pipelines.corpus.sequence import CorpusFrames
from pipelines.metrics.offsets import LEAST_FRAMES, body_axes, frames_apart, learn_offsets, upwards, with_offsets
from pipelines.metrics.results import read_results
from pipelines.models.asking import Contestant
from synth.vocabulary import JOINT_NAMES

JOINTS = ("head", "r_shoulder", "l_shoulder")
SHIFT = np.array([[0.08, 0.0, -0.02], [0.05, -0.03, 0.1], [0.0, 0.06, 0.0]])
"""What is called the joint beside what is answered: forward, left, up [m]."""


def turned(n=80, error=0.0, seed=0):
    """People turned any way before tilted cameras; the answers, the vertical, and the body's axes."""
    rng = np.random.default_rng(seed)
    tilt, heading = rng.uniform(-0.5, 0.5, n), rng.uniform(0, 2 * np.pi, n)
    up = np.stack([np.zeros(n), -np.cos(tilt), -np.sin(tilt)], axis=1)
    ahead = np.stack([np.zeros(n), -np.sin(tilt), np.cos(tilt)], axis=1)
    right = np.broadcast_to([1.0, 0.0, 0.0], (n, 3))
    forward = np.cos(heading)[:, None] * ahead + np.sin(heading)[:, None] * right
    left = np.cross(up, forward)
    middle = np.array([0.0, 0.0, 2.5]) + rng.normal(size=(n, 3)) * 0.2
    answers = np.stack([middle + 0.3 * up, middle - 0.2 * left, middle + 0.2 * left + 0.02 * up], axis=1)
    axes = np.stack([forward, left, up], axis=2)
    truths = answers + np.einsum("nij,kj->nki", axes, SHIFT) + rng.normal(size=answers.shape) * error
    results = results_of(replace(truths_of(n, joints=JOINTS), xyz=truths.astype(np.float32)), k=2, missing=0)
    proposals = np.stack([answers, answers + 1.0], axis=2).astype(np.float32)
    return replace(results, proposals=proposals), up, axes


def test_the_bodys_axes_turn_with_the_person_and_are_upright():
    results, up, axes = turned()
    np.testing.assert_allclose(body_axes(results, up), axes, atol=1e-5)
    assert np.linalg.det(body_axes(results, up)) == pytest.approx(1.0, abs=1e-6)


def test_offsets_of_a_data_set_are_recovered_and_taken_away():
    results, up, _ = turned()
    offsets = learn_offsets(results, up)
    np.testing.assert_allclose(offsets.metres, SHIFT, atol=1e-5)
    other, up, _ = turned(seed=1)
    moved = with_offsets(other, up, offsets)
    np.testing.assert_allclose(moved.proposals[:, :, 0], other.truths.xyz, atol=1e-5)
    between = moved.proposals[:, :, 1] - moved.proposals[:, :, 0]
    np.testing.assert_allclose(between, other.proposals[:, :, 1] - other.proposals[:, :, 0], atol=1e-5)
    assert moved.proposal_confidence is other.proposal_confidence


def test_misses_and_noise_move_offsets_little():
    """A third of the answers half a metre off, the rest by a centimetre."""
    results, up, _ = turned(300, error=0.01)
    proposals = results.proposals.copy()
    proposals[::3] += np.float32(0.5) * np.float32([1, 0, 0])
    offsets = learn_offsets(replace(results, proposals=proposals), up)
    np.testing.assert_allclose(offsets.metres, SHIFT, atol=0.005)
    assert (offsets.n_frames == 200).all()


def test_joints_that_are_unknown_unanswered_or_mostly_missed_stay():
    results, up, _ = turned(40)
    xyz, proposals = results.truths.xyz.copy(), results.proposals.copy()
    xyz[:, 0] = np.nan
    proposals[8:, 1] += 1.0
    proposals[:, 2] = np.nan
    spoiled = replace(results, truths=replace(results.truths, xyz=xyz), proposals=proposals)
    offsets = learn_offsets(spoiled, up)
    assert not offsets.metres.any()
    assert offsets.values() == dict.fromkeys(JOINTS)
    moved = with_offsets(spoiled, up, offsets)
    np.testing.assert_array_equal(moved.proposals, spoiled.proposals)
    few = learn_offsets(*_first(results, up, LEAST_FRAMES - 1))
    assert not few.n_frames.any()


def _first(results, up, n):
    of_frames = {name: v[:n] for name, v in vars(results.truths).items() if isinstance(v, np.ndarray)}
    answers = ("proposals", "proposal_confidence", "probability", "hidden_probability", "seconds")
    cut = {name: getattr(results, name)[:n] for name in answers}
    return replace(results, truths=replace(results.truths, **of_frames), **cut), up[:n]


def test_without_shoulders_people_face_the_camera():
    results, up, _ = turned(20)
    lone = results.of_joints(["head"])
    forward = body_axes(lone, up)[:, :, 0]
    towards = -lone.proposals[:, 0, 0].astype(float)
    assert ((forward * towards).sum(axis=1) > 0).all()
    np.testing.assert_allclose((forward * up).sum(axis=1), 0.0, atol=1e-9)
    nothing = replace(lone, proposals=np.full_like(lone.proposals, np.nan))
    for vertical in ((0, -1, 0), (0, 0, -1), (0, -0.6, -0.8), (1, 0, 0)):
        axes = body_axes(nothing, np.tile(np.float64(vertical), (20, 1)))
        np.testing.assert_allclose(axes.swapaxes(1, 2) @ axes, np.tile(np.eye(3), (20, 1, 1)), atol=1e-9)


# The command


class AllTest(ToySource):
    """All frames are of one split."""

    def split_of(self, index):
        return "test"


class Lower:
    """Knows every frame by its depth image, and answers all joints 12 cm lower than the corpus has them."""

    def __init__(self, corpus):
        up = upwards(corpus, corpus.indices)
        frames = CorpusFrames(corpus, corpus.indices)
        places = range(len(frames))
        self.answers = {frames[i].depth.tobytes(): frames[i].joints - 0.12 * up[i] for i in places}

    def predict(self, depth, camera, box=None):
        n = len(JOINT_NAMES)
        proposals = self.answers[depth.tobytes()][:, None].astype(np.float32)
        unknown = np.full(n, np.nan, np.float32)
        return JointEstimate(proposals, np.ones((n, 1), np.float32), unknown, unknown, unknown, camera)


@pytest.fixture(scope="module")
def unsplit(tmp_path_factory):
    root = tmp_path_factory.mktemp("corpus") / "unsplit"
    write_corpus(root, Order(3, 40, {"toy": True}, functools.partial(AllTest, 3, 40)))
    return Corpus.open(root)


@pytest.fixture
def evaluated(monkeypatch, capsys):
    def run(corpus, *options, code=0):
        contestant = Contestant("forest", Lower(corpus), JOINT_NAMES)
        monkeypatch.setattr(
            "pipelines.commands.evaluate.open_model", lambda path, _: (contestant, {"name": "forest"})
        )
        assert main(["evaluate", "forest", str(corpus.path), "--resamples", "5", *options]) == code
        return capsys.readouterr()

    return run


def test_both_scores_are_told_and_the_frames_that_taught_are_of_other_splits(evaluated, toy_corpus, tmp_path):
    rows = tmp_path / "rows.npz"
    document = json.loads(evaluated(toy_corpus, "--joint-offsets", "20", "--json", "--rows", str(rows)).out)
    learned = document["joint_offsets"]
    assert document["accuracy_10cm"] == 0.0
    assert document["mean_error_cm"] == pytest.approx(12.0, abs=1e-3)
    assert learned["scores"]["map_10cm"] == learned["scores"]["accuracy_10cm"] == 1.0
    assert learned["scores"]["mean_error_cm"] == pytest.approx(0.0, abs=1e-3)
    assert learned["by_joint"]["l_knee"]["up_cm"] == pytest.approx(12.0, abs=1e-3)
    assert learned["by_joint"]["l_knee"]["n_frames"] == len(learned["frames"]) == 20
    assert learned["splits"] == ["train", "val"]
    assert not np.isin(learned["frames"], toy_corpus.split("test")).any()
    assert document["configuration"]["joint_offsets"] == 20
    plain = json.loads(evaluated(toy_corpus, "--json").out)
    assert plain["joint_offsets"] is None
    assert plain["by_joint"] == document["by_joint"]
    (results,), _ = read_results(rows)
    assert np.linalg.norm(results.proposals[:, :, 0] - results.truths.xyz, axis=2).min() > 0.11


def test_of_one_split_alone_the_first_frames_teach_and_the_rest_is_scored(evaluated, unsplit):
    document = json.loads(evaluated(unsplit, "--joint-offsets", "15", "--json").out)
    assert document["joint_offsets"]["frames"] == list(range(15))
    assert document["joint_offsets"]["splits"] == ["test"]
    assert document["n_frames"] == document["joint_offsets"]["scores"]["n_frames"] == 25
    told = evaluated(unsplit, "--joint-offsets", "15").out
    assert "offsets learned on 15 frames of test, numbers 0..14" in told
    assert "with these offsets:" in told
    refused = evaluated(unsplit, "--joint-offsets", "40", code=1).err
    assert "joint_offsets=40 uses all 40 frames of test, so none is left to score" in refused


def test_frames_that_teach_are_spread_and_never_scored(toy_corpus, unsplit):
    for corpus, n in ((toy_corpus, 7), (toy_corpus, 1000), (unsplit, 3), (unsplit, 0)):
        learning, scored = frames_apart(corpus, "test", n)
        assert not np.isin(learning, scored).any()
        assert len(learning) == min(n, 170 if corpus is toy_corpus else n)
    learning, _ = frames_apart(toy_corpus, "test", 17)
    assert (np.diff(learning) == 10).all()
