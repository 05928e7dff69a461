"""Live topics: the newest image is taken, results are said; ROS 2 as a recorded fake, ROS 1 with a real roscore."""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections import defaultdict
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="rosbags is not installed")

from forests.frames import Intrinsics
from pipelines.errors import UserError
from pipelines.online.messages import NS, CameraFrame, Notice
from pipelines.online.ros.definitions import ros2_types
from pipelines.online.ros.making import Maker
from pipelines.online.wires.publishing import Publisher
from pipelines.online.wires.ros1 import DEBIAN, Maker1, ros1_types
from pipelines.online.wires.ros2 import Ros2Wire
from pipelines.online.wires.source import TopicSource
from tests.pipelines.online.test_record import recorded  # noqa: F401
from tests.pipelines.online.test_system import frame_at, system_of
from tests.pipelines.online.walkers import FPS, detected, walk

TOPIC = "/camera/depth/image_raw"
PEOPLE = "/spencer/perception_internal/people_tracking/rgbd_front_top/tracked_persons"
IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"


class FakeWire:
    """A middleware whose messages the test hands over."""

    def __init__(self, topics=((TOPIC, IMAGE),)):
        self.maker, self.said, self.handlers, self.is_up = Maker(), [], {}, True
        self._topics = dict(topics)

    def topics(self):
        return self._topics

    def subscribe(self, topic, type_name, handler, is_latched=False):
        self.handlers[topic] = handler

    def publish(self, out):
        self.said.append(out)

    def is_open(self):
        return self.is_up


