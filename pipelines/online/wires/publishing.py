"""What the system tells, said on live topics."""

from pipelines.online.bus import Bus
from pipelines.online.messages import CameraFrame, CameraPose, Notice
from pipelines.online.ros.outgoing import Translator
from pipelines.online.wires.wire import UnknownTypeError, Wire

ECHOES = ("/depth/image_rect_raw", "/depth/camera_info")
"""Endings of the topics of images, which others publish already."""


class Publisher:
    """Publishes what a bus is told: `bus.subscribe(object, publisher.take)`."""

    def __init__(self, wire: Wire, bus: Bus, camera_name: str = "rgbd_front_top") -> None:
        self._wire, self._bus = wire, bus
        self._translator = Translator(camera_name, wire.maker)
        self._knows_pose = False

    def take(self, message: object) -> None:
        """Publishes a message; a type that is not installed is told in a `Notice`."""
        if isinstance(message, CameraFrame):
            self._knows_pose = message.T_world_camera is not None
        if isinstance(message, CameraPose) and self._knows_pose:
            return  # Transforms have told where the camera is.
        for out in self._translator.translate(message):
            if out.topic.endswith(ECHOES):
                continue
            try:
                self._wire.publish(out)
            except UnknownTypeError as error:
                self._bus.publish(Notice(f"messages of type {out.type_name}", f"{out.topic} is left out: {error}"))
