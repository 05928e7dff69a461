"""Clips and several cameras: frames that can be made alone, people who stay who they are, and clear refusals."""

import numpy as np
import pytest

from synth.frame import Moment
from synth.geometry import inverse, transform_points
from synth.scene import ClipSource, FrameSource, RoomSource, SceneConfig
from synth.scene.clips.config import ActWeights, CameraMoves
from synth.scene.config import SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights

SMALL = {"camera": "custom", "intrinsics": (128, 106, 91.4, 91.4, 63.7, 51.3)}
ROOMS = RoomConfig(kinds=RoomWeights(office=1.0, hall=1.0))
ONLY_TRAIN = SplitShares(1.0, 0.0, 0.0)


def clips(**changes):
    settings = {
        "clip": 20,
        "fps": 10.0,
        "room": ROOMS,
        "splits": ONLY_TRAIN,
        "people": PeopleConfig(number=(2, 2)),
    }
    return SceneConfig(**SMALL, **settings | changes)


@pytest.fixture(scope="module")
def frames():
    """The frames of two clips."""
    source = ClipSource(clips(), 11, 40)
    return [source.frame(k) for k in range(40)]


def same(a, b):
    return a.depth.tobytes() == b.depth.tobytes() and a.info == b.info and a.moment == b.moment


def test_any_frame_of_a_clip_can_be_made_alone(frames):
    for k in (33, 7):
        assert same(ClipSource(clips(), 11, 40).frame(k), frames[k])


def test_clips_do_not_depend_on_how_many_there_are(frames):
    assert same(ClipSource(clips(), 11, 80).frame(25), frames[25])


