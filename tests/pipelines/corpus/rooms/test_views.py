"""People of rooms as frames that forests learn from: labels, places, and what votes for nothing."""

import json
from dataclasses import replace

import numpy as np
import pytest

from forests.growing import GrowthConfig
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.train import train
from pipelines.cli import main
from pipelines.corpus import Corpus, write_corpus
from pipelines.corpus.joined import JoinedFrames, frames_of, open_corpora
from pipelines.corpus.rooms.matching import truths_of
from pipelines.corpus.rooms.views import OTHER_PEOPLE, PeopleFrames, people_of
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import CorpusError
from pipelines.generation.drawn import drawn_order
from pipelines.metrics.truths import truths_of_frames
from synth.scene.config import SceneConfig, SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.vocabulary import MAX_PEOPLE, N_PARTS, OCCLUDER_CLASSES, SURFACE_CLASSES, JointState

GROWTH = GrowthConfig(max_depth=5, n_candidates=20)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    root = tmp_path_factory.mktemp("rooms") / "corpus"
    scene = SceneConfig(
        camera="custom",
        intrinsics=(256, 212, 182.0, 182.0, 127.5, 105.5),
        splits=SplitShares(0.6, 0.2, 0.2),
        room=RoomConfig(kinds=RoomWeights(1.0, 1.0, 1.0)),
        people=PeopleConfig(number=(2, 4), visible=(0.5, 1.0)),
    )
    write_corpus(root, drawn_order(scene, 11, 8))
    return Corpus.open(root)


@pytest.fixture(scope="module")
def people(corpus):
    return people_of(corpus, corpus.indices)


def test_those_are_frames_who_ought_to_be_found(corpus, people):
    wanted = [
        (int(index), k)
        for index in corpus.indices
        for k in np.flatnonzero(truths_of(corpus.scene(int(index))).is_wanted)
    ]
    assert people.tolist() == [list(pair) for pair in wanted]
    assert len(people) >= 8


@pytest.mark.parametrize("place", ["near", "true", "found", "mask"])
def test_labels_say_whose_pixels_are_whose(corpus, people, place):
    frames = PeopleFrames(corpus, people, "kinect_v2", place)
    labels = frames.labels
    assert labels.occluders == OCCLUDER_CLASSES[1:]
    assert labels.surroundings == (*SURFACE_CLASSES, OTHER_PEOPLE)
    n_seen = 0
    for place_of_frame, (number, k) in enumerate(people):
        frame, scene = frames[place_of_frame], corpus.scene(int(number), "kinect_v2")
        assert ((frame.label > 0) == (frame.depth > 0))[scene.depth > 0].all()
        np.testing.assert_array_equal(frame.depth[frame.depth > 0], scene.depth[frame.depth > 0])
        is_own = (scene.person == k + 1) & (frame.depth > 0)
        np.testing.assert_array_equal(frame.label[is_own], scene.part[is_own])
        is_other = (scene.person > 0) & (scene.person != k + 1) & (frame.depth > 0)
        assert (frame.label[is_other] == labels.n_labels).all()
        is_thing = (scene.occluder > 0) & (frame.depth > 0)
        np.testing.assert_array_equal(frame.label[is_thing], scene.occluder[is_thing] + N_PARTS)
        np.testing.assert_array_equal(frame.joints, scene.people[k].joints)
        assert frame.body_label.any()
        n_seen += bool(is_own.any())
        if place == "mask":
            assert not is_other.any()
            assert is_own[(scene.person == k + 1) & (scene.depth > 0)].all()
            assert frame.label.max() <= N_PARTS + len(OCCLUDER_CLASSES) - 1
    assert n_seen >= (len(people) if place != "found" else 0.8 * len(people))


def test_places_near_the_truth_keep_the_person_and_differ_from_it(corpus, people):
    near, true = (PeopleFrames(corpus, people, place=place) for place in ("near", "true"))
    shares = []
    for k in range(len(people)):
        own = near[k].label[true[k].label > 0]
        shares.append((own > 0).mean())
        np.testing.assert_array_equal(near[k].depth, PeopleFrames(corpus, people)[k].depth)
    assert 0.9 < np.mean(shares) < 1.0


def test_only_the_finder_gives_boxes(corpus, people):
    found = [PeopleFrames(corpus, people, place="found")[k] for k in range(len(people))]
    for frame in found:
        assert (frame.box is None) == (not frame.depth.any())
    assert PeopleFrames(corpus, people)[0].box is None


