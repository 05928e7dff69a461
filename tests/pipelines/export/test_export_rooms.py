"""Exports of whole scenes say the same as the corpus when read by the library that their users have."""

import json
import tarfile

import cv2
import h5py
import numpy as np
import pytest

from pipelines.cli import main
from pipelines.corpus import Corpus, write_corpus
from pipelines.drawing.plan import room_plan
from pipelines.drawing.rooms import people_picture, room_sheet
from pipelines.export.itop import FROM_OURS, SEGMENT_OF_PART
from pipelines.export.rooms.coco import person_entry
from pipelines.export.write import export
from pipelines.generation.drawn import drawn_order
from pipelines.inspect.statistics import statistics_of
from synth.scene.config import SceneConfig, SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights

N_FRAMES = 5


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    config = SceneConfig(
        camera="custom",
        intrinsics=(96, 80, 68.0, 68.0, 47.8, 38.5),
        splits=SplitShares(1.0, 0.0, 0.0),
        room=RoomConfig(kinds=RoomWeights(1.0, 1.0, 1.0)),
        people=PeopleConfig(number=(1, 4), visible=(0.0, 1.0)),
    )
    root = tmp_path_factory.mktemp("rooms") / "corpus"
    write_corpus(root, drawn_order(config, 9, N_FRAMES))
    return Corpus.open(root)


