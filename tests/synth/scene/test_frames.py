"""Frames keep the laws of labels, splits and seeds."""

import dataclasses

import numpy as np
import pytest

from synth.bodies.poses.families import FAMILIES
from synth.frame import Frame
from synth.render.labels import IS_PART_OF_JOINT
from synth.scene import FrameSource, SceneConfig, SceneWeights
from synth.scene.draw import SceneDraw
from synth.scene.families import SCENE_FAMILIES
from synth.scene.replay import person_of
from synth.scene.soundness import is_sound
from synth.vocabulary import OCCLUDER_CODE

QVGA = SceneConfig(camera="kinect_v1_qvga")
ARRAYS = [f.name for f in dataclasses.fields(Frame) if f.name not in ("camera", "info")]


@pytest.fixture(scope="module")
def frames() -> list[Frame]:
    return list(FrameSource(QVGA, 5, 40))


def assert_equal(a: Frame, b: Frame) -> None:
    for name in ARRAYS:
        assert np.array_equal(getattr(a, name), getattr(b, name)), name


def test_labels_and_depth_agree(frames: list[Frame]) -> None:
    for frame in frames:
        assert np.array_equal(frame.depth > 0, (frame.part > 0) | (frame.occluder > 0))
        assert not ((frame.part > 0) & (frame.occluder > 0)).any()
        assert np.array_equal(frame.instance > 0, frame.occluder > 0)
        assert np.array_equal(frame.body_depth > 0, frame.body_part > 0)
        is_seen = frame.part > 0
        assert np.array_equal(frame.part[is_seen], frame.body_part[is_seen])
        assert np.array_equal(frame.depth[is_seen], frame.body_depth[is_seen])
        is_both = frame.body_part > 0
        assert (frame.depth[is_both] <= frame.body_depth[is_both]).all()


def test_each_instance_has_its_objects_class(frames: list[Frame]) -> None:
    for frame in frames:
        assert [record.instance for record in frame.info.objects] == list(range(1, len(frame.info.objects) + 1))
        for record in frame.info.objects:
            codes = np.unique(frame.occluder[frame.instance == record.instance])
            assert set(codes) <= {OCCLUDER_CODE[record.class_name]}
            assert 0.0 <= record.visible_fraction <= 1.0


def test_joints_lie_near_the_surface_that_is_seen_over_them(frames: list[Frame]) -> None:
    for frame in frames:
        uv = np.rint(frame.joints_2d).astype(int)
        for k in np.flatnonzero(frame.joint_state == 0):
            u, v = uv[k]
            if IS_PART_OF_JOINT[k, frame.part[v, u]]:
                # A thigh that points at the camera hides its hip that far behind it.
                assert -0.45 < frame.depth[v, u] / 1000.0 - frame.joints[k, 2] < 0.10


def test_a_frame_is_made_alone_to_the_byte(frames: list[Frame]) -> None:
    fresh = FrameSource(QVGA, 5, 40)
    for index in (39, 3, 17):
        assert_equal(fresh.frame(index), frames[index])
        assert fresh.frame(index).info == frames[index].info


def test_a_longer_corpus_begins_each_split_with_the_shorter_one(frames: list[Frame]) -> None:
    longer = FrameSource(QVGA, 5, 80)
    assert_equal(longer.frame(0), frames[0])
    first_test = {n: next(i for i in range(n) if FrameSource(QVGA, 5, n).split_of(i) == "test") for n in (40, 80)}
    assert_equal(longer.frame(first_test[80]), frames[first_test[40]])


def test_other_seeds_make_other_frames(frames: list[Frame]) -> None:
    assert not np.array_equal(FrameSource(QVGA, 6, 40).frame(0).depth, frames[0].depth)


def test_splits_share_no_subject_object_or_pose(frames: list[Frame]) -> None:
    seen: dict[str, str] = {}
    for frame in frames:
        names = [frame.info.subject_id, frame.info.pose_id, *(o.spec_id for o in frame.info.objects)]
        for name in names:
            assert seen.setdefault(name, frame.info.split) == frame.info.split
    assert len({frame.info.pose_id for frame in frames}) == len(frames)


