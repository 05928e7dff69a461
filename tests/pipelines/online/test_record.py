"""What is recorded is read back, by another library and by our own reader."""

from collections import defaultdict

import cv2
import numpy as np
import pytest

from forests.frames import Intrinsics
from pipelines.errors import UserError
from pipelines.online.messages import NS, CameraFrame, Notice, TrackedPersons, TrackSkeleton
from tests.pipelines.online.test_system import T_FLOOR_CAMERA, frame_at, system_of
from tests.pipelines.online.walkers import FPS, detected, walk

pytest.importorskip("rosbags", reason="rosbags is not installed")
from pipelines.online.ros.record import Recorder
from pipelines.online.sources.bag import BagSource

JOINTS = ("head", "neck", "torso", "r_shoulder", "l_shoulder", "r_elbow", "l_elbow", "r_hand", "l_hand")
N = 20


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The path of a recording, and all that was told."""
    rng = np.random.default_rng(11)
    system, heard = system_of(list(detected(walk(rng, n_people=3, n_frames=N), rng, missed=0.0, false=0.0)))
    path = tmp_path_factory.mktemp("record") / "out.mcap"
    with Recorder(path) as recorder:
        system.bus.subscribe(object, recorder.take)
        for k in range(N):
            system.step(frame_at(k, depth=np.full((48, 64), 1000 + k, np.uint16)))
        positions = rng.uniform(-1, 2, (9, 3)).astype(np.float32)
        positions[4] = np.nan
        values = (np.full(9, value, np.float32) for value in (0.8, 0.03, 0.1))
        skeleton = TrackSkeleton((N - 1) * NS // FPS, "floor", 1, "walks", JOINTS, positions, *values)
        system.bus.publish(skeleton)
    assert list(path.parent.iterdir()) == [path]
    assert not [message for message in heard if isinstance(message, Notice)]
    return path, heard


@pytest.fixture(scope="module")
def read_back(recorded):
    """By topic, the messages, as mcap-ros2-support reads them."""
    mcap = pytest.importorskip("mcap_ros2.reader", reason="mcap-ros2-support is not installed")
    topics = defaultdict(list)
    for item in mcap.read_ros2_messages(str(recorded[0])):
        topics[item.channel.topic].append(item.ros_msg)
    return topics


def stamp_of(message):
    return message.header.stamp.sec * NS + message.header.stamp.nanosec


def test_tracks_keep_number_place_and_covariance(recorded, read_back):
    told = [m for m in recorded[1] if isinstance(m, TrackedPersons)]
    found = read_back["/spencer/perception_internal/people_tracking/rgbd_front_top/tracked_persons"]
    assert [stamp_of(m) for m in found] == [m.stamp for m in told]
    assert any(m.persons for m in told)
    for one, other in zip(told, found, strict=True):
        assert other.header.frame_id == "floor"
        assert [t.track_id for t in other.tracks] == [p.track_id for p in one.persons]
        for person, track in zip(one.persons, other.tracks, strict=True):
            at = track.pose.pose.position
            np.testing.assert_allclose((at.x, at.y), person.place)
            np.testing.assert_allclose(
                np.reshape(track.pose.covariance, (6, 6))[:2, :2], person.covariance[:2, :2]
            )
            assert track.pose.covariance[14] > 99999
            assert track.is_matched == (person.detection is not None)


def test_bodies_follow_rep_155(recorded, read_back):
    last = [m for m in recorded[1] if isinstance(m, TrackedPersons)][-1]
    ids = read_back["/humans/bodies/tracked"][-1].ids
    assert ids == [f"b{p.track_id:05d}" for p in last.persons]
    for name in ids:
        roi = read_back[f"/humans/bodies/{name}/roi"][-1]
        assert 0 <= roi.xmin < roi.xmax <= 1
        assert read_back[f"/humans/bodies/{name}/position"][-1].header.frame_id == "floor"


def test_a_skeleton_has_stamp_track_and_confidence(recorded, read_back):
    told = next(m for m in recorded[1] if isinstance(m, TrackSkeleton))
    topic = "/spencer/perception_internal/detailed_upper_body_analysis/rgbd_front_top/upper_body_skeleton"
    (found,) = read_back[topic]
    assert stamp_of(found) == told.stamp
    assert found.track_id == 1
    assert tuple(found.names) == JOINTS
    np.testing.assert_allclose([(p.x, p.y, p.z) for p in found.positions], told.positions)
    np.testing.assert_allclose(found.confidence, 0.8, rtol=1e-6)
    (markers,) = read_back["/undergrowth/skeletons"]
    # Of the eight bones of an upper body, two need the left shoulder, which is not known.
    assert len(markers.markers[0].points) == 2 * 6


def test_clouds_transforms_and_orientations_are_there(read_back):
    cloud = read_back["/rgbd_front_top/depth/points"][-1]
    assert cloud.width == 12 * 16
    points = np.frombuffer(cloud.data, np.float32).reshape(-1, 3)
    np.testing.assert_allclose(points[:, 2], 1.0 + (N - 1) / 1000, rtol=1e-6)
    (transform,) = read_back["/tf"][-1].transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("floor", "camera")
    assert read_back["/undergrowth/people"][-1].markers
    facing = read_back["/spencer/perception_internal/detailed_body_analysis/rgbd_front_top/body_orientation"]
    assert facing[-1].track_id >= 1


def test_a_recording_plays_again(recorded):
    frames = list(BagSource(recorded[0]).frames())
    assert [f.stamp for f in frames] == [k * NS // FPS for k in range(N)]
    for k, frame in enumerate(frames):
        assert (frame.depth == 1000 + k).all()
        assert frame.camera == Intrinsics(100, 100, 32, 24)
        np.testing.assert_allclose(frame.T_world_camera, T_FLOOR_CAMERA, atol=1e-9)


def bag_of(path, is_ros1, items, infos=True):
    """A bag with images, each an encoding and an array, and a camera."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC if is_ros1 else Stores.ROS2_HUMBLE)
    made = types.types

    def header(k):
        stamp = made["builtin_interfaces/msg/Time"](sec=5, nanosec=k)
        extra = {"seq": k} if is_ros1 else {}
        return made["std_msgs/msg/Header"](stamp=stamp, frame_id="optical", **extra)

    def write(writer, topic, kind, message, k):
        if topic not in connections:
            connections[topic] = writer.add_connection(topic, kind, typestore=types)
        serialize = types.serialize_ros1 if is_ros1 else types.serialize_cdr
        writer.write(connections[topic], 5 * NS + k, serialize(message, kind))

    connections = {}
    with Writer1(path) if is_ros1 else Writer2(path, version=9) as writer:
        if infos:
            names = "DKRP" if is_ros1 else "dkrp"
            k = np.array([50.0, 0, 4, 0, 60, 3, 0, 0, 1])
            values = (np.zeros(5), k, np.eye(3).ravel(), np.zeros(12))
            roi = made["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
            kind = "sensor_msgs/msg/CameraInfo"
            info = made[kind](
                header=header(0), height=6, width=8, distortion_model="", binning_x=0, binning_y=0, roi=roi,
                **dict(zip(names, values, strict=True)),
            )  # fmt: skip
            write(writer, "/cam/depth/camera_info", kind, info, 0)
        for k, (encoding, array) in enumerate(items, 1):
            if "png" in encoding:
                kind, data = "sensor_msgs/msg/CompressedImage", np.frombuffer(array, np.uint8)
                write(writer, "/cam/depth/compressed", kind, made[kind](header(k), encoding, data), k)
            else:
                kind, data = "sensor_msgs/msg/Image", np.ascontiguousarray(array).view(np.uint8).ravel()
                height, width = array.shape[:2]
                image = made[kind](header(k), height, width, encoding, 0, len(data) // max(height, 1), data)
                write(writer, "/cam/depth/image", kind, image, k)


DEPTH = (np.arange(48, dtype=np.uint16).reshape(6, 8) * 50 + 500).astype(np.uint16)


@pytest.mark.parametrize("is_ros1", [True, False])
def test_depth_of_both_encodings_is_read(tmp_path, is_ros1):
    metres = (DEPTH / 1000).astype(np.float32)
    metres[0, :3] = np.nan, np.inf, -1.0
    path = tmp_path / ("a.bag" if is_ros1 else "a")
    bag_of(path, is_ros1, [("16UC1", DEPTH), ("32FC1", metres)])
    whole, reals = BagSource(path).frames()
    np.testing.assert_array_equal(whole.depth, DEPTH)
    assert (reals.depth[0, :3] == 0).all()
    np.testing.assert_array_equal(reals.depth[1:], DEPTH[1:])
    assert whole.camera == Intrinsics(50, 60, 4, 3)
    assert whole.stamp == 5 * NS + 1
    assert whole.T_world_camera is None


@pytest.mark.parametrize("is_ros1", [True, False])
def test_compressed_depth_is_read(tmp_path, is_ros1):
    png = cv2.imencode(".png", DEPTH)[1].tobytes()
    a, b = 10.0, 1.0
    inverse = np.rint(a / (DEPTH / 1000) + b).astype(np.uint16)
    quantised = np.array([a, b], "<f4").tobytes() + cv2.imencode(".png", inverse)[1].tobytes()
    path = tmp_path / ("a.bag" if is_ros1 else "a")
    items = [
        ("16UC1; png", png),
        ("16UC1; compressedDepth png", bytes(12) + png),
        ("32FC1; compressedDepth png", bytes(4) + quantised),
    ]
    bag_of(path, is_ros1, items)
    plain, compressed, reals = BagSource(path).frames()
    np.testing.assert_array_equal(plain.depth, DEPTH)
    np.testing.assert_array_equal(compressed.depth, DEPTH)
    expected = np.rint(1000 * a / (inverse.astype(float) - b))
    np.testing.assert_array_equal(reals.depth, expected)


def test_bad_images_are_told_and_the_good_ones_read(tmp_path):
    path = tmp_path / "a"
    bag_of(path, False, [("rgb8", np.zeros((6, 24), np.uint8)), ("16UC1", DEPTH), ("16UC1", DEPTH[:, :4][:0])])
    told = list(BagSource(path).frames())
    assert [type(item) for item in told] == [Notice, CameraFrame, Notice]
    assert told[0].kind == "images of encoding rgb8"
    assert told[2].kind == "damaged images"


def test_images_without_a_camera_are_told_unless_it_is_given(tmp_path):
    path = tmp_path / "a"
    bag_of(path, False, [("16UC1", DEPTH)] * 3, infos=False)
    assert [item.kind for item in BagSource(path).frames()] == ["images without a camera"] * 3
    camera = Intrinsics(50, 50, 4, 3)
    assert [frame.camera for frame in BagSource(path, camera=camera).frames()] == [camera] * 3


def test_a_damaged_or_foreign_recording_is_one_clear_error(tmp_path):
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\nnonsense")
    (tmp_path / "a.mcap").write_bytes(b"nonsense")
    for name in ("a.bag", "a.mcap", "missing.mcap"):
        with pytest.raises(UserError, match=name):
            list(BagSource(tmp_path / name).frames())
    bag_of(tmp_path / "b", False, [("16UC1", DEPTH)])
    with pytest.raises(UserError, match="/cam/depth/image"):
        list(BagSource(tmp_path / "b", topic="/other").frames())
