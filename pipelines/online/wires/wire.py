"""What a middleware must do for the on-line system: tell its topics, hear them, and say something on others."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from pipelines.online.ros.making import Maker, Outgoing

Handler = Callable[[Any], object]
"""Takes a message as rosbags has it."""


class Wire(Protocol):
    """A node that is connected.

    Attributes:
        maker: Makes messages of the types of this middleware.
    """

    maker: Maker

    def topics(self) -> Mapping[str, str]:
        """Types of the topics that somebody publishes, such as sensor_msgs/msg/Image, by name."""
        ...

    def subscribe(self, topic: str, type_name: str, handler: Handler, is_latched: bool = False) -> None:
        """Has every message of a topic handed to a function, on a thread of the middleware's.

        Args:
            topic: Its name.
            type_name: Its type.
            handler: Takes the messages. What it raises is the middleware's business.
            is_latched: Whether messages that came earlier are wanted too, as of /tf_static.
        """
        ...

    def publish(self, out: Outgoing) -> None:
        """Says something; a topic is announced when it is first used.

        Raises:
            UnknownTypeError: This middleware has no such type.
        """
        ...

    def is_open(self) -> bool:
        """Whether the middleware has not been shut down."""
        ...

    def close(self) -> None:
        """Leaves."""
        ...


class UnknownTypeError(ValueError):
    """A type of messages whose package is not installed."""
