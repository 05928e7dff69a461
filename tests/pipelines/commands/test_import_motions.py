"""undergrowth import mocap --clips, and clips that are made with what it keeps."""

import numpy as np
import pytest

from pipelines import Corpus, clips_of
from pipelines.cli import main
from pipelines.corpus import write_corpus
from pipelines.corpus.faults import faults
from pipelines.errors import UserError
from pipelines.generation.drawn import drawn_order
from pipelines.generation.libraries import LibraryUse
from synth.bodies.motion.library import read_motions
from synth.bodies.poses.library import write_library
from synth.scene import ClipSource, MotionMix, SceneConfig
from synth.scene.config import SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from tests.pipelines.toy_libraries import poses_of
from tests.walking import walking_text

SMALL = {"camera": "custom", "intrinsics": (96, 80, 68.0, 68.0, 47.5, 39.5)}


def scene(**changes):
    settings = {
        "clip": 12,
        "fps": 10.0,
        "room": RoomConfig(kinds=RoomWeights(hall=1.0), furniture=0.3),
        "people": PeopleConfig(number=(2, 2)),
        "splits": SplitShares(1.0, 0.0, 1.0),
    }
    return SceneConfig(**SMALL, **settings | changes)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A library of the walks of two people."""
    root = tmp_path_factory.mktemp("mocap")
    (root / "01_01.bvh").write_text(walking_text())
    (root / "02_01.bvh").write_text(walking_text(0.9))
    (root / "03_01.bvh").write_text("once upon a time")
    out = root / "motions.lib"
    assert main(["import", "mocap", str(root), "--out", str(out), "--clips", "--train", "01", "--test", "02"]) == 0
    return out


def test_whole_motions_are_kept_with_their_frames_in_order(path):
    library = read_motions(path)
    assert [trial.split for trial in library.trials] == ["train", "test"]
    assert len(library) == 2
    for k in range(2):
        assert (np.diff(library.frame[library.motion == k]) == 1).all()
        assert library[k].fps == pytest.approx(30.0, rel=0.01)
        assert library[k].contacts.any(axis=(1, 2)).mean() > 0.9


def test_the_same_files_give_the_same_library(path, tmp_path):
    again = tmp_path / "again.lib"
    main(["import", "mocap", str(path.parent), "--out", str(again), "--clips", "--train", "01", "--test", "02"])
    assert again.read_bytes() == path.read_bytes()


def test_people_of_clips_move_as_recorded(path, tmp_path):
    use = LibraryUse(path, 1.0, ("test",))
    write_corpus(tmp_path / "c", drawn_order(scene(), 3, 24, poses=use))
    corpus = Corpus.open(tmp_path / "c")
    assert list(faults(corpus)) == []
    drawn, recorded = clips_of(corpus)
    assert {one.activity for one in drawn.frame(0).info.people}.isdisjoint({"recorded"})
    for frame in recorded.frames():
        for one in frame.info.people:
            if one.group != "sit":
                assert (one.activity, one.pose_id) == ("recorded", "mocap/test/02_01/0001")
    joints = recorded.array("joints_world")[:, 0]
    assert np.hypot(*(joints[-1, 2] - joints[0, 2])[:2]) > 0.3
    assert corpus.header.config["poses"]["digest"] == read_motions(path).digest


def test_a_split_without_the_library_is_the_same_to_the_byte(path):
    mix = MotionMix(read_motions(path), 1.0, ("test",))
    plain, mixed = ClipSource(scene(), 3, 24), ClipSource(scene(), 3, 24, poses=mix)
    assert plain.frame(5).depth.tobytes() == mixed.frame(5).depth.tobytes()
    assert plain.frame(17).depth.tobytes() != mixed.frame(17).depth.tobytes()


def test_a_frame_of_a_recorded_clip_can_be_made_alone(path):
    mix = MotionMix(read_motions(path), 1.0, ("train",))
    config = scene(people=PeopleConfig(number=(1, 1)), clip=6, splits=SplitShares(1.0, 0.0, 0.0))
    source = ClipSource(config, 8, 6, poses=mix)
    first, last = source.frame(0), source.frame(5)
    alone = ClipSource(config, 8, 6, poses=mix).frame(5)
    assert alone.depth.tobytes() == last.depth.tobytes() != first.depth.tobytes()
    assert alone.info == last.info


@pytest.mark.parametrize(
    ("changes", "splits", "sentence"),
    [
        ({"clip": 60}, ("train",), r"split 'train' last at most \d\.\d s, clips 6\.0 s"),
        ({}, ("val",), "no motions for split 'val'"),
        ({"clip": 0}, ("train",), "library of whole motions, for clips"),
    ],
)
def test_a_library_that_does_not_serve_is_one_clear_error(path, changes, splits, sentence):
    config = scene(**changes)
    with pytest.raises(UserError, match=sentence):
        drawn_order(config, 3, 240 if config.clip else 24, poses=LibraryUse(path, 0.5, splits))


def test_a_library_of_single_poses_has_no_motion(tmp_path):
    write_library(tmp_path / "poses.lib", poses_of("train"))
    with pytest.raises(UserError, match="library of single poses, which have no motion; make one of motions"):
        drawn_order(scene(), 3, 24, poses=LibraryUse(tmp_path / "poses.lib", 0.5, ("train",)))


def test_a_folder_without_any_motion_is_told(tmp_path, capsys):
    text = walking_text()
    head, _, tail = text.partition("MOTION\n")
    frames = tail.splitlines()[2:22]
    (tmp_path / "01_01.bvh").write_text(
        f"{head}MOTION\nFrames: 20\nFrame Time: 0.033333\n" + "\n".join(frames) + "\n"
    )
    assert main(["import", "mocap", str(tmp_path), "--out", str(tmp_path / "a.lib"), "--clips"]) == 1
    assert "no motion of the 1 usable files" in capsys.readouterr().err
