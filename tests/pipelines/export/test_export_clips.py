"""Clips in the formats of others: track identities in COCO, MOTChallenge text, ITOP's side and top files."""

import configparser
import json

import h5py
import numpy as np
import pytest

from pipelines import Corpus, clips_of
from pipelines.corpus import write_corpus
from pipelines.errors import UserError
from pipelines.export.write import export
from pipelines.generation.drawn import drawn_order
from pipelines.inspect.strips import film_strip
from pipelines.inspect.write import write_inspection
from synth.scene import SceneConfig
from synth.scene.config import SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights

SMALL = {"camera": "custom", "intrinsics": (160, 132, 114.0, 114.0, 79.5, 65.5)}


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """One clip of six steps, seen from the front and the top."""
    scene = SceneConfig(
        **SMALL,
        clip=6,
        fps=10.0,
        cameras=2,
        rig="front_top",
        room=RoomConfig(kinds=RoomWeights(hall=1.0), furniture=0.3),
        people=PeopleConfig(number=(2, 2), visible=(0.0, 1.0)),
        splits=SplitShares(1.0, 0.0, 0.0),
    )
    root = tmp_path_factory.mktemp("clips") / "corpus"
    write_corpus(root, drawn_order(scene, 4, 12))
    return Corpus.open(root)


def test_coco_tells_who_is_who_over_time_and_cameras(corpus, tmp_path):
    export(corpus, "coco", tmp_path / "coco")
    document = json.loads((tmp_path / "coco" / "annotations" / "train.json").read_text())
    images = {image["id"]: image for image in document["images"]}
    assert [(image["frame_id"], image["view"]) for image in document["images"]] == [
        (k // 2, k % 2) for k in range(12)
    ]
    assert len({image["video_id"] for image in document["images"]}) == 2
    for entry in document["annotations"]:
        frame = corpus.scene(entry["image_id"])
        assert entry["track_id"] == frame.moment.clip * 8 + entry["person"]
        np.testing.assert_allclose(
            entry["joints_world_m"], frame.people[entry["person"] - 1].motion.joints_world, atol=1e-4
        )
        assert images[entry["image_id"]]["clip"] == 0
    assert {entry["track_id"] for entry in document["annotations"]} == {1, 2}


def test_motchallenge_has_a_sequence_for_each_camera(corpus, tmp_path):
    export(corpus, "mot", tmp_path / "mot")
    for view in range(2):
        folder = tmp_path / "mot" / "train" / f"00000-{view}"
        info = configparser.ConfigParser()
        info.read(folder / "seqinfo.ini")
        assert int(info["Sequence"]["seqLength"]) == len(list((folder / "img1").iterdir())) == 6
        assert float(info["Sequence"]["frameRate"]) == 10.0
        rows = np.loadtxt(folder / "gt" / "gt.txt", delimiter=",", ndmin=2)
        assert rows.shape[1] == 9
        for row in rows:
            frame = corpus.scene(int(clip_numbers(corpus)[int(row[0]) - 1, view]))
            left, top, width, height = frame.people[int(row[1]) - 1].box
            np.testing.assert_array_equal(row[2:6], (left + 1, top + 1, width, height))
            assert row[8] == pytest.approx(frame.info.people[int(row[1]) - 1].visible_fraction, abs=1e-4)


def clip_numbers(corpus):
    return next(clips_of(corpus)).numbers


def test_itop_has_files_of_the_side_and_of_the_top(corpus, tmp_path):
    export(corpus, "itop", tmp_path / "itop")
    for k, name in enumerate(("side", "top")):
        with h5py.File(tmp_path / "itop" / f"{name}_train_labels.h5") as file:
            assert (np.array(file["frame"]) % 2 == k).all()
    assert len(list((tmp_path / "itop").iterdir())) == 4


def test_corpora_without_clips_have_no_tracks(tmp_path):
    write_corpus(tmp_path / "single", drawn_order(SceneConfig(**SMALL), 3, 2))
    with pytest.raises(UserError, match="mot needs clips of whole scenes"):
        export(Corpus.open(tmp_path / "single"), "mot", tmp_path / "out")


def test_film_strips_show_moments_cameras_and_ways(corpus, tmp_path):
    strip = film_strip(next(clips_of(corpus)), 3)
    assert strip.shape[1] == 4 * (192 + 3)
    written = write_inspection(corpus, tmp_path / "inspect", n_frames=6)
    assert [path.name for path in written] == ["sheet_00.png", "index.html", "statistics.json"]
