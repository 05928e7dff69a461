"""Scores of several cameras: whole scenes, who counts, and that cameras that help each other score better."""

import numpy as np
import pytest

from forests.estimate import JointEstimate
from pipelines import Corpus
from pipelines.corpus import write_corpus
from pipelines.generation.drawn import drawn_order
from pipelines.metrics.views import view_lines, whole_scenes
from pipelines.models.asking import contestant_of
from pipelines.models.scoring import Scoring, score_model
from synth.scene import SceneConfig
from synth.scene.config import SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.vocabulary import JOINT_NAMES

SMALL = {"camera": "custom", "intrinsics": (160, 132, 114.0, 114.0, 79.5, 65.5)}
SCORING = Scoring(pixels=False, resamples=40)


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    """Six scenes that three cameras see."""
    config = SceneConfig(
        **SMALL,
        cameras=3,
        room=RoomConfig(kinds=RoomWeights(hall=1.0), furniture=0.3),
        people=PeopleConfig(number=(1, 2)),
        splits=SplitShares(0.0, 0.0, 1.0),
    )
    root = tmp_path_factory.mktemp("views") / "corpus"
    write_corpus(root, drawn_order(config, 4, 18))
    return Corpus.open(root)


class Oracle:
    """Knows everybody's joints by the camera frame's depth at their place; it is off by what it is told to be."""

    joints, box_joints = JOINT_NAMES, ()

    def __init__(self, corpus, off):
        self.off = off
        self.people = [(view.joints, view) for frame in corpus.scenes("test") for view in frame.people]

    def predict(self, depth, camera, box=None):
        # Whoever has most of their own pixels left in the image is meant.
        kept = [_n_kept(depth, view) for _, view in self.people]
        joints = self.people[int(np.argmax(kept))][0]
        proposals = (joints + self.off(joints))[:, None].astype(np.float32)
        ones = np.ones(len(joints), np.float32)
        return JointEstimate(proposals, ones[:, None], 0.8 * ones, 0.0 * ones, 0.0 * ones, camera)


def _n_kept(depth, view):
    """Pixels of an image that show exactly a body layer."""
    return np.count_nonzero((depth[view.window] == view.body_depth) & (view.body_depth > 0))


def scored(corpus, off=lambda joints: 0.0 * joints, **changes):
    contestant = contestant_of("oracle", Oracle(corpus, off))
    scoring = Scoring(**vars(SCORING) | changes)
    return score_model(contestant, {}, corpus, scoring)


def test_true_answers_score_one_wherever_a_camera_answers(rooms):
    views = scored(rooms)["views"]
    assert [(row["n_views"], row["n_sets"]) for row in views] == [(1, 3), (2, 3), (3, 1)]
    assert views[-1]["accuracy_10cm"] == pytest.approx(1.0)
    assert views[-1]["mean_error_cm"] < 0.1
    for row in views:
        assert row["accuracy_10cm"] == pytest.approx(1.0 - row["missing"])
        assert row["n_joints"] == row["n_people"] * row["n_sets"] * len(JOINT_NAMES)
        assert row["n_joints"] == row["visible"]["n_joints"] + row["not_visible"]["n_joints"]
    assert views[0]["missing"] >= views[1]["missing"] >= views[2]["missing"] == 0.0


def test_cameras_correct_each_others_depth(rooms):
    def deeper(joints):
        return 0.12 * joints / np.linalg.norm(joints, axis=1, keepdims=True)

    views = scored(rooms, deeper)["views"]
    assert views[0]["mean_error_cm"] == pytest.approx(12.0, abs=0.1)
    assert views[1]["mean_error_cm"] < 11.0
    assert views[2]["mean_error_cm"] < views[1]["mean_error_cm"]


def test_a_limit_keeps_all_cameras_of_a_scene(rooms):
    numbers = rooms.split("test")
    chosen = whole_scenes(rooms, numbers, 7)
    assert len(chosen) == 6
    assert (np.bincount(chosen // 3)[np.unique(chosen // 3)] == 3).all()
    assert len(whole_scenes(rooms, numbers, 1)) == 3
    assert np.array_equal(whole_scenes(rooms, numbers, 0), numbers)
    document = scored(rooms, limit=7)
    assert len(document["views"]) == 3


def test_the_table_has_a_line_for_one_two_and_all(rooms):
    document = scored(rooms)
    lines = list(view_lines(document["views"]))
    assert [line.split()[0] for line in lines[2:]] == ["1", "2", "3"]
    assert list(view_lines(None)) == []


def test_people_who_are_cut_out_are_seen_by_all_cameras(tmp_path):
    config = SceneConfig(**SMALL, cameras=2, rig="front_top", splits=SplitShares(0.0, 0.0, 1.0))
    write_corpus(tmp_path / "pair", drawn_order(config, 4, 4))
    corpus = Corpus.open(tmp_path / "pair")
    joints = {corpus.arrays("depth", [k])[0].tobytes(): corpus.arrays("joints", [k])[0] for k in range(4)}

    class Knowing(Oracle):
        def __init__(self):
            pass

        def predict(self, depth, camera, box=None):
            proposals = joints[depth.tobytes()][:, None].astype(np.float32)
            ones = np.ones(len(proposals), np.float32)
            return JointEstimate(proposals, ones[:, None], ones, 0.0 * ones, 0.0 * ones, camera)

    views = score_model(contestant_of("oracle", Knowing()), {}, corpus, SCORING)["views"]
    assert [(row["n_views"], row["n_people"]) for row in views] == [(1, 2), (2, 2)]
    assert all(row["accuracy_10cm"] == 1.0 and row["missing"] == 0.0 for row in views)
    assert views[1]["mean_error_cm"] < 0.01


def test_rooms_of_one_camera_have_no_views(tmp_path):
    config = SceneConfig(
        **SMALL,
        room=RoomConfig(kinds=RoomWeights(hall=1.0), furniture=0.3),
        people=PeopleConfig(number=(1, 1)),
        splits=SplitShares(0.0, 0.0, 1.0),
    )
    write_corpus(tmp_path / "one", drawn_order(config, 4, 1))
    corpus = Corpus.open(tmp_path / "one")
    contestant = contestant_of("oracle", Oracle(corpus, lambda joints: 0.0 * joints))
    document = score_model(contestant, {}, corpus, SCORING)
    assert document["views"] is None
    assert document["n_scenes"] <= 4
