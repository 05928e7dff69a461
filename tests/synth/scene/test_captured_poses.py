"""Scenes with recorded poses keep the laws of those with procedural ones."""

import dataclasses

import igl
import numpy as np
import pytest

from synth.bodies.poses.library import FOOT_DOWN, FOOT_FLAT, PoseLibrary, Trial
from synth.bodies.rig.skinning import posed_mesh
from synth.frame import Frame
from synth.geometry import surface_points
from synth.scene import FrameSource, PoseMix, SceneConfig, SceneWeights
from synth.scene.replay import occluder_of, person_of
from tests.mocap_files import SIT, STAND, degrees

SMALL = SceneConfig(camera="custom", intrinsics=(160, 120, 142.0, 142.0, 79.5, 59.5))
ARRAYS = [f.name for f in dataclasses.fields(Frame) if f.name not in ("camera", "info")]
SPLITS = ("train", "val", "test")


def library(splits: tuple[str, ...] = SPLITS, sits: bool = True) -> PoseLibrary:
    """A few standing and sitting poses for each split."""
    rng = np.random.default_rng(4)
    angles, trial, is_sitting, feet = [], [], [], []
    for k in range(len(splits)):
        for is_seated in (False, True) if sits else (False,):
            for _ in range(4):
                jitter = degrees(
                    shoulder_flexion=float(rng.uniform(0, 50)), elbow_flexion=float(rng.uniform(0, 30)),
                    shoulder_abduction=float(rng.uniform(5, 20)), lumbar_flexion=float(rng.uniform(0, 10)),
                    head_rotation=float(rng.uniform(-20, 20)), l_hip_flexion=float(rng.uniform(0, 15)),
                )  # fmt: skip
                angles.append((SIT if is_seated else STAND) + jitter)
                trial.append(k)
                is_sitting.append(is_seated)
                feet.append((FOOT_DOWN if not is_seated else FOOT_FLAT, FOOT_FLAT))
    n = len(angles)
    return PoseLibrary(
        "mocap", tuple(Trial(f"0{k}_01", f"0{k}", split, f"0{k}_01.bvh") for k, split in enumerate(splits)),
        np.stack(angles).astype(np.float32), np.tile(np.eye(3, dtype=np.float32), (n, 1, 1)), np.array(is_sitting),
        np.array(feet, dtype=np.uint8), np.array(trial, dtype=np.int32), np.arange(n, dtype=np.int32), {},
    )  # fmt: skip


def only(*families: str) -> SceneConfig:
    return dataclasses.replace(
        SMALL, scenes=SceneWeights(*[float(name in families) for name in SceneWeights.names()])
    )


def assert_same(a: Frame, b: Frame) -> None:
    for name in ARRAYS:
        assert np.array_equal(getattr(a, name), getattr(b, name)), name
    assert a.info == b.info


@pytest.fixture(scope="module")
def frames() -> list[Frame]:
    return list(FrameSource(SMALL, 5, 20, poses=PoseMix(library(), 1.0)))


def test_every_person_comes_from_the_library_and_from_the_frames_own_split(frames):
    for frame in frames:
        source, split, _, number = frame.info.pose_id.split("/")
        assert (source, split) == ("mocap", frame.info.split)
        assert frame.info.pose_family.startswith("mocap_")
        assert library().trials[int(library().trial[int(number)])].split == split


def test_a_frame_is_made_alone_to_the_byte(frames):
    fresh = FrameSource(SMALL, 5, 20, poses=PoseMix(library(), 1.0))
    for index in (19, 4, 11):
        assert_same(fresh.frame(index), frames[index])


def test_splits_left_out_are_procedural_to_the_byte():
    plain = FrameSource(SMALL, 5, 12)
    mixed = FrameSource(SMALL, 5, 12, poses=PoseMix(library(("test",)), 1.0, ("test",)))
    for index in range(12):
        if plain.split_of(index) == "test":
            assert mixed.frame(index).info.pose_id.startswith("mocap/test/")
        else:
            assert_same(mixed.frame(index), plain.frame(index))


def test_the_share_of_recorded_poses_is_kept():
    source = FrameSource(only("unhidden"), 2, 80, poses=PoseMix(library(), 0.25))
    n_recorded = sum(frame.info.pose_id.startswith("mocap/") for frame in source)
    assert 8 <= n_recorded <= 34


def test_a_library_without_people_who_sit_leaves_sitting_to_the_families():
    source = FrameSource(only("laptop_lap"), 2, 3, poses=PoseMix(library(sits=False), 1.0))
    assert all(frame.info.pose_id.startswith("pose/") for frame in source)


@pytest.mark.parametrize("family", ["unhidden", "table", "laptop_table", "laptop_lap", "stroller", "clutter"])
def test_nothing_sinks_into_the_person_and_contacts_are_where_they_belong(family):
    for frame in FrameSource(only(family), 8, 2, poses=PoseMix(library(), 1.0)):
        body, pose = person_of(frame)
        skin = posed_mesh(body, pose)
        assert skin.vertices[:, 2].min() > -0.01
        hands = {"laptop_table": "laptop", "laptop_lap": "laptop", "stroller": "stroller"}.get(family)
        touched = [record.class_name for record in frame.info.objects if "l_hand" in record.contacts]
        assert hands is None or hands in touched
        for record in frame.info.objects:
            mesh = occluder_of(record).mesh.transformed(record.T_world_object)
            points = surface_points(mesh, 0.02).astype(np.float64)
            inside = igl.signed_distance(points, skin.vertices.astype(np.float64), skin.faces.astype(np.int64))[0]
            assert inside.min() > -0.01


def test_a_mix_that_makes_no_sense_is_refused():
    with pytest.raises(ValueError, match=r"share=1\.5"):
        PoseMix(library(), 1.5)
    with pytest.raises(ValueError, match="split 'exam' is unknown; known are train, val, test"):
        PoseMix(library(), 0.5, ("exam",))
    with pytest.raises(ValueError, match="no poses for split 'val'; leave that split out"):
        PoseMix(library(("train", "test")))
