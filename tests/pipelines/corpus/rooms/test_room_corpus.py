"""Whole scenes on disk: read as they were made, the same for any number of workers, every fault found."""

import json
from dataclasses import replace

import numpy as np
import pytest
import zarr

from pipelines.cli import main
from pipelines.corpus import Corpus, write_corpus
from pipelines.corpus.faults import faults
from pipelines.corpus.rooms.laws import broken_room_laws
from pipelines.corpus.rooms.layers import hidden_layers
from pipelines.corpus.rooms.people import by_person
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import CorpusError
from pipelines.generation.drawn import drawn_order
from synth.scene.config import SceneConfig, SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.scene.room.source import RoomSource
from synth.vocabulary import PART_NAMES, SCENE_CLASSES

N_FRAMES = 6


def config(number=(0, 3)):
    return SceneConfig(
        camera="custom",
        intrinsics=(96, 80, 68.0, 68.0, 47.8, 38.5),
        splits=SplitShares(0.5, 0.2, 0.3),
        room=RoomConfig(kinds=RoomWeights(1.0, 1.0, 1.0)),
        people=PeopleConfig(number=number, visible=(0.0, 1.0)),
    )


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    root = tmp_path_factory.mktemp("rooms") / "corpus"
    write_corpus(root, drawn_order(config(), 7, N_FRAMES))
    return Corpus.open(root)


@pytest.fixture(scope="module")
def source():
    return RoomSource(config(), 7, N_FRAMES)


def test_scenes_are_read_to_the_byte_as_they_were_made(written, source):
    assert written.header.schema_version == 2
    assert written.header.labels["occluders"] == list(SCENE_CLASSES)
    assert written.header.labels["joint_states"][-1] == "occluded_by_person"
    n_people = 0
    for index in range(N_FRAMES):
        made, read = source.frame(index), written.scene(index)
        for name in ("depth", "part", "person", "occluder", "instance", "T_world_camera"):
            np.testing.assert_array_equal(getattr(made, name), getattr(read, name))
        assert made.info == read.info
        assert made.camera == read.camera
        assert len(made.people) == len(read.people)
        for one, other in zip(made.people, read.people, strict=True):
            n_people += 1
            for name in vars(one):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert n_people > 3


def test_a_sound_corpus_has_no_faults_and_verify_says_so(written):
    assert list(faults(written)) == []
    assert main(["verify", str(written.path)]) == 0


def test_zarr_reads_the_same_arrays(written):
    group = zarr.open_group(written.path / "arrays.zarr", mode="r")
    for name in written.array_names:
        np.testing.assert_array_equal(group[name][:], written.arrays(name))


def test_a_layer_that_nothing_hides_takes_no_room(written):
    boxes, hidden = written.arrays("box"), written.arrays("hidden_part")
    assert not hidden[boxes[..., 2] == 0].any()
    for k, frame in enumerate(written.scenes()):
        for j, view in enumerate(frame.people):
            outside = hidden[k, j].copy()
            outside[view.window] = 0
            assert not outside.any()


def test_hidden_layers_are_the_bodies_where_the_composite_does_not_show_the_same(source):
    for index in range(N_FRAMES):
        frame = source.frame(index)
        depth, part = hidden_layers(frame)
        assert depth.shape == part.shape == (len(frame.people), *frame.depth.shape)
        for k, view in enumerate(frame.people):
            seen = np.where(frame.person[view.window] == k + 1, frame.part[view.window], 0)
            is_same = (seen > 0) & (seen == view.body_part) & (frame.depth[view.window] == view.body_depth)
            np.testing.assert_array_equal(depth[k][view.window], np.where(is_same, 0, view.body_depth))
            np.testing.assert_array_equal(part[k][view.window], np.where(is_same, 0, view.body_part))


def test_a_person_seen_where_their_body_layer_has_none_is_refused(source):
    frame = next(f for f in (source.frame(k) for k in range(N_FRAMES)) if (f.person == 1).any())
    view = frame.people[0]
    emptied = replace(frame, people=(replace(view, body_part=np.zeros_like(view.body_part)), *frame.people[1:]))
    with pytest.raises(ValueError, match="pixels where the body layer has none"):
        hidden_layers(emptied)
    is_outside = np.ones(frame.depth.shape, bool)
    is_outside[view.window] = False
    row, column = np.argwhere(is_outside & (frame.person == 0))[0]
    person, part = frame.person.copy(), frame.part.copy()
    person[row, column], part[row, column] = 1, 1
    with pytest.raises(ValueError, match="person 1 in 1 pixels outside their box"):
        hidden_layers(replace(frame, person=person, part=part))


