"""Pose libraries: one file, checked to the last byte; their poses keep the laws of floor, seat and body."""

import dataclasses
from functools import cache

import numpy as np
import pytest
import safetensors.numpy

from storage.digested import read_digested, write_digested
from synth.bodies.body import Body
from synth.bodies.mocap.bvh import parse_bvh
from synth.bodies.mocap.ground import find_support
from synth.bodies.mocap.source import read_source
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.poses.library import (
    FOOT_DOWN,
    FOOT_FLAT,
    FOOT_UP,
    FORMAT,
    PoseLibrary,
    PoseLibraryError,
    Trial,
    joined,
    read_library,
    write_library,
)
from synth.bodies.poses.place import place_pose
from synth.bodies.poses.sit import seat_contact, seat_height_of
from synth.bodies.rig.collision import self_collides
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, UPPER
from synth.bodies.spec import BodySpec
from synth.geometry import axis_angle
from tests.mocap_files import SIT, STAND, bvh_text, degrees, standing_root

SPECS = (BodySpec(1.76, 72.0, 1.0, 35.0), BodySpec(1.62, 84.0, 0.0, 50.0), BodySpec(1.20, 23.0, 0.4, 7.0))
STRIDE = STAND + degrees(l_hip_flexion=25.0, r_hip_flexion=-15.0, r_knee_flexion=20.0, r_ankle_flexion=-15.0)
ONE_LEG = STAND + degrees(l_hip_flexion=60.0, l_knee_flexion=70.0, r_hip_abduction=4.0)
SQUAT = STAND + degrees(hip_flexion=80.0, knee_flexion=75.0, ankle_flexion=24.0, shoulder_flexion=60.0)
HAND_IN_BELLY = STAND + degrees(l_shoulder_flexion=5.0, l_elbow_flexion=85.0, l_shoulder_rotation=75.0)
CROSSED = SIT + degrees(l_hip_flexion=25.0, l_hip_rotation=-20.0)
BENT = axis_angle((0, 1, 0), 0.5)
UPRIGHT = np.eye(3)
FLAT2, UP_FLAT = (FOOT_FLAT, FOOT_FLAT), (FOOT_UP, FOOT_FLAT)
ROWS = (
    (STAND, UPRIGHT, False, FLAT2), (STRIDE, UPRIGHT, False, (FOOT_FLAT, FOOT_DOWN)),
    (ONE_LEG, UPRIGHT, False, UP_FLAT),
    (SQUAT, BENT, False, FLAT2), (HAND_IN_BELLY, UPRIGHT, False, FLAT2), (SIT, UPRIGHT, True, FLAT2),
    (CROSSED, UPRIGHT, True, UP_FLAT), (SIT, axis_angle((0, 1, 0), -0.25), True, (FOOT_UP, FOOT_UP)),
)  # fmt: skip
N_STANDING = 5


def library_of(rows: tuple = ROWS, split: str = "test") -> PoseLibrary:
    angles, root, is_sitting, feet = zip(*rows, strict=True)
    n = len(rows)
    return PoseLibrary(
        "mocap", (Trial("02_06", "02", split, "02_06.bvh"),),
        np.clip(np.stack(angles), LOWER, UPPER).astype(np.float32), np.stack(root).astype(np.float32),
        np.array(is_sitting), np.array(feet, dtype=np.uint8), np.zeros(n, np.int32), np.arange(n, dtype=np.int32),
        {"distance": 0.06},
    )  # fmt: skip


@cache
def body(k: int) -> Body:
    return make_body(SPECS[k])


def place(row: int, k: int, **kwargs: object):
    library = library_of()
    height = seat_height_of(body(k)) if library.is_sitting[row] else None
    return place_pose(library, row, body(k), np.random.default_rng(row), height, **kwargs)


BODIES = range(len(SPECS))


@pytest.mark.parametrize("row", range(N_STANDING))
@pytest.mark.parametrize("k", BODIES)
def test_feet_that_stand_end_on_the_floor_and_no_skin_below_it(row, k):
    pose = place(row, k)
    if pose is None:
        assert (row, k) == (4, 1)  # a forearm that no small turn takes off a big belly
        return
    skin = pose_vertices(body(k), pose)
    assert skin[:, 2].min() > -0.01
    for side, state in zip("lr", ROWS[row][3], strict=True):
        low = skin[landmarks_of(body(k)).side[side].foot, 2].min()
        assert abs(low) < 0.01 if state != FOOT_UP else low > 0.05


