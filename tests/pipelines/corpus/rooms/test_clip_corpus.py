"""Clips and views on disk: read as they were made, the same for any number of workers, every fault found."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines import Corpus, clips_of
from pipelines.corpus import write_corpus
from pipelines.corpus.faults import faults
from pipelines.corpus.shards import encode_plain, shard_path
from pipelines.corpus.write import ZARR_NAME
from pipelines.errors import CorpusError, UserError
from pipelines.generation.drawn import drawn_order, whole_frames
from synth.scene import ClipSource, FrameSource, SceneConfig
from synth.scene.config import SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights

SMALL = {"camera": "custom", "intrinsics": (160, 132, 114.0, 114.0, 79.5, 65.5)}


def config(**changes):
    settings = {
        "clip": 12,
        "fps": 12.0,
        "cameras": 2,
        "rig": "stereo",
        "room": RoomConfig(kinds=RoomWeights(hall=1.0), furniture=0.3),
        "people": PeopleConfig(number=(1, 2), visible=(0.0, 1.0)),
        "splits": SplitShares(2.0, 0.0, 1.0),
    }
    return SceneConfig(**SMALL, **settings | changes)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    root = tmp_path_factory.mktemp("clips") / "corpus"
    write_corpus(root, drawn_order(config(), 9, 72))
    return Corpus.open(root)


def test_clips_are_read_to_the_byte_as_they_were_made(written):
    source = ClipSource(config(), 9, 72)
    for index in (0, 25, 71):
        made, read = source.frame(index), written.scene(index)
        assert made.moment == read.moment
        assert made.info == read.info
        assert made.depth.tobytes() == read.depth.tobytes()
        for a, b in zip(made.people, read.people, strict=True):
            for name in ("joints_world", "velocity", "contacts"):
                assert getattr(a.motion, name).tobytes() == getattr(b.motion, name).tobytes()


def test_clips_are_found_by_split_time_and_view(written):
    listed = [(clip.split, clip.number) for clip in clips_of(written)]
    assert listed == [("train", 0), ("train", 1), ("test", 0)]
    clip = next(clips_of(written, "test"))
    assert clip.numbers.shape == (12, 2)
    assert clip.fps == 12.0
    np.testing.assert_array_equal(clip.numbers, 48 + np.arange(24).reshape(12, 2))
    frames = list(clip.frames(view=1))
    assert [frame.moment.time for frame in frames] == list(range(12))
    assert all(frame.moment.view == 1 for frame in frames)
    n = len(clip.subjects())
    assert clip.array("joints_world").shape == (12, 8, 15, 3)
    assert np.isfinite(clip.array("joints_world")[:, :n]).all()
    np.testing.assert_allclose(clip.seconds()[-1], 11 / 12)


def test_noise_is_drawn_for_every_frame(written):
    clip = next(clips_of(written))
    noisy = [clip.frame(step, sensor="kinect_v2").depth.astype(int) for step in (3, 4)]
    clean = [clip.frame(step).depth.astype(int) for step in (3, 4)]
    off = [a - b for a, b in zip(noisy, clean, strict=True)]
    assert (off[0] != off[1]).mean() > 0.1
    assert np.array_equal(noisy[0], clip.frame(3, sensor="kinect_v2").depth)


def test_a_sound_corpus_has_no_faults(written):
    assert list(faults(written)) == []


def test_any_number_of_workers_gives_the_same_bytes(written, tmp_path):
    write_corpus(tmp_path / "two", drawn_order(config(), 9, 72), workers=2)
    assert Corpus.open(tmp_path / "two").digest == written.digest


def overwritten(corpus, name, change):
    """What `faults` says after an array of the first shard was changed."""
    item = corpus.header.fields[name]
    path = shard_path(corpus.path / ZARR_NAME, item, 0)
    before = path.read_bytes()
    values = corpus.arrays(name, np.arange(64)).copy()
    change(values)
    path.write_bytes(encode_plain(item, values))
    try:
        return [text for text in faults(Corpus.open(corpus.path)) if "digest" not in text]
    finally:
        path.write_bytes(before)


def test_a_camera_that_disagrees_is_found(written):
    def moved(poses):
        poses[5, 0, 3] += 0.001

    found = overwritten(written, "T_world_camera", moved)
    assert any("clip 0 of train: joints seen by camera 1 in frame 5 are 1.00 mm off" in text for text in found)


def test_frames_out_of_order_are_found(written):
    def swapped(times):
        times[[4, 6]] = times[[6, 4]]

    assert any("is out of the order of time" in text for text in overwritten(written, "time", swapped))


def test_impossible_speeds_are_found(written):
    def hurried(speeds):
        speeds[7, 0, 3] = 99.0

    assert any("moves with" in text for text in overwritten(written, "joint_velocity", hurried))


def test_single_people_are_seen_by_several_cameras(tmp_path):
    scene = SceneConfig(**SMALL, cameras=2, rig="front_top")
    write_corpus(tmp_path / "views", drawn_order(scene, 3, 8))
    corpus = Corpus.open(tmp_path / "views")
    assert corpus.header.schema_version == 1
    assert list(faults(corpus)) == []
    made = FrameSource(scene, 3, 8).frame(5)
    assert corpus[5].moment == made.moment
    assert corpus[5].body_depth.tobytes() == made.body_depth.tobytes()
    clips = list(clips_of(corpus))
    assert [clip.numbers.shape for clip in clips] == [(1, 2)] * 4


def test_corpora_of_single_frames_have_no_clips(tmp_path):
    write_corpus(tmp_path / "single", drawn_order(SceneConfig(**SMALL), 3, 2))
    corpus = Corpus.open(tmp_path / "single")
    assert "clip" not in corpus.header.fields
    with pytest.raises(CorpusError, match="has neither clips nor several cameras"):
        next(clips_of(corpus))


def test_orders_that_cut_clips_are_refused():
    with pytest.raises(UserError, match="frames=70 must be a multiple of 24"):
        drawn_order(config(), 9, 70)
    assert whole_frames(config(), 70) == 72


def test_settings_of_clips_travel_with_the_corpus(written):
    scene = written.header.config["scene"]
    assert (scene["clip"], scene["fps"], scene["cameras"]) == (12, 12.0, 2)
    assert replace(config(), cameras=1, rig="corners").told()["clip"] == 12
