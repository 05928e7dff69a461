"""ROS 1 by rospy, as Debian packages it; types come from rosbags, so that no package of messages is needed."""

import importlib
import sys
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from pipelines.errors import UserError
from pipelines.online.ros.definitions import HRI, OWN, SPENCER, load_rosbags
from pipelines.online.ros.making import Maker, Outgoing
from pipelines.online.wires.wire import Handler

DEBIAN = Path("/usr/lib/python3/dist-packages")
"""Where Debian's python3-rospy lies, which is made for the Python of the system and runs with others."""
TRANSFORMS = {"tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n"}
"""What rosbags' types of ROS 1 lack."""
QUEUE = 10
"""Messages of a topic that wait to be sent."""
IMAGE_BYTES = 1 << 24
"""Bytes that are read at once: more than an image has, else images pile up."""


def load_rospy() -> Any:
    """The module rospy, also where it is installed for the Python of the system alone.

    Raises:
        UserError: It is not installed; says how to get it.
    """
    if (DEBIAN / "rospy").is_dir() and str(DEBIAN) not in sys.path:
        sys.path.append(str(DEBIAN))  # last, so that nothing of ours is replaced
    try:
        return importlib.import_module("rospy")
    except ImportError as error:
        raise UserError(f"ROS 1 needs rospy ({error}); on Debian: apt-get install python3-rospy") from None


@lru_cache(maxsize=1)
def ros1_types() -> Any:
    """All types that are written, those of ROS 1 Noetic among them."""
    load_rosbags()
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    for name, text in (TRANSFORMS | HRI | SPENCER | OWN).items():
        store.register(get_types_from_msg(text, name))
    return store


class Maker1(Maker):
    """Makes messages of ROS 1, whose headers count, whose cameras have capital letters, and whose markers have less."""

    def __init__(self) -> None:
        self._types = ros1_types().types

    def make(self, name: str, /, **values: Any) -> Any:
        """A message of a type with the values of its fields, but for those that ROS 1 does not have.

        A type that is not there is that of such a field; None stands for its messages.
        """
        made = self._types.get(name)
        if made is None:
            return None
        given = {"seq": 0} | values
        names = {field: field if field in given else field.lower() for field in made.__dataclass_fields__}
        return made(**{field: given[name] for field, name in names.items() if name in given})


class Ros1Wire:
    """A node of ROS 1. A process can have one in its life.

    Attributes:
        maker: Makes messages of ROS 1.
    """

    def __init__(self, name: str = "undergrowth") -> None:
        """Connects to the master that ROS_MASTER_URI names.

        Raises:
            UserError: rospy or rosbags is not installed, or there is no master.
        """
        self._rospy = load_rospy()
        self.maker: Maker = Maker1()
        import rosgraph

        master = rosgraph.Master(f"/{name}")
        try:
            master.getPid()
        except (OSError, rosgraph.MasterException) as error:
            raise UserError(f"there is no ROS 1 master at {master.master_uri} ({error}); start roscore") from None
        self._rospy.init_node(name, anonymous=True, disable_signals=True)
        self._publishers: dict[str, tuple[Any, type]] = {}

    def topics(self) -> Mapping[str, str]:
        """Types of the topics that somebody publishes."""
        return {name: kind.replace("/", "/msg/") for name, kind in self._rospy.get_published_topics()}

    def subscribe(self, topic: str, type_name: str, handler: Handler, is_latched: bool = False) -> None:
        """Has every message of a topic handed to a function; ROS 1 sends latched messages of itself."""
        store = ros1_types()

        def take(raw: Any) -> None:
            handler(store.deserialize_ros1(raw._buff, type_name))

        # One message may wait: of images, a newer one is of more use than an older.
        queue = 1 if type_name.startswith("sensor_msgs/") else None
        self._rospy.Subscriber(topic, self._rospy.AnyMsg, take, queue_size=queue, buff_size=IMAGE_BYTES)

    def publish(self, out: Outgoing) -> None:
        """Says something."""
        if out.topic not in self._publishers:
            made = _message_class(self._rospy, out.type_name)
            self._publishers[out.topic] = self._rospy.Publisher(out.topic, made, queue_size=QUEUE), made
        publisher, made = self._publishers[out.topic]
        publisher.publish(made(ros1_types().serialize_ros1(out.message, out.type_name)))

    def is_open(self) -> bool:
        """Whether the node has not been shut down."""
        return not self._rospy.is_shutdown()

    def close(self) -> None:
        """Leaves."""
        self._rospy.signal_shutdown("the source has ended")


@lru_cache(maxsize=64)
def _message_class(rospy: Any, type_name: str) -> type:
    """A class of messages that are bytes already, as rospy publishes them."""
    text, digest = ros1_types().generate_msgdef(type_name, ros_version=1)

    class Bytes(rospy.Message):
        _type, _md5sum, _full_text = type_name.replace("/msg/", "/"), digest, text
        _has_header = False
        __slots__ = ("data",)
        _slot_types = ("uint8[]",)

        def __init__(self, data: Any) -> None:
            self.data = data

        def serialize(self, buffer: Any) -> None:
            buffer.write(self.data)

        def _check_types(self, _: object = None) -> None:
            """Bytes need no checks."""

    return Bytes