@pytest.mark.parametrize("row", range(N_STANDING, len(ROWS)))
@pytest.mark.parametrize("k", BODIES)
def test_hips_that_sit_are_at_the_seats_height(row, k):
    for height in (0.8 * seat_height_of(body(k)), seat_height_of(body(k))):
        pose = place_pose(library_of(), row, body(k), np.random.default_rng(1), height)
        if pose is None:
            assert height < seat_height_of(body(k)) or SPECS[k].mass / SPECS[k].stature ** 2 > 30
            continue
        assert seat_contact(body(k), pose)[2] == pytest.approx(height, abs=1e-3)
        assert pose_vertices(body(k), pose)[:, 2].min() > -0.01


@pytest.mark.parametrize("row", range(len(ROWS)))
def test_trunk_head_and_lean_are_the_recorded_ones_and_no_limb_is_in_another(row):
    pose = place(row, 0)
    assert pose is not None
    trunk = [i for name, i in DOF_IDX.items() if name[:2] not in ("l_", "r_")]
    assert np.allclose(pose.angles[trunk], library_of().angles[row][trunk])
    assert np.allclose(pose.T_world_root[:3, :3], ROWS[row][1], atol=1e-6)
    assert not self_collides(body(0), pose)
    assert (pose.angles >= LOWER - 1e-9).all()
    assert (pose.angles <= UPPER + 1e-9).all()
    assert pose.source_id == f"mocap/test/02_06/{row:04d}"


def test_arms_stay_as_recorded_where_they_are_free():
    arms = [i for name, i in DOF_IDX.items() if "shoulder" in name or "elbow" in name]
    assert np.allclose(place(0, 0).angles[arms], STAND[arms])
    moved = np.degrees(np.abs(place(4, 0).angles[arms] - HAND_IN_BELLY[arms]))
    assert 2.0 < moved.max() < 60.0


def test_legs_of_those_who_stand_turn_little():
    hinges = [DOF_IDX[f"{s}_{n}"] for s in "lr" for n in ("hip_flexion", "hip_abduction", "knee_flexion")]
    for row in (0, 3):
        assert np.degrees(np.abs(place(row, 0).angles[hinges] - ROWS[row][0][hinges])).max() < 8.0


def test_arms_that_will_be_moved_are_hung_or_laid_in_the_lap():
    raised = (STAND + degrees(shoulder_flexion=120.0), UPRIGHT, False, FLAT2)
    pose = place_pose(library_of((raised,)), 0, body(0), np.random.default_rng(0), keeps_arms=False)
    assert abs(pose.angles[DOF_IDX["l_shoulder_flexion"]]) < np.radians(40.0)
    assert place(5, 0, keeps_arms=False) is not None


def test_a_seat_is_for_those_who_sit():
    with pytest.raises(ValueError, match="0000: a seat height"):
        place_pose(library_of(), 0, body(0), np.random.default_rng(0), 0.45)
    with pytest.raises(ValueError, match="0005: a seat height"):
        place_pose(library_of(), 5, body(0), np.random.default_rng(0))


def support_of(angles: np.ndarray, lift: float = 0.0, R: np.ndarray = UPRIGHT, n: int = 24):
    root = standing_root(angles, R)
    root[2, 3] += lift
    frames = [(STAND, standing_root(STAND))] * n + [(angles, root)] * n
    bvh = parse_bvh(bvh_text(frames))
    support = find_support(read_source(bvh), bvh.frame_time)
    return {name: getattr(support, name)[n + 6] for name in ("is_standing", "is_sitting", "is_down", "is_flat")}


@pytest.mark.parametrize(
    ("angles", "lift", "standing", "sitting", "down"),
    [
        (STAND, 0.0, True, False, [True, True]),
        (SIT, 0.0, False, True, [True, True]),
        (SIT, 0.25, False, True, [False, False]),
        (STAND, 0.3, False, False, [False, False]),
        (ONE_LEG, 0.0, True, False, [False, True]),
    ],
)
def test_standing_sitting_and_jumping_are_told_apart(angles, lift, standing, sitting, down):
    found = support_of(angles, lift)
    assert (found["is_standing"], found["is_sitting"]) == (standing, sitting)
    assert found["is_down"].tolist() == down


def test_who_squats_is_balanced_and_stands():
    found = support_of(SQUAT + degrees(lumbar_flexion=40.0, thorax_flexion=20.0), R=BENT)
    assert found["is_standing"]
    assert not found["is_sitting"]


def test_a_tilted_foot_is_not_flat():
    assert support_of(STAND)["is_flat"].all()
    assert not support_of(STAND + degrees(ankle_flexion=-30.0))["is_flat"].any()


