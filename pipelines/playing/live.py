"""Sources that run of themselves: topics of ROS 1 and ROS 2, and USB cameras."""

from contextlib import ExitStack
from pathlib import Path

from forests.frames import Intrinsics
from pipelines.errors import UserError
from pipelines.online.wires.source import TopicSource
from pipelines.online.wires.wire import Wire
from pipelines.playing.sources import PlayOptions, Source
from pipelines.playing.usb import open_camera

SCHEMES = ("ros1", "ros2", "usb")


def is_live_source(path: Path) -> bool:
    """Whether the name of a source is of one that runs, such as ros1:/camera/depth/image_raw."""
    scheme, colon, _ = str(path).partition(":")
    return colon == ":" and scheme in SCHEMES


def open_live_source(path: Path, options: PlayOptions, stack: ExitStack) -> tuple[Source, Wire | None]:
    """A source that runs, and where results can be published.

    Args:
        path: ros1:/TOPIC, ros2:/TOPIC, usb:, usb:realsense or usb:openni.
        options: How it is played.
        stack: Closes it.

    Raises:
        UserError: What it needs is not installed or not there.
    """
    if options.sensor is not None:
        raise UserError(f"--sensor is for generated corpora, and {path} is none")
    scheme, _, rest = str(path).partition(":")
    given = None if options.camera is None else options.camera.values
    camera = None if given is None else Intrinsics(given.fx, given.fy, given.cx, given.cy)
    if scheme == "usb":
        usb = open_camera(rest.strip("/"), camera)
        stack.callback(usb.close)
        return usb, None
    topic = options.topic or f"/{rest.strip('/')}"
    if topic == "/":
        raise UserError(f"give the topic of the depth images, such as {scheme}:/camera/depth/image_raw")
    wire = _connected(scheme)
    stack.callback(wire.close)
    return TopicSource(wire, topic, camera, options.knows_pose), wire


def _connected(scheme: str) -> Wire:
    if scheme == "ros1":
        from pipelines.online.wires.ros1 import Ros1Wire

        return Ros1Wire()
    from pipelines.online.wires.ros2 import Ros2Wire

    return Ros2Wire()