def image_of(maker, k, depth=2000, encoding="16UC1"):
    return maker.make(
        IMAGE,
        header=maker.header(k * NS // FPS, "camera"),
        height=48,
        width=64,
        encoding=encoding,
        is_bigendian=0,
        step=128,
        data=np.full((48, 64), depth, np.uint16).view(np.uint8).ravel(),
    )


def info_of(maker):
    zeros = maker.make(
        "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    k = np.array([100.0, 0, 32, 0, 100, 24, 0, 0, 1])
    return maker.make(
        INFO,
        header=maker.header(0, "camera"),
        height=48,
        width=64,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=k,
        r=np.eye(3).ravel(),
        p=np.zeros(12),
        binning_x=0,
        binning_y=0,
        roi=zeros,
    )


def transform_of(maker, parent, child, xyz, stamp=0):
    return maker.make(
        "tf2_msgs/msg/TFMessage",
        transforms=[
            maker.make(
                "geometry_msgs/msg/TransformStamped",
                header=maker.header(stamp, parent),
                child_frame_id=child,
                transform=maker.make(
                    "geometry_msgs/msg/Transform",
                    translation=maker.vector(xyz),
                    rotation=maker.quaternion((-0.5, 0.5, -0.5, 0.5)),  # looks along x
                ),
            )
        ],
    )


def test_the_newest_image_is_taken_with_its_camera_and_pose():
    wire = FakeWire()
    source = TopicSource(wire, TOPIC)
    items = source.frames()
    wire.handlers[TOPIC](image_of(wire.maker, 0))
    missing = next(items)
    assert isinstance(missing, Notice)
    assert missing.kind == "images without a camera"
    wire.handlers["/camera/depth/camera_info"](info_of(wire.maker))
    wire.handlers["/tf_static"](transform_of(wire.maker, "odom", "camera", (1.0, 2.0, 1.4)))
    for k in (1, 2, 3):
        wire.handlers[TOPIC](image_of(wire.maker, k, 1000 + k))
    frame = next(items)
    assert isinstance(frame, CameraFrame)
    assert (frame.stamp, int(frame.depth[0, 0]), source.n_dropped) == (3 * NS // FPS, 1003, 2)
    assert frame.camera == Intrinsics(100.0, 100.0, 32.0, 24.0)
    assert frame.world_frame_id == "odom"
    np.testing.assert_allclose(frame.T_world_camera[:3, 3], [1.0, 2.0, 1.4])
    np.testing.assert_allclose(frame.T_world_camera[:3, 2], [1.0, 0.0, 0.0], atol=1e-12)
    wire.handlers[TOPIC](image_of(wire.maker, 4, encoding="rgb8"))
    assert next(items).kind == "images of encoding rgb8"
    wire.is_up = False
    assert next(items, None) is None


def test_transforms_of_a_long_run_are_forgotten():
    wire = FakeWire()
    source = TopicSource(wire, TOPIC, Intrinsics(100.0, 100.0, 32.0, 24.0))
    items = source.frames()
    for k in range(30, 3000, 30):
        wire.handlers["/tf"](transform_of(wire.maker, "odom", "camera", (k / 100, 0, 1), k * NS // FPS))
        wire.handlers[TOPIC](image_of(wire.maker, k))
        assert next(items).T_world_camera[0, 3] == pytest.approx(k / 100)
    assert len(source._transforms._edges["camera"].stamps) <= 12


@pytest.mark.parametrize(
    ("topics", "words"),
    [((), "nobody publishes it; topics of images: none"), (((TOPIC, INFO),), f"it is of type {INFO}")],
)
def test_a_topic_without_images_is_one_clear_error(topics, words):
    with pytest.raises(UserError, match=words):
        TopicSource(FakeWire(topics), TOPIC, patience_s=0.0)


def test_results_are_said_and_images_are_not_echoed():
    rng = np.random.default_rng(2)
    told = list(detected(walk(rng, n_people=2, n_frames=6), rng, missed=0.0, false=0.0))
    system, _ = system_of(told)
    wire = FakeWire()
    system.bus.subscribe(object, Publisher(wire, system.bus).take)
    for k in range(6):
        system.step(frame_at(k))
    kinds = {out.topic: out.type_name for out in wire.said}
    assert kinds[PEOPLE] == "spencer_tracking_msgs/msg/TrackedPersons"
    assert "/rgbd_front_top/depth/points" in kinds
    assert "/tf" in kinds
    assert not [topic for topic in kinds if topic.endswith(("image_rect_raw", "camera_info"))]
    wire.said.clear()
    system.step(frame_at(6, T_world_camera=np.eye(4)[[2, 0, 1, 3]]))
    assert "/tf" not in {out.topic for out in wire.said}


def test_every_message_can_be_said_in_ros_1(recorded):  # noqa: F811
    """What is written for ROS 1 is what was written for ROS 2, but for what ROS 1 lacks."""
    from pipelines.online.ros.outgoing import Translator

    translators = Translator(), Translator(maker=Maker1())
    n = 0
    for message in recorded[1][:60]:
        for two, one in zip(*(translator.translate(message) for translator in translators), strict=True):
            back = ros1_types().deserialize_ros1(
                ros1_types().serialize_ros1(one.message, one.type_name), one.type_name
            )
            assert (one.topic, one.type_name, one.stamp) == (two.topic, two.type_name, two.stamp)
            assert without_differences(back) == without_differences(two.message)
            n += 1
    assert n > 100


def without_differences(message):
    """A message as nested tuples, without what only one of both has."""
    if hasattr(message, "__dataclass_fields__"):
        fields = message.__dataclass_fields__
        only = {"seq", "texture", "texture_resource", "uv_coordinates", "mesh_file", "__msgtype__"}
        chosen = sorted((f.lower(), f) for f in fields if (f not in only and not f.isupper()) or f in "DKRP")
        return tuple((name, without_differences(getattr(message, f))) for name, f in chosen)
    if isinstance(message, np.ndarray | list | tuple):
        return tuple(without_differences(value) for value in message)
    value = message.item() if isinstance(message, np.generic) else message
    return float(np.float32(value)) if isinstance(value, float) else value


class FakeRclpy:
    """The parts of rclpy that the node uses; what is published comes to the subscriptions, as bytes."""

    def __init__(self, missing=()):
        self.missing, self.is_ok, self.handlers, self.said = missing, True, {}, defaultdict(list)
        self.kinds, self.qos_of = {TOPIC: [IMAGE]}, {}

    def load(self, name):
        if name in self.missing:
            raise ImportError(f"No module named {name!r}")
        if name == "rclpy.qos":
            policy = SimpleNamespace(TRANSIENT_LOCAL="latched", RELIABLE="reliable")
            return SimpleNamespace(
                qos_profile_sensor_data="sensor data",
                QoSProfile=lambda **values: values,
                DurabilityPolicy=policy,
                ReliabilityPolicy=policy,
            )
        return SimpleNamespace(get_message=self.get_message) if name.startswith("rosidl") else self

    def get_message(self, name):
        if name.startswith("hri_msgs/"):
            raise ModuleNotFoundError("No module named 'hri_msgs'")
        return f"class {name}"

    def init(self):
        pass

    def ok(self):
        return self.is_ok

    def shutdown(self):
        self.is_ok = False

    def spin_once(self, node, timeout_sec):
        time.sleep(0.001)

    def create_node(self, name):
        return self

    def destroy_node(self):
        pass

    def get_topic_names_and_types(self):
        return list(self.kinds.items())

    def create_subscription(self, made, topic, handler, qos, raw):
        assert raw
        self.handlers[topic], self.qos_of[topic] = handler, qos

    def create_publisher(self, made, topic, depth):
        def publish(data):
            assert type(data) is bytes
            self.said[topic].append((made, data))

        return SimpleNamespace(publish=publish)


def test_the_node_of_ros_2_hears_and_says_bytes():
    ros = FakeRclpy()
    wire = Ros2Wire(load=ros.load)
    source = TopicSource(wire, TOPIC)
    assert ros.qos_of[TOPIC] == "sensor data"
    assert ros.qos_of["/tf_static"] == {"depth": 100, "durability": "latched", "reliability": "reliable"}

    def send(topic, kind, message):
        ros.handlers[topic](bytes(ros2_types().serialize_cdr(message, kind)))

    send("/camera/depth/camera_info", INFO, info_of(wire.maker))
    send(TOPIC, IMAGE, image_of(wire.maker, 5, 1234))
    frame = next(source.frames())
    assert (frame.stamp, int(frame.depth[3, 3])) == (5 * NS // FPS, 1234)

    system, heard = system_of([])
    system.bus.subscribe(object, Publisher(wire, system.bus).take)
    system.step(frame)
    ((made, data),) = ros.said[PEOPLE]
    assert made == "class spencer_tracking_msgs/msg/TrackedPersons"
    assert ros2_types().deserialize_cdr(data, "spencer_tracking_msgs/msg/TrackedPersons").header.stamp.nanosec > 0
    (notice,) = {m.kind: m for m in heard if isinstance(m, Notice)}.values()
    assert "the package hri_msgs of hri_msgs/msg/IdsList is not installed" in notice.sentence
    wire.close()
    assert not wire.is_open()
    assert next(source.frames(), None) is None


def test_ros_2_that_is_not_installed_is_one_clear_error():
    with pytest.raises(UserError, match="ROS 2 needs rclpy"):
        Ros2Wire(load=FakeRclpy(missing=("rclpy",)).load)


# ROS 1 itself: a roscore, a node that publishes with Debian's own messages and listens, and `undergrowth live`.

PACKAGES = ("rospy", "sensor_msgs", "tf2_msgs", "visualization_msgs")
HAS_ROS1 = all((DEBIAN / name).is_dir() for name in PACKAGES) and shutil.which("roscore")
PEER = """
import struct, time
import rospy
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray
rospy.init_node("peer")
heard = {}
def take(name):
    def note(message):
        heard[name] = heard.get(name, 0) + 1
        if name == "points" and heard[name] == 1:
            z = struct.unpack(f"<{3 * message.width}f", message.data)[2::3]
            print("cloud of", message.width, "points at", set(z), "m in", message.header.frame_id)
    return note
rospy.Subscriber("/rgbd_front_top/depth/points", PointCloud2, take("points"))
rospy.Subscriber("/undergrowth/people", MarkerArray, take("people"))
rospy.Subscriber("/tf", TFMessage, take("tf"))
images = rospy.Publisher("/camera/depth/image_raw", Image, queue_size=1)
infos = rospy.Publisher("/camera/depth/camera_info", CameraInfo, queue_size=1, latch=True)
info = CameraInfo(height=48, width=64, K=[100, 0, 32, 0, 100, 24, 0, 0, 1])
infos.publish(info)
end = time.time() + 60
while time.time() < end and min((heard.get(name, 0) for name in ("points", "people", "tf")), default=0) < 3:
    image = Image(height=48, width=64, encoding="16UC1", step=128)
    image.header.stamp, image.header.frame_id = rospy.Time.now(), "camera"
    image.data = struct.pack("<H", 1500) * (48 * 64)
    images.publish(image)
    time.sleep(1 / 30)
print("heard", sorted(heard))
"""


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


@contextlib.contextmanager
def running(words, **how):
    # Who runs the tests in the background may have them ignore SIGINT, which children would inherit.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **how)
    signal.signal(signal.SIGINT, before)
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.communicate(timeout=15)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


@pytest.mark.skipif(not HAS_ROS1, reason="there is no ROS 1: apt-get install python3-rospy ros-core and messages")
def test_live_hears_and_answers_on_ros_1(tmp_path):
    port = free_port()
    environment = os.environ | {
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
        "ROS_HOME": str(tmp_path),
        "ROS_LOG_DIR": str(tmp_path),
    }
    live = [sys.executable, "-m", "pipelines.cli", "live", f"ros1:{TOPIC}", "--no-processes"]
    how = {"env": environment}
    connect = "from pipelines.online.wires.ros1 import Ros1Wire; Ros1Wire()"
    alone = subprocess.run([sys.executable, "-c", connect], capture_output=True, text=True, check=False, **how)
    assert "UserError: there is no ROS 1 master at http://127.0.0.1" in alone.stderr
    with (
        running(["roscore", "-p", str(port)], **how) as _,
        running(["/usr/bin/python3", "-c", PEER], **how) as peer,
        running([*live, "--frames", "2000"], **how) as process,
    ):
        told, _ = peer.communicate(timeout=90)
        assert "cloud of 192 points at {1.5000001192092896} m in camera" in told
        assert "heard ['people', 'points', 'tf']" in told
        process.send_signal(2)
        said, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    assert " images, 0 tracks," in said
    assert "Traceback" not in said