def test_a_library_comes_back_from_its_file_and_its_bytes_repeat(tmp_path):
    library = library_of()
    write_library(tmp_path / "a", library)
    write_library(tmp_path / "b", read_library(tmp_path / "a"))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    back = read_library(tmp_path / "a")
    assert back.digest == library.digest
    assert back.trials == library.trials
    assert np.array_equal(back.angles, library.angles)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]


def test_every_damage_is_one_clear_error(tmp_path):
    path = tmp_path / "lib"
    write_library(path, library_of())
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for place_ in [*rng.integers(8, len(whole), 60), len(whole) - 1]:
        broken = bytearray(whole)
        broken[place_] ^= 1 << int(rng.integers(8))
        path.write_bytes(broken)
        with pytest.raises(PoseLibraryError, match="lib"):
            read_library(path)
    for cut in (0, 5, 100, len(whole) - 3):
        path.write_bytes(whole[:cut])
        with pytest.raises(PoseLibraryError, match="lib"):
            read_library(path)
    with pytest.raises(PoseLibraryError, match="there is no pose library"):
        read_library(tmp_path / "none")


def test_a_library_of_another_version_or_skeleton_says_so(tmp_path):
    path = tmp_path / "lib"
    write_library(path, library_of())
    kind, arrays, metadata = read_digested(path, FORMAT)
    write_digested(path, dataclasses.replace(FORMAT, version=9), kind, arrays, metadata)
    with pytest.raises(PoseLibraryError, match=r"has format version 9; .* reads version 2; import the rec"):
        read_library(path)
    write_digested(path, FORMAT, kind, arrays, metadata | {"dofs": ["knee"]})
    with pytest.raises(PoseLibraryError, match="made for another skeleton"):
        read_library(path)
    path.write_bytes(safetensors.numpy.save(arrays, {"undergrowth": '{"kind": "undergrowth pose library"}'}))
    with pytest.raises(PoseLibraryError, match="lacks the metadata; of an older one, import the recordings again"):
        read_library(path)


@pytest.mark.parametrize(
    "change",
    [
        {"trials": None}, {"trials": [None]}, {"trials": [[["a"]]]}, {"trials": [{"name": "a"}]},
        {"trials": {"a": 1}},
        {"trials": [{"name": ["a"], "subject": {}, "split": "train", "file": None}]}, {"settings": None},
        {"settings": [1]}, {"dofs": None}, {"trials": []}, {"trials": 7},
    ],
)  # fmt: skip
def test_metadata_of_another_shape_is_one_clear_error(tmp_path, change):
    path = tmp_path / "lib"
    write_library(path, library_of())
    kind, arrays, metadata = read_digested(path, FORMAT)
    write_digested(path, FORMAT, kind, arrays, metadata | change)
    with pytest.raises(PoseLibraryError) as caught:
        read_library(path)
    assert str(path) in str(caught.value)
    for missing in metadata:
        write_digested(path, FORMAT, kind, arrays, {name: v for name, v in metadata.items() if name != missing})
        with pytest.raises(PoseLibraryError, match="lib"):
            read_library(path)
    for name in arrays:
        write_digested(path, FORMAT, kind, {n: v for n, v in arrays.items() if n != name}, metadata)
        with pytest.raises(PoseLibraryError, match="lib"):
            read_library(path)


def test_a_library_that_breaks_its_own_laws_is_refused():
    library = library_of()
    trials = (Trial("02_06", "02", "test", "a"), Trial("02_07", "02", "train", "b"))
    with pytest.raises(PoseLibraryError, match="subject 02 stands in two splits"):
        dataclasses.replace(library, trials=trials)
    with pytest.raises(PoseLibraryError, match="split 'exam' is unknown; known are train, val, test"):
        library_of(split="exam")
    with pytest.raises(PoseLibraryError, match="joint limits"):
        dataclasses.replace(library, angles=library.angles + np.float32(4.0))
    with pytest.raises(PoseLibraryError, match="a recording that is not there"):
        dataclasses.replace(library, trial=library.trial + np.int32(1))
    with pytest.raises(PoseLibraryError, match="angles is float64"):
        dataclasses.replace(library, angles=library.angles.astype(np.float64))


def test_rows_are_dealt_by_split_and_posture():
    both = joined(
        [library_of(split="test"), dataclasses.replace(library_of(), trials=(Trial("b", "9", "val", "b"),))]
    )
    parts = [both.rows(split, sits) for split in ("train", "val", "test") for sits in (False, True)]
    assert [len(part) for part in parts] == [0, 0, N_STANDING, 3, N_STANDING, 3]
    assert sorted(np.concatenate(parts)) == list(range(len(both)))
    assert both.pose_id(len(ROWS)) == "mocap/val/b/0000"
    assert both.is_upright[0]
    assert not both.is_upright[3]
    assert LINK_IDX["root"] == 0