def test_the_person_of_a_frame_comes_back(frames: list[Frame]) -> None:
    from synth.bodies.rig.kinematics import joint_positions
    from synth.geometry import inverse, transform_points

    body, pose = person_of(frames[7])
    joints = transform_points(inverse(frames[7].T_world_camera), joint_positions(body.skeleton, pose))
    assert np.allclose(joints, frames[7].joints, atol=1e-5)


@pytest.mark.parametrize("family", list(SCENE_FAMILIES))
def test_every_family_finds_sound_scenes(family: str) -> None:
    source = FrameSource(QVGA, 0, 10)
    draw = SceneDraw(QVGA, source._pools, "train", 0, np.random.default_rng(2))
    drawn = [SCENE_FAMILIES[family](draw) for _ in range(30)]
    assert any(scene is not None and is_sound(scene, QVGA.clearance) for scene in drawn)


def test_a_family_alone_is_drawn_alone_and_visible_share_is_kept() -> None:
    weights = SceneWeights(*[float(name == "clutter") for name in SceneWeights.names()])
    config = dataclasses.replace(QVGA, scenes=weights, visible_share=(0.3, 0.8))
    for frame in FrameSource(config, 1, 6):
        assert frame.info.scene_family == "clutter"
        assert 0.3 <= frame.info.visible_fraction <= 0.8


def test_without_context_objects_do_not_tell_of_the_pose() -> None:
    weights = SceneWeights(*[float(name in ("laptop_table", "stroller")) for name in SceneWeights.names()])
    config = dataclasses.replace(QVGA, scenes=weights, is_context_kept=False)
    pairs = {
        (frame.info.pose_family.split("_")[0], frame.info.scene_family) for frame in FrameSource(config, 3, 16)
    }
    assert {("typing", "stroller"), ("pushing", "laptop_table")} & pairs


def test_bad_arguments_are_refused() -> None:
    with pytest.raises(ValueError, match="seed=-1"):
        FrameSource(QVGA, -1, 4)
    with pytest.raises(ValueError, match="n_frames=0"):
        FrameSource(QVGA, 0, 0)
    with pytest.raises(IndexError, match=r"frame 4 must be in 0\.\.3"):
        FrameSource(QVGA, 0, 4).frame(4)


def test_a_configuration_without_room_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synth.scene.source.MAX_SCENES", 8)
    config = dataclasses.replace(QVGA, visible_share=(0.0, 0.0), scenes=SceneWeights(*[0.0] * 5, 1.0, 0.0))
    with pytest.raises(RuntimeError, match=r"clutter.*8 attempts.*visible_share"):
        FrameSource(config, 0, 1).frame(0)


def alone(family: str, **settings: float) -> list[Frame]:
    weights = dict.fromkeys(SceneWeights.names(), 0.0) | {family: 1.0}
    scene = dataclasses.replace(QVGA, scenes=SceneWeights(**weights), **settings)
    return list(FrameSource(scene, 4, 10))


def sits(frame: Frame) -> bool:
    return FAMILIES[frame.info.pose_family].posture == "sitting"


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_people_alone_sit_and_exercise_as_often_as_asked(share: float) -> None:
    assert [sits(frame) for frame in alone("unhidden", seated_share=share)] == [share == 1.0] * 10
    standing = alone("unhidden", seated_share=0.0, exercising_share=share)
    assert [frame.info.pose_family == "exercising" for frame in standing] == [share == 1.0] * 10


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_people_stand_at_tables_as_often_as_asked(share: float) -> None:
    assert [not sits(frame) for frame in alone("table", standing_at_table_share=share)] == [share == 1.0] * 10


def test_whose_hem_would_be_in_the_floor_makes_no_scene() -> None:
    scene = dataclasses.replace(QVGA, seated_share=0.0, exercising_share=1.0, child_share=0.0)
    draw = SceneDraw(scene, FrameSource(scene, 5, 8)._pools, "train", 0, np.random.default_rng(0))
    drawn = SCENE_FAMILIES["unhidden"](draw)
    while drawn is None:
        drawn = SCENE_FAMILIES["unhidden"](draw)
    assert is_sound(drawn, scene.clearance)
    sunk = drawn.person.vertices - np.array([0.0, 0.0, 0.02])
    below = dataclasses.replace(drawn, person=dataclasses.replace(drawn.person, vertices=sunk), objects=())
    assert not is_sound(below, scene.clearance)
