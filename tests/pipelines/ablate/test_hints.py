"""What oracles tell of a frame."""

import json
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from forests import load_model
from forests.growing import GrowthConfig
from forests.oarf.config import OARFConfig
from pipelines.ablate.config import AblationConfig, Told
from pipelines.ablate.hints import N_DIRECTIONS, frames_told, heading_facts
from pipelines.ablate.models import read_contestant, train_model
from pipelines.ablate.plan import scoring
from pipelines.cli import main
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import CorpusError
from pipelines.metrics import read_truths
from pipelines.models.asking import predict_frames
from synth.bodies.poses.families import FAMILIES
from synth.vocabulary import JOINT_NAMES

CONFIG = AblationConfig()


def person(turned: float, azimuth: float = 0.0) -> np.ndarray:
    """(15, 3) joints of someone who faces so far from the camera, and stands in that direction [rad]."""
    joints = np.zeros((15, 3), np.float32)
    for name, side in (("shoulder", 0.2), ("hip", 0.1)):
        for letter, sign in (("l", 1.0), ("r", -1.0)):
            at = np.array([np.cos(turned - azimuth), 0.0, np.sin(turned - azimuth)]) * sign * side
            place = 2.0 * np.array([np.sin(azimuth), -0.2, np.cos(azimuth)])
            joints[JOINT_NAMES.index(f"{letter}_{name}")] = at + place
    return joints


def frames_of(corpus, split="test"):
    return CorpusFrames(corpus, corpus.split(split))


def test_a_heading_is_told_as_cosines():
    turns = np.linspace(-np.pi, np.pi, 37)
    for turn in turns:
        expected = 1000 * np.cos(turn - np.arange(N_DIRECTIONS) * np.pi / N_DIRECTIONS)
        for azimuth in (-0.5, 0.0, 0.4):
            assert np.abs(heading_facts(person(turn, azimuth)) - expected).max() <= 0.51
    assert np.array_equal(heading_facts(person(0.3)), -heading_facts(person(0.3 + np.pi)))
    assert not heading_facts(np.full((15, 3), np.nan, np.float32)).any()
    assert not heading_facts(np.zeros((15, 3), np.float32)).any()


def test_a_mask_tells_person_and_objects_apart_and_classes_name_them(toy_corpus):
    frames = frames_of(toy_corpus)
    masks, named = frames_told(frames, "mask"), frames_told(frames, "classes")
    n_objects = 0
    for place in range(len(frames)):
        frame = toy_corpus.frame(int(frames.indices[place]))
        mask, classes = masks[place].hints.classes, named[place].hints.classes
        assert np.array_equal(mask, np.where(frame.occluder > 0, 2, frame.part > 0))
        assert np.array_equal(classes, np.where(frame.occluder > 0, 1 + frame.occluder, frame.part > 0))
        n_objects += (frame.occluder > 0).sum()
    assert n_objects > 0


@pytest.fixture
def recorded(toy_corpus, monkeypatch):
    """The toy corpus with records as generated frames have them; change them by `recorded(...)`."""
    info = toy_corpus.info

    def with_records(**changes):
        families = list(FAMILIES)

        def told(number):
            subject = {"stature": 1.2 + 0.005 * number}
            family = families[number % len(families)]
            return replace(info(number), **({"subject": subject, "pose_family": family} | changes))

        monkeypatch.setattr(toy_corpus, "info", told)
        return toy_corpus

    return with_records


def test_posture_and_size_are_those_of_the_record(recorded):
    toy_corpus = recorded()
    frames = frames_of(toy_corpus)
    postures, sizes = frames_told(frames, "posture"), frames_told(frames, "size")
    for place, number in enumerate(frames.indices):
        info = toy_corpus.info(int(number))
        facts = postures[place].hints.facts
        assert np.flatnonzero(facts).tolist() == [list(FAMILIES).index(info.pose_family)]
        assert sizes[place].hints.facts[0] == pytest.approx(1000 * info.subject["stature"] - 1500, abs=0.51)


def test_nothing_but_hints_is_added(recorded):
    toy_corpus = recorded()
    frames = frames_of(toy_corpus)
    assert frames_told(frames, None) is frames
    assert frames_told(frames, "predicted") is frames
    for told in set(get_args(Told)) - {"predicted"}:
        with_hints = frames_told(frames, told)
        assert (len(with_hints), with_hints.labels) == (len(frames), frames.labels)
        plain, frame = frames[0], with_hints[0]
        assert plain.hints is None
        assert (frame.hints.classes is not None) == (told in ("mask", "classes"))
        assert (len(frame.hints.facts) > 0) == (told not in ("mask", "classes"))
        assert np.array_equal(plain.depth, frame.depth)
        assert np.array_equal(plain.joints, frame.joints)