def seen_people(corpus):
    return [(frame, k) for frame in corpus.scenes() for k, view in enumerate(frame.people) if view.box[2]]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_coco_has_an_annotation_for_everybody_in_the_image_and_ignores_who_is_hardly_seen(rooms, tmp_path, capsys):
    from pycocotools.coco import COCO

    assert export(rooms, "coco", tmp_path / "out") == N_FRAMES
    coco = COCO(str(tmp_path / "out" / "annotations" / "train.json"))
    people = seen_people(rooms)
    assert len(coco.anns) == len(people)
    states = set()
    for frame, k in people:
        entry = coco.anns[frame.info.index * 8 + k + 1]
        seen = frame.person == k + 1
        alone = np.zeros_like(seen)
        alone[frame.people[k].window] = frame.people[k].body_part > 0
        is_ignored = frame.info.people[k].visible_fraction < 0.1 or seen.sum() < 100
        assert entry["iscrowd"] == is_ignored
        states.add(is_ignored)
        np.testing.assert_array_equal(coco.annToMask(entry).astype(bool), alone if is_ignored else seen)
        assert entry["area"] == (alone if is_ignored else seen).sum()
        np.testing.assert_allclose(entry["joints_camera_m"], frame.people[k].joints, atol=1e-6)
    assert len(states) == 2, "the frames show only one kind of people"
    depth = cv2.imread(str(tmp_path / "out" / "person" / "train" / "0000002.png"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(depth, rooms.scene(2).person)


def test_somebody_outside_the_image_has_no_annotation(rooms):
    outside = [(f, k) for f in rooms.scenes() for k, view in enumerate(f.people) if not view.box[2]]
    assert all(person_entry(frame, k) is None for frame, k in outside)


def test_exr_has_ids_of_people_and_every_body_alone(rooms, tmp_path):
    import OpenEXR

    export(rooms, "exr", tmp_path / "out")
    frame, k = seen_people(rooms)[0]
    path = tmp_path / "out" / "train" / f"{frame.info.index:07d}.exr"
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels, header = file.channels(), file.header()
        np.testing.assert_array_equal(channels["person.id"].pixels, frame.person)
        np.testing.assert_array_equal(channels["instance.id"].pixels, frame.instance)
        np.testing.assert_array_equal(np.rint(channels["Z"].pixels * 1000).astype(np.uint16), frame.depth)
        body = np.rint(channels[f"body{k + 1}.Z"].pixels * 1000).astype(np.uint16)
        np.testing.assert_array_equal(body[frame.people[k].window], frame.people[k].body_depth)
        assert np.count_nonzero(body) == np.count_nonzero(frame.people[k].body_depth)
        joints = np.array(header[f"undergrowth:joints{k + 1}"].split(), dtype=np.float32).reshape(15, 3)
        np.testing.assert_array_equal(joints, frame.people[k].joints)
        names = {}
        manifest = header["idManifest"]
        for i in range(manifest.size()):
            names[next(iter(manifest[i].getChannels()))] = {entry.id(): entry.text()[0] for entry in manifest[i]}
        assert names["person.id"] == {0: "none"} | {p.number: p.subject_id for p in frame.info.people}


def test_itop_has_a_row_for_every_person(rooms, tmp_path):
    export(rooms, "itop", tmp_path / "out")
    people = seen_people(rooms)
    with (
        h5py.File(tmp_path / "out" / "train_depth_map.h5") as maps,
        h5py.File(tmp_path / "out" / "train_labels.h5") as labels,
    ):
        assert len(maps["data"]) == len(labels["id"]) == len(people)
        for row, (frame, k) in enumerate(people):
            assert (labels["frame"][row], labels["person"][row]) == (frame.info.index, k + 1)
            np.testing.assert_allclose(maps["data"][row], frame.depth / 1000, rtol=1e-3)
            expected = (frame.people[k].joints * (1, -1, 1))[FROM_OURS]
            np.testing.assert_array_equal(labels["real_world_coordinates"][row], expected.astype(np.float32))
            seen = frame.person == k + 1
            segments = labels["segmentation"][row]
            np.testing.assert_array_equal(segments >= 0, seen)
            np.testing.assert_array_equal(segments[seen], SEGMENT_OF_PART[frame.part[seen]])


def test_webdataset_has_the_crops_and_joints_of_all(rooms, tmp_path):
    export(rooms, "webdataset", tmp_path / "out")
    frame, k = seen_people(rooms)[-1]
    with tarfile.open(tmp_path / "out" / "train-000000.tar") as tar:
        name = f"{frame.info.index:07d}"
        data = tar.extractfile(f"{name}.body{k + 1}_depth.png").read()
        crop = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(crop, frame.people[k].body_depth)
        record = json.loads(tar.extractfile(f"{name}.json").read())
        assert record["views"][k]["box"] == list(frame.people[k].box)
        assert [one["subject_id"] for one in record["people"]] == [one.subject_id for one in frame.info.people]


def test_inspect_counts_people_and_draws_the_room_from_above(rooms, tmp_path):
    statistics = statistics_of(rooms)
    frames = list(rooms.scenes())
    assert sum(statistics.visible_fraction.counts) == sum(len(frame.people) for frame in frames)
    assert sum(statistics.counts["people"].values()) == N_FRAMES
    assert set(statistics.joint_states["head"]) > {"occluded_by_person"}
    assert np.isclose(sum(statistics.joint_states["head"].values()), 1.0)
    assert main(["inspect", str(rooms.path), "--out", str(tmp_path / "seen"), "--frames", "2"]) == 0
    assert "occluded-by-person" in (tmp_path / "seen" / "index.html").read_text()
    sheet = room_sheet(frames[:2])
    assert sheet.shape[0] > room_sheet(frames[:1]).shape[0]
    frame = frames[0]
    picture = people_picture(frame)
    assert (picture[frame.person == 1] != picture[frame.person == 0][0]).any()


def test_the_plan_shows_everybody_where_they_are(rooms):
    from pipelines.drawing.palette import PERSON_COLOURS

    frame = next(frame for frame in rooms.scenes() if len(frame.people) > 1)
    plan = room_plan(frame, 400, 300)
    scale = min(400 / (frame.info.room["length"] + 1.2), 300 / (frame.info.room["width"] + 1.2))
    for k, view in enumerate(frame.people, start=1):
        x, y = 200 + scale * view.T_world_root[0, 3], 150 - scale * view.T_world_root[1, 3]
        around = plan[int(y) - 4 : int(y) + 5, int(x) - 4 : int(x) + 5].reshape(-1, 3)
        assert (around == PERSON_COLOURS[k]).all(axis=1).any()