def test_truths_have_a_row_for_everybody(corpus, people):
    truths = truths_of_frames(PeopleFrames(corpus, people))
    assert truths.frame.tolist() == [n * MAX_PEOPLE + k for n, k in people.tolist()]
    for row, (number, k) in enumerate(people.tolist()):
        view = corpus.scene(number).people[k]
        np.testing.assert_array_equal(truths.xyz[row], view.joints)
        is_hidden = np.isin(view.joint_state, (JointState.OCCLUDED, JointState.OCCLUDED_BY_PERSON))
        np.testing.assert_array_equal(truths.state[row] == JointState.OCCLUDED, is_hidden)


def test_what_votes_for_nothing_has_classes_and_no_votes(corpus, people):
    """A forest whose surroundings are objects votes from them; where they are surroundings it does not."""
    frames = PeopleFrames(corpus, people)
    config = OARFConfig(n_trees=1, n_pixels=40, n_occluder_pixels=40, learn_skeleton=False, growth=GROWTH)

    class AsObjects(PeopleFrames):
        @property
        def labels(self):
            table = super().labels
            return replace(table, occluders=(*table.occluders, *table.surroundings), surroundings=())

    silent, loud = train(frames, config), train(AsObjects(corpus, people), config)
    assert silent.classes.names == loud.classes.names
    assert (silent.classes.n_silent, loud.classes.n_silent) == (5, 0)
    np.testing.assert_array_equal(silent.trees[0].nodes, loud.trees[0].nodes)
    n_silent, n_loud = (len(model.trees[0].leaves.weight) for model in (silent, loud))
    assert 0 < n_silent < n_loud


@pytest.mark.parametrize("mode", ["baseline", "occluders", "semantic"])
def test_classes_of_surroundings_are_the_last(corpus, people, mode):
    labels = PeopleFrames(corpus, people).labels
    table = ClassTable.of(labels, mode)
    of_label = table.of_label(labels)
    assert len(of_label) == labels.n_labels + 1
    if mode == "baseline":
        assert table.n_silent == 0
        return
    assert table.names[-5:] == labels.surroundings
    n_others = table.n_classes - 5
    assert of_label[-5:].tolist() == list(range(n_others, n_others + 5))
    assert of_label[1 : N_PARTS + 1].tolist() == list(range(N_PARTS))
    assert (of_label[N_PARTS + 1 : -5] < n_others).all()


def test_rooms_and_single_people_are_learned_from_together(corpus, toy_corpus):
    corpora = open_corpora([corpus.path, toy_corpus.path])
    frames = JoinedFrames(tuple(frames_of(one, one.split("train")[:4], None) for one in corpora))
    assert frames.labels.surroundings[-1] == OTHER_PEOPLE
    assert len(frames) == len(people_of(corpus, corpus.split("train")[:4])) + 4
    assert frames[len(frames) - 1].label.max() <= frames.labels.n_labels


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("oarf", ("--n-trees", 1, "--n-pixels", 30, "--growth.max-depth", 4, "--growth.n-candidates", 10)),
        ("rwf", ("--n-trees", 1, "--n-points", 10, "--growth.max-depth", 4, "--growth.n-candidates", 10)),
    ],
)
def test_forests_are_trained_on_rooms(corpus, tmp_path, capsys, kind, words):
    out = tmp_path / "model.safetensors"
    words = ("train", kind, corpus.path, "--out", out, "--no-learn-skeleton", *words)
    assert main([str(word) for word in words]) == 0
    assert "people in rooms of" in capsys.readouterr().out
    words = ("predict", out, "--corpus", corpus.path, "--frame", 0, 1, "--out", tmp_path / "out")
    assert main([str(word) for word in words]) == 0
    lines = [json.loads(line) for line in (tmp_path / "out" / "skeletons.jsonl").read_text().splitlines()]
    assert any(line.get("found") for line in lines)


def test_single_people_are_no_rooms_and_the_other_way_round(corpus, toy_corpus):
    with pytest.raises(CorpusError, match="holds single people"):
        PeopleFrames(toy_corpus, np.zeros((1, 2), np.int64))
    with pytest.raises(CorpusError, match="holds whole scenes"):
        CorpusFrames(corpus, corpus.indices)