@pytest.mark.parametrize(
    ("told", "changes", "message"),
    [
        ("size", {"subject": {}}, "does not tell the person's stature"),
        ("posture", {"pose_family": "flying"}, "is of no known family of poses, but 'flying'"),
    ],
)
def test_records_that_do_not_tell_are_refused(recorded, told, changes, message):
    with pytest.raises(CorpusError, match=message):
        frames_told(frames_of(recorded(**changes)), told)[0]


def test_an_oracle_is_told_when_it_is_scored_and_refused_elsewhere(toy_corpus, tmp_path, capsys):
    """With what `ablate` does of a training and a scoring, on the toy corpus."""
    growth = GrowthConfig(max_depth=4, n_candidates=20, n_finalists=5)
    numbers = {"n_trees": 1, "n_pixels": 60, "n_occluder_pixels": 60, "n_voting_pixels": 50}
    config = OARFConfig(**numbers, learn_skeleton=False, growth=growth)
    train, val, test = (frames_told(frames_of(toy_corpus, split), "classes") for split in ("train", "val", "test"))
    path = tmp_path / "oracle.safetensors"
    job = scoring(replace(CONFIG, models={**CONFIG.models, "oarf": config}), "semantic", 0)
    job = replace(job, training=replace(job.training, told="classes"))
    train_model(job.training, toy_corpus.digest, train, val, path, 1, lambda share: None)
    contestant = read_contestant(job, path)
    assert contestant.predictor.asks_for_hints
    truths = read_truths(toy_corpus, test.frames.indices)
    results, confusion = predict_frames(contestant, test, truths)
    assert np.isfinite(results.proposals[:, :, 0]).any()
    assert confusion is None
    with pytest.raises(ValueError, match="ask for hints"):
        predict_frames(contestant, test.frames, truths)
    assert main(["evaluate", str(path), str(toy_corpus.path)]) == 1
    said = capsys.readouterr().err
    assert "its trees ask for more than depth" in said


TINY = """
rows = ["semantic"]
n_resamples = 20
questions = ["oracles"]

[corpus]
train_frames = 8
val_frames = 3
test_frames = 4
seed = 3

[corpus.scene]
camera = "custom"
intrinsics = [160, 120, 142.0, 142.0, 79.5, 59.5]

[oarf]
learn_skeleton = false
n_trees = 1
n_pixels = 60
n_occluder_pixels = 60
n_voting_pixels = 50
growth = { max_depth = 6, n_candidates = 20, n_finalists = 5 }
"""


@pytest.mark.slow
def test_the_ablation_tells_by_how_much_each_oracle_is_better(tmp_path, capsys):
    toml, out = tmp_path / "tiny.toml", tmp_path / "out"
    toml.write_text(TINY)
    assert main(["ablate", "--size", "demo", "--config", str(toml), "--out", str(out), "--threads", "1"]) == 0
    assert "semantic - semantic told mask" in capsys.readouterr().out
    document = json.loads((out / "ablation.json").read_text())
    conditions = {item["settings"]["told"]: item for item in document["questions"]["oracles"]}
    assert list(conditions) == ["nothing", *get_args(Told)]
    nothing = conditions["nothing"]["rows"]["semantic"]
    assert nothing["map_10cm"] == document["main"]["rows"]["semantic"]["map_10cm"]
    for told in get_args(Told):
        row, gaps = conditions[told]["rows"]["semantic"], conditions[told]["differences"]
        gap = gaps["semantic - semantic told nothing"]
        assert gap["map_10cm"]["first"] == pytest.approx(row["map_10cm"])
        assert gap["map_10cm"]["second"] == pytest.approx(nothing["map_10cm"])
        assert gap["occluded"].keys() == gap["visible"].keys()
        assert row["pixels"] == [None]
        assert ("semantic - semantic told mask" in gaps) == (told == "classes")
    models = {
        told: out / item["rows"]["semantic"]["trainings"][0]["model"]["file"] for told, item in conditions.items()
    }
    assert load_model(models["predicted"]).model.context is not None
    assert all(tree.hints is None for tree in load_model(models["nothing"]).model.trees)