def test_by_person_lists_every_person_once(written):
    states = by_person(written, "joint_state")
    views = [view for frame in written.scenes() for view in frame.people]
    np.testing.assert_array_equal(states, [view.joint_state for view in views])
    repeated = [frame.T_world_camera for frame in written.scenes() for _ in frame.people]
    np.testing.assert_array_equal(by_person(written, "T_world_camera"), repeated)


def test_a_sensor_changes_the_depth_alone_and_cuts_what_is_too_far(written):
    clean, noisy = written.scene(1), written.scene(1, "kinect_v2")
    assert not np.array_equal(clean.depth, noisy.depth)
    assert noisy.depth.max() <= 8000
    np.testing.assert_array_equal(clean.person, noisy.person)


def test_scenes_and_single_people_are_not_mistaken_for_each_other(written, toy_corpus):
    with pytest.raises(
        CorpusError, match=r"holds whole scenes, not single people; read frame 2 with corpus\.scene"
    ):
        written.frame(2)
    with pytest.raises(CorpusError, match=r"holds single people; read frame 0 with corpus\.frame\(0\)"):
        toy_corpus.scene(0)
    with pytest.raises(CorpusError, match="models are scored on frames of one person"):
        CorpusFrames(written, written.split("train"))


@pytest.mark.slow
def test_the_bytes_do_not_depend_on_the_number_of_workers(tmp_path, bytes_of):
    order = drawn_order(config((0, 1)), 3, 66)
    for workers in (1, 2):
        write_corpus(tmp_path / str(workers), order, workers)
    assert bytes_of(tmp_path / "1") == bytes_of(tmp_path / "2")


def broken(frame, header, **changes):
    return list(broken_room_laws(replace(frame, **changes), header))


def test_every_law_finds_its_fault(written):
    frame = max(written.scenes(), key=lambda frame: (frame.person > 0).sum())
    header = written.header
    assert list(broken_room_laws(frame, header)) == []
    number = int(frame.person.max())
    v, u = (int(place[0]) for place in np.nonzero(frame.person == number))

    def changed(name, value):
        image = getattr(frame, name).copy()
        image[v, u] = value
        return " ".join(broken(frame, header, **{name: image}))

    assert "depth without a label" in changed("depth", 0)
    assert "a part without a person" in changed("part", 0)
    assert "who is not in the record" in changed("person", 9)
    assert "a person and an object or surface" in changed("occluder", 8)
    assert "a class without an instance" in changed("instance", 3)
    assert f"part has code {len(PART_NAMES)}" in changed("part", len(PART_NAMES))
    assert "composite behind the body" in changed("depth", 65000)
    fewer = " ".join(broken(frame, header, people=frame.people[:-1]))
    assert "people, the record" in fewer
    record = replace(frame.info.people[number - 1], visible_fraction=0.5, number=7)
    others = tuple(record if k == number - 1 else one for k, one in enumerate(frame.info.people))
    told = " ".join(broken(frame, header, info=replace(frame.info, people=others)))
    assert f"visible fraction of person {number} is 0.500000" in told
    assert f"the record of person {number} has number 7" in told
    twice = replace(frame.info, people=(frame.info.people[0],) * len(frame.people), objects=frame.info.objects[:1])
    told = " ".join(broken(frame, header, info=twice))
    assert ("somebody is in the frame twice" in told) == (len(frame.people) > 1)
    assert "None in the record" in told


def test_a_damaged_record_is_found(tmp_path):
    order = drawn_order(config((1, 1)), 5, 1)
    root = tmp_path / "corpus"
    write_corpus(root, order)
    path = root / "frames" / "000000.jsonl"
    line = json.loads(path.read_text())
    line["people"][0]["seat"] = "chair"
    path.write_text(json.dumps(line) + "\n")
    told = " ".join(faults(Corpus.open(root)))
    assert "its digest differs" in told
    assert "the record of frame 0" in told


def test_a_corpus_of_scenes_is_not_gone_on_with_as_another(tmp_path, written):
    other = replace(drawn_order(config(), 7, N_FRAMES), schema_version=1)
    with pytest.raises(
        Exception, match="holds a corpus with other settings: schema_version is 2 there and 1 here"
    ):
        write_corpus(written.path, other)
