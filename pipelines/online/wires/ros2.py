"""ROS 2 by rclpy: a thin node that sends and hears bytes, which rosbags makes and reads. Not run on a robot yet."""

import importlib
import threading
from collections.abc import Callable, Mapping
from typing import Any

from pipelines.errors import UserError
from pipelines.online.ros.definitions import ros2_types
from pipelines.online.ros.making import Maker, Outgoing
from pipelines.online.wires.wire import Handler, UnknownTypeError

DEPTH = 10
"""Messages of a topic that wait."""


class Ros2Wire:
    """A node of ROS 2.

    Attributes:
        maker: Makes messages of ROS 2.
    """

    def __init__(self, name: str = "undergrowth", load: Callable[[str], Any] = importlib.import_module) -> None:
        """Starts a node that spins on a thread of its own.

        Args:
            name: Of the node.
            load: Imports rclpy and what belongs to it by name.

        Raises:
            UserError: rclpy or rosbags is not installed.
        """
        self.maker: Maker = Maker()
        try:
            self._rclpy, self._qos = load("rclpy"), load("rclpy.qos")
            self._type_named = load("rosidl_runtime_py.utilities").get_message
        except ImportError as error:
            raise UserError(
                f"ROS 2 needs rclpy ({error}); source the setup.bash of a ROS 2 installation"
            ) from None
        self._rclpy.init()
        self._node = self._rclpy.create_node(name)
        self._publishers: dict[str, Any] = {}
        self._spinning = threading.Thread(target=self._spin, name="rclpy", daemon=True)
        self._spinning.start()

    def _spin(self) -> None:
        while self._rclpy.ok():
            self._rclpy.spin_once(self._node, timeout_sec=0.1)

    def _class_of(self, type_name: str) -> Any:
        try:
            return self._type_named(type_name)
        except (ImportError, AttributeError, ValueError) as error:
            package = type_name.partition("/")[0]
            raise UnknownTypeError(f"the package {package} of {type_name} is not installed ({error})") from None

    def topics(self) -> Mapping[str, str]:
        """Types of the topics that somebody publishes."""
        return {name: kinds[0] for name, kinds in self._node.get_topic_names_and_types() if kinds}

    def subscribe(self, topic: str, type_name: str, handler: Handler, is_latched: bool = False) -> None:
        """Has every message of a topic handed to a function: best effort, as cameras send, or all that is latched.

        Raises:
            UserError: The package of the type is not installed.
        """
        qos = self._qos.qos_profile_sensor_data
        if is_latched:
            policies = self._qos
            qos = policies.QoSProfile(
                depth=100,
                durability=policies.DurabilityPolicy.TRANSIENT_LOCAL,
                reliability=policies.ReliabilityPolicy.RELIABLE,
            )
        try:
            made = self._class_of(type_name)
        except UnknownTypeError as error:
            raise UserError(f"{topic} cannot be heard: {error}") from None

        def take(data: bytes) -> None:
            handler(ros2_types().deserialize_cdr(data, type_name))

        self._node.create_subscription(made, topic, take, qos, raw=True)

    def publish(self, out: Outgoing) -> None:
        """Says something."""
        if out.topic not in self._publishers:
            made = self._class_of(out.type_name)
            self._publishers[out.topic] = self._node.create_publisher(made, out.topic, DEPTH)
        data = bytes(ros2_types().serialize_cdr(out.message, out.type_name))
        self._publishers[out.topic].publish(data)

    def is_open(self) -> bool:
        """Whether ROS 2 has not been shut down."""
        return bool(self._rclpy.ok())

    def close(self) -> None:
        """Leaves."""
        if self._rclpy.ok():
            self._rclpy.shutdown()
        self._spinning.join(2.0)
        self._node.destroy_node()
