"""Parts of messages of ROS that many have."""

from typing import Any, NamedTuple

from pipelines.online.messages import NS
from pipelines.online.ros.definitions import ros2_types


class Outgoing(NamedTuple):
    """A message of ROS.

    Attributes:
        topic: Its name.
        type_name: Such as sensor_msgs/msg/Image.
        stamp: [ns].
        message: As rosbags has it.
    """

    topic: str
    type_name: str
    stamp: int
    message: Any


def body_id(track_id: int) -> str:
    """The identifier of a body (REP-155): letters and digits, a letter first."""
    return f"b{track_id:05d}"


class Maker:
    """Makes messages of ROS."""

    def __init__(self) -> None:
        """Reads the types.

        Raises:
            UserError: rosbags is not installed.
        """
        self._types = ros2_types().types

    def make(self, name: str, /, **values: Any) -> Any:
        """A message of a type, such as std_msgs/msg/Header, with the values of its fields."""
        return self._types[name](**values)

    def header(self, stamp: int, frame_id: str) -> Any:
        """A header of a stamp [ns]."""
        time = self.make("builtin_interfaces/msg/Time", sec=stamp // NS, nanosec=stamp % NS)
        return self.make("std_msgs/msg/Header", stamp=time, frame_id=frame_id)

    def point(self, xyz: Any) -> Any:
        """A point [m]."""
        x, y, z = (float(value) for value in xyz)
        return self.make("geometry_msgs/msg/Point", x=x, y=y, z=z)

    def vector(self, xyz: Any) -> Any:
        """A vector."""
        x, y, z = (float(value) for value in xyz)
        return self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def quaternion(self, xyzw: Any) -> Any:
        """A rotation."""
        x, y, z, w = (float(value) for value in xyzw)
        return self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
