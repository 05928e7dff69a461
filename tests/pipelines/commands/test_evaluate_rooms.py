"""undergrowth evaluate on whole scenes: everybody who ought to be found, at true places or where they are found."""

import json

import numpy as np
import pytest

from forests.estimate import JointEstimate
from pipelines.cli import main
from pipelines.corpus import Corpus, write_corpus
from pipelines.corpus.rooms.views import PeopleFrames, people_of
from pipelines.generation.drawn import drawn_order
from pipelines.metrics.resampling import draw_frames, draw_together
from pipelines.models.asking import contestant_of
from synth.scene.config import SceneConfig, SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.vocabulary import JOINT_NAMES

SENSOR = "kinect_v2"


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    scene = SceneConfig(
        camera="custom",
        intrinsics=(256, 212, 182.0, 182.0, 127.5, 105.5),
        splits=SplitShares(1.0, 1.0, 8.0),
        room=RoomConfig(kinds=RoomWeights(1.0, 1.0, 1.0)),
        people=PeopleConfig(number=(2, 3), visible=(0.2, 1.0)),
    )
    root = tmp_path_factory.mktemp("rooms") / "corpus"
    write_corpus(root, drawn_order(scene, 21, 10))
    return Corpus.open(root)


class Oracle:
    """Knows everybody by the image in which they are asked about, and nobody by an empty one."""

    joints, box_joints = JOINT_NAMES, ()

    def __init__(self, frames):
        self.n_empty, self.by_depth = 0, {}
        for place in range(len(frames)):
            frame = frames[place]
            self.n_empty += not frame.depth.any()
            self.by_depth[frame.depth.tobytes()] = frame.joints

    def predict(self, depth, camera, box=None):
        joints = self.by_depth[depth.tobytes()] if depth.any() else np.full((15, 3), np.nan, np.float32)
        unknown = np.full(15, np.nan, np.float32)
        sure = np.where(np.isfinite(joints[:, :1]), 1.0, 0.0).astype(np.float32)
        return JointEstimate(joints[:, None].astype(np.float32), sure, unknown, unknown, unknown, camera)


@pytest.fixture
def scored(rooms, monkeypatch, capsys):
    def run(frames, *options):
        oracle = Oracle(frames)
        about = {"name": "forest.safetensors", "digest": "00", "config": {}}
        opened = contestant_of("forest", oracle), about
        monkeypatch.setattr("pipelines.commands.evaluate.open_model", lambda path, _: opened)
        words = [
            "evaluate",
            "forest.safetensors",
            str(rooms.path),
            "--sensor",
            SENSOR,
            "--resamples",
            "20",
            *options,
        ]
        assert main(words) == 0
        return oracle, capsys.readouterr().out

    return run


def test_at_their_true_places_everybody_who_ought_to_be_found_is_scored(rooms, scored):
    people = people_of(rooms, rooms.split("test"))
    frames = PeopleFrames(rooms, people, SENSOR, "true")
    _, out = scored(frames, "--json")
    document = json.loads(out)
    assert document["n_frames"] == len(people) > 5
    assert document["n_scenes"] == len(np.unique(people[:, 0]))
    assert document["accuracy_10cm"] == document["map_10cm"] == 1.0
    assert document["configuration"]["found"] is False
    _, table = scored(frames)
    assert f"{len(people)} people in {document['n_scenes']} scenes, cut out at their true places" in table


def test_who_is_not_found_counts_as_wrong(rooms, scored):
    people = people_of(rooms, rooms.split("test"))
    oracle, out = scored(PeopleFrames(rooms, people, SENSOR, "found"), "--found", "--json")
    document = json.loads(out)
    assert document["n_frames"] == len(people)
    assert document["missing"] == pytest.approx(oracle.n_empty / len(people))
    assert document["accuracy_10cm"] == pytest.approx(1.0 - oracle.n_empty / len(people))
    assert 0 <= oracle.n_empty < len(people) / 2


@pytest.fixture
def blind(monkeypatch):
    opened = contestant_of("forest", Blind()), {}
    monkeypatch.setattr("pipelines.commands.evaluate.open_model", lambda path, _: opened)


def test_offsets_of_joints_are_not_learned_in_rooms(rooms, blind, capsys):
    assert main(["evaluate", "forest.safetensors", str(rooms.path), "--joint-offsets", "3"]) == 1
    assert "--joint-offsets is for frames of one person" in capsys.readouterr().err


def test_a_split_in_which_nobody_ought_to_be_found_is_one_sentence(rooms, blind, monkeypatch, capsys):
    monkeypatch.setattr("pipelines.corpus.rooms.views.MIN_VISIBLE", 1.1)
    assert main(["evaluate", "forest.safetensors", str(rooms.path)]) == 1
    assert "has nobody in the split test who ought to be found" in capsys.readouterr().err


class Blind:
    joints, box_joints = JOINT_NAMES, ()


def test_found_people_are_asked_for_in_rooms_alone(toy_corpus, blind, capsys):
    assert main(["evaluate", "forest.safetensors", str(toy_corpus.path), "--found"]) == 1
    assert "holds single people; --found is for corpora of rooms" in capsys.readouterr().err


def test_people_of_one_scene_are_drawn_together():
    scene = np.array([3, 3, 5, 9, 9, 9])
    weights = draw_together(scene, 50, np.random.default_rng(1))
    assert weights.shape == (50, 6)
    assert (weights[:, :2] == weights[:, :1]).all()
    assert (weights[:, 3:] == weights[:, 3:4]).all()
    assert (weights[:, [0, 2, 3]].sum(axis=1) == 3).all()
    alone = draw_together(np.array([2, 4, 7]), 50, np.random.default_rng(2))
    np.testing.assert_array_equal(alone, draw_frames(3, 50, np.random.default_rng(2)))
