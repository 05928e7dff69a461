"""Inspection draws what it says and counts what is there."""

import json
import math
from types import SimpleNamespace

import cv2
import numpy as np

from pipelines.cli import main
from pipelines.drawing import palette
from pipelines.drawing.frames import TILE_WIDTH, contact_sheet, joints_picture, pictures
from pipelines.drawing.windows import person_window
from pipelines.inspect.coverage import bends_of, life_covered, views_grid
from pipelines.inspect.statistics import camera_azimuth, histogram, statistics_of
from synth.bodies.life.model import life_model
from synth.bodies.skeleton import DOFS
from synth.geometry import look_at, rotation_about
from synth.vocabulary import JOINT_NAMES, JointState


def test_colours_tell_parts_and_classes_apart():
    for table in (palette.PART_COLOURS, palette.CLASS_COLOURS):
        assert len({tuple(colour) for colour in table.tolist()}) == len(table)
    marks = [*palette.STATE_MARKS.values(), palette.RIGHT, palette.WRONG]
    assert len(set(marks)) == len(marks)
    assert set(palette.STATE_MARKS) == set(JointState)


def test_colours_are_written_as_css_has_them():
    assert palette.css_colour((1, 16, 255)) == "#ff1001"


def test_a_strip_has_five_pictures_and_the_sheet_all_frames(toy_corpus):
    frames = [toy_corpus[i] for i in (0, 1, 2)]
    drawn = pictures(frames[0], person_window(frames[0], 0.0, TILE_WIDTH))
    assert [picture.shape for picture in drawn] == [(TILE_WIDTH * 3 // 4, TILE_WIDTH, 3)] * 5
    one, three = contact_sheet(frames[:1]), contact_sheet(frames)
    assert three.shape[1] == one.shape[1]
    assert three.shape[0] > one.shape[0]


def test_parts_are_drawn_in_their_colours(toy_corpus):
    frame = toy_corpus[1]
    _, parts, alone, occluders, _ = pictures(frame, person_window(frame, 0.0, 64))
    np.testing.assert_array_equal(parts, palette.PART_COLOURS[frame.part])
    np.testing.assert_array_equal(alone, palette.PART_COLOURS[frame.body_part])
    inside = (frame.occluder == 1) & (frame.body_part == 0)
    assert (occluders[inside] != palette.NO_RETURN).any(axis=-1).mean() > 0.95


def test_a_joint_behind_the_camera_does_not_break_the_picture(toy_corpus):
    frame = toy_corpus[1]
    frame.joints.setflags(write=True)
    joints = frame.joints.copy()
    joints[0, 2] = -1.0
    joints[1] = (1e6, 0.0, 0.1)
    object.__setattr__(frame, "joints", joints)
    assert joints_picture(frame, person_window(frame, 0.0, 64)).shape == (48, 64, 3)


def test_azimuth_is_the_bearing_of_the_camera_from_the_person():
    facing_x = np.eye(4)[None]
    for bearing in (0.0, 45.0, 90.0, -135.0):
        eye = (2 * math.cos(math.radians(bearing)), 2 * math.sin(math.radians(bearing)), 1.0)
        T = look_at(eye, (0.0, 0.0, 1.0))[None]
        np.testing.assert_allclose(camera_azimuth(facing_x, T), bearing, atol=1e-9)
        turned = rotation_about((0.0, 0.0, 1.0), math.radians(30.0))[None]
        np.testing.assert_allclose(camera_azimuth(turned, T), bearing - 30.0, atol=1e-9)


def test_statistics_count_every_frame(toy_corpus):
    statistics = statistics_of(toy_corpus)
    states = toy_corpus.arrays("joint_state")
    assert statistics.n_frames == 200
    head = statistics.joint_states[JOINT_NAMES[0]]
    assert math.isclose(sum(head.values()), 1.0)
    assert math.isclose(head["occluded"], (states[:, 0] == 1).mean())
    assert sum(statistics.visible_fraction.counts) == 200
    assert statistics.counts["split"] == {"train": 140, "test": 30, "val": 30}
    assert statistics.counts["objects' classes"] == {"table": 150}
    assert statistics.counts["camera"] == {"toy": 200}


def test_views_are_counted_by_bearing_and_distance():
    grid = views_grid(np.array([-179.0, 1.0, 2.0, 170.0]), np.array([0.1, 2.2, 2.4, 99.0]))
    counts = np.array(grid.counts)
    assert counts.shape == (len(grid.distances) - 1, len(grid.bearings) - 1)
    assert counts.sum() == 4
    assert counts[4, 6] == 2
    assert counts[0, 0] == counts[-1, -1] == 1


def test_bends_are_angles_between_limbs_and_unknown_joints_are_left_out():
    joints, at = np.zeros((2, 15, 3)), {name: k for k, name in enumerate(JOINT_NAMES)}
    for side, y in (("l", 0.2), ("r", -0.2)):
        places = {"shoulder": (0, y, 1.4), "elbow": (0, y, 1.1), "hand": (0.3, y, 1.1)}
        places |= {"hip": (0, y, 0.9), "knee": (0.4, y, 0.9), "foot": (0.4, y, 0.5)}
        for name, place in places.items():
            joints[:, at[f"{side}_{name}"]] = place
    joints[:, at["neck"]] = (0.0, 0.0, 1.5)
    states = np.zeros((2, 15), np.uint8)
    states[1, at["l_elbow"]] = JointState.UNKNOWN
    bends = {name.split(":")[0]: values for name, values in bends_of(joints, states).items()}
    np.testing.assert_allclose(bends["Elbows"], 90.0)
    np.testing.assert_allclose(bends["Knees"], 90.0)
    np.testing.assert_allclose(bends["Hips"], 90.0)
    np.testing.assert_allclose(bends["Shoulders"], 0.0, atol=1e-5)
    assert {name: len(values) for name, values in bends.items()} == {
        "Hips": 4, "Knees": 4, "Shoulders": 3, "Elbows": 3,
    }  # fmt: skip


def test_a_corpus_of_the_models_own_poses_covers_recorded_life():
    rng = np.random.default_rng(0)
    drawn = [life_model().draw("standing", rng, 1.0) for _ in range(40)]
    arrays = {"angles": np.array([one.angles for one in drawn]), "T_world_root": np.tile(np.eye(4), (40, 1, 1))}
    arrays["T_world_root"][:, :3, :3] = [one.R_world_root for one in drawn]

    def corpus(names):
        header = SimpleNamespace(labels={"angles": [[name, -1.0, 1.0] for name in names]}, has_rooms=False)
        return SimpleNamespace(header=header, arrays=arrays.__getitem__)

    shares = life_covered(corpus([dof.name for dof in DOFS]))
    assert set(shares) == {"standing", "sitting"}
    assert shares["standing"] >= 40 / 500
    assert shares["standing"] > shares["sitting"]
    assert life_covered(corpus(["a", "b"])) == {}


def test_outer_bins_are_open():
    assert histogram([-5.0, 0.5, 9.0], np.array([0.0, 1.0, 2.0])).counts == [2, 1]


def test_inspect_writes_sheets_page_and_numbers(toy_corpus, tmp_path, capsys):
    assert main(["inspect", str(toy_corpus.path), "--frames", "14", "--out", str(tmp_path / "i")]) == 0
    names = sorted(path.name for path in (tmp_path / "i").iterdir())
    assert names == ["index.html", "sheet_00.png", "sheet_01.png", "statistics.json"]
    assert cv2.imread(str(tmp_path / "i" / "sheet_00.png")).shape[2] == 3
    page = (tmp_path / "i" / "index.html").read_text()
    assert "200 frames" in page
    assert page.count("<svg") == 8  # visible share, distance, bearing, four bends, views
    assert "http" not in page
    assert json.loads((tmp_path / "i" / "statistics.json").read_text())["n_frames"] == 200
    assert str(tmp_path / "i" / "sheet_00.png") in capsys.readouterr().out