def test_frames_are_numbered_by_clip_and_time(frames):
    assert [frame.moment for frame in frames] == [Moment(k // 20, k % 20, 0) for k in range(40)]


def test_people_stay_who_they_are(frames):
    for clip in (frames[:20], frames[20:]):
        who = [[(one.number, one.subject_id, one.pose_id) for one in frame.info.people] for frame in clip]
        assert all(people == who[0] for people in who)
        assert len({one[1] for one in who[0]}) == 2


def test_motion_labels_agree_with_the_joints(frames):
    for before, frame, after in zip(frames[:18], frames[1:19], frames[2:20], strict=True):
        for k, view in enumerate(frame.people):
            world = transform_points(frame.T_world_camera, view.joints)
            np.testing.assert_allclose(world, view.motion.joints_world, atol=1e-4)
            moved = (after.people[k].motion.joints_world - before.people[k].motion.joints_world) * 10.0 / 2.0
            assert np.abs(moved - view.motion.velocity).max() < 1.5
    speeds = [np.linalg.norm(view.motion.velocity, axis=1).max() for frame in frames for view in frame.people]
    assert max(speeds) > 0.3
    contacts = np.array([view.motion.contacts for frame in frames for view in frame.people])
    assert set(np.unique(contacts)) == {0, 1}
    assert contacts[:, :4].any(axis=1).mean() > 0.95


def test_people_keep_apart(frames):
    for frame in frames:
        places = [view.T_world_root[:2, 3] for view in frame.people]
        assert np.hypot(*(places[0] - places[1])) > 0.6


def test_the_camera_moves_as_it_is_told():
    for name in ("stand", "pan", "drive"):
        moves = CameraMoves(**{"stand": 0.0, "pan": 0.0, "drive": 0.0} | {name: 1.0})
        eyes = ClipSource(clips(camera_moves=moves), 3, 20).clip("train", 0).stage.eyes[0]
        way = np.linalg.norm(np.diff(eyes[:, :3, 3], axis=0), axis=1)
        turn = np.einsum("nk,nk->n", eyes[1:, :3, 2], eyes[:-1, :3, 2])
        assert (way.max() > 0.005) == (name == "drive")
        assert (turn.min() < 1.0 - 1e-6) == (name != "stand")
        assert way.max() < 0.13


def test_sitters_have_a_seat_and_touch_it():
    source = ClipSource(clips(acts=ActWeights(0.0, 0.0, 1.0), people=PeopleConfig(number=(1, 1))), 5, 60)
    drawn = [source.frame(k) for k in range(60)]
    assert all(frame.info.people[0].seat == len(frame.info.objects) for frame in drawn)
    assert any(frame.people[0].motion.contacts[4] for frame in drawn)
    names = {frame.info.people[0].activity.split("_")[0] for frame in drawn}
    assert "sit" in names


@pytest.mark.parametrize(("rig", "cameras"), [("corners", 3), ("front_top", 2), ("stereo", 2)])
def test_all_cameras_of_a_clip_see_the_same_people(rig, cameras):
    source = ClipSource(clips(cameras=cameras, rig=rig, clip=4), 2, 4 * cameras)
    for step in range(4):
        views = [source.frame(step * cameras + k) for k in range(cameras)]
        assert [view.moment for view in views] == [Moment(0, step, k) for k in range(cameras)]
        for k in range(2):
            placed = [transform_points(view.T_world_camera, view.people[k].joints) for view in views]
            for other in placed[1:]:
                np.testing.assert_allclose(other, placed[0], atol=1e-4)
    if rig == "front_top":
        np.testing.assert_allclose(views[1].T_world_camera[:3, 2], (0.0, 0.0, -1.0), atol=1e-9)
    if rig == "stereo":
        T = inverse(views[0].T_world_camera) @ views[1].T_world_camera
        np.testing.assert_allclose(T[:3, 3], (0.12, 0.0, 0.0), atol=1e-9)


@pytest.mark.parametrize("make", [FrameSource, RoomSource])
@pytest.mark.parametrize(("rig", "cameras"), [("corners", 3), ("front_top", 2), ("stereo", 2)])
def test_single_scenes_are_seen_by_several_cameras(make, rig, cameras):
    room = ROOMS if make is RoomSource else RoomConfig()
    people = PeopleConfig(number=(1, 2)) if make is RoomSource else PeopleConfig()
    size = {"camera": "custom", "intrinsics": (192, 160, 137.0, 137.0, 95.5, 79.5)}
    config = SceneConfig(**size, cameras=cameras, rig=rig, splits=ONLY_TRAIN, room=room, people=people)
    source = make(config, 4, 2 * cameras)
    drawn = [source.frame(k) for k in range(2 * cameras)]
    assert same(make(config, 4, 2 * cameras).frame(cameras + 1), drawn[cameras + 1])
    for first in (0, cameras):
        placed = []
        for frame in drawn[first : first + cameras]:
            joints = frame.people[0].joints if make is RoomSource else frame.joints
            placed.append(transform_points(frame.T_world_camera, joints))
        for other in placed[1:]:
            np.testing.assert_allclose(other, placed[0], atol=1e-4)
        assert len({frame.T_world_camera.tobytes() for frame in drawn[first : first + cameras]}) == cameras


def test_settings_that_are_not_used_are_not_told():
    plain = SceneConfig().told()
    assert not {"cameras", "rig", "clip", "fps", "acts", "camera_moves"} & set(plain)
    assert {"cameras", "rig"} <= set(SceneConfig(cameras=2).told())
    assert {"clip", "fps", "acts", "camera_moves"} <= set(clips().told())


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"clip": 60}, "needs a room to walk in"),
        ({"cameras": 9}, "cameras=9 must be in 1..8"),
        ({"cameras": 3, "rig": "stereo"}, "has two cameras"),
        ({"rig": "ring"}, "rig='ring' is unknown; known are corners, front_top, stereo"),
        ({"clip": -1}, "clip=-1 must be in"),
        ({"fps": 0.0}, "fps=0.0 must be in"),
    ],
)
def test_contradictory_settings_are_refused(settings, words):
    with pytest.raises(ValueError, match=words.replace(".", r"\.")):
        SceneConfig(**settings)


def test_clips_are_not_cut():
    with pytest.raises(ValueError, match="n_frames=30 must be a multiple of 20"):
        ClipSource(clips(), 0, 30)


def test_a_room_without_free_floor_is_one_clear_error():
    tiny = RoomConfig(kinds=RoomWeights(living=1.0), sides=(1.5, 1.6), furniture=0.0)
    with pytest.raises(RuntimeError, match="no free way through the room"):
        ClipSource(clips(room=tiny, people=PeopleConfig(number=(1, 1)), clip=4), 0, 4).frame(0)


def test_cameras_that_see_nobody_are_one_clear_error():
    """Cameras high above that look about straight ahead."""
    tall = RoomConfig(kinds=RoomWeights(hall=1.0), furniture=0.0, ceiling=(10.0, 11.0))
    changes = {"acts": ActWeights(1.0, 0.0, 0.0), "camera_moves": CameraMoves(1.0, 0.0, 0.0), "mounting": "desk"}
    config = clips(room=tall, height=(9.0, 9.5), clip=2, people=PeopleConfig(number=(1, 1)), **changes)
    with pytest.raises(RuntimeError, match="a camera never saw anybody"):
        ClipSource(config, 0, 2).frame(0)


def test_nobody_may_be_there():
    frame = ClipSource(clips(people=PeopleConfig(number=(0, 0)), clip=2), 1, 2).frame(1)
    assert frame.people == ()
    assert not frame.person.any()
