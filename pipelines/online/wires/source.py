"""Depth images from live topics: the newest image, with its camera and the camera's pose."""

import threading
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

from forests.frames import Intrinsics
from pipelines.errors import UserError
from pipelines.online.messages import CameraFrame, Notice
from pipelines.online.sources.decoding import DecodeError, camera_of, depth_of, stamp_of
from pipelines.online.sources.transforms import Transforms
from pipelines.online.wires.wire import Wire

IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
INFO, TRANSFORM = "sensor_msgs/msg/CameraInfo", "tf2_msgs/msg/TFMessage"
POLL_S = 0.2
"""How often it is looked at whether the middleware still runs [s]."""
KEPT_NS = 10_000_000_000
"""Transforms are kept for so long [ns]."""


class TopicSource:
    """The images of a topic, as they come. Of those that came while another was worked on, the newest is taken.

    Attributes:
        topic: Of the images.
        n_dropped: Images that a newer one has overtaken.
    """

    is_live = True

    def __init__(
        self,
        wire: Wire,
        topic: str,
        camera: Intrinsics | None = None,
        uses_tf: bool = True,
        patience_s: float = 10.0,
    ) -> None:
        """Subscribes.

        Args:
            wire: Where the topics are.
            topic: Of the images.
            camera: Intrinsics, instead of those of a CameraInfo beside the images.
            uses_tf: Whether the camera's pose is taken from the transforms.
            patience_s: The topic may appear so much later [s].

        Raises:
            UserError: Nobody publishes images on the topic.
        """
        self.topic, self.n_dropped = topic, 0
        self._wire, self._given, self._camera, self._uses_tf = wire, camera, camera, uses_tf
        self._newest: Any = None
        self._notices: list[Notice] = []
        self._transforms = Transforms()
        self._changed = threading.Condition()
        kind = self._kind(patience_s)
        # What images need is subscribed to before they are.
        if uses_tf:
            wire.subscribe("/tf", TRANSFORM, partial(self._move, is_static=False))
            wire.subscribe("/tf_static", TRANSFORM, partial(self._move, is_static=True), is_latched=True)
        if camera is None:
            wire.subscribe(f"{topic.rpartition('/')[0]}/camera_info", INFO, self._take_camera)
        wire.subscribe(topic, kind, self._take)

    def _kind(self, patience_s: float) -> str:
        """The type of the topic."""
        end = time.monotonic() + patience_s
        while True:
            topics = self._wire.topics()
            kind = topics.get(self.topic)
            if kind in IMAGES:
                return kind
            if kind is not None or time.monotonic() >= end:
                images = ", ".join(sorted(name for name, of in topics.items() if of in IMAGES)) or "none"
                what = "nobody publishes it" if kind is None else f"it is of type {kind}"
                raise UserError(
                    f"there are no images on the topic {self.topic}: {what}; topics of images: {images}"
                )
            time.sleep(min(POLL_S, patience_s))

    def _take(self, message: Any) -> None:
        with self._changed:
            self.n_dropped += self._newest is not None
            self._newest = message
            self._changed.notify()

    def _take_camera(self, message: Any) -> None:
        with self._changed:
            try:
                self._camera = camera_of(message)
            except DecodeError as error:
                self._notices.append(Notice(error.kind, str(error)))

    def _move(self, message: Any, is_static: bool) -> None:
        with self._changed:
            self._transforms.add(message.transforms, is_static)

    def frames(self) -> Iterator[CameraFrame | Notice]:
        """The images until the middleware is shut down; in their place, why one cannot be used."""
        while self._wire.is_open():
            with self._changed:
                self._changed.wait_for(lambda: self._newest is not None, POLL_S)
                message, self._newest = self._newest, None
                notices, self._notices = self._notices, []
            yield from notices
            if message is not None:
                yield self._frame(message)

    def _frame(self, message: Any) -> CameraFrame | Notice:
        camera = self._camera
        if camera is None:
            kind = "images without a camera"
            return Notice(kind, f"an image of {self.topic} is left out: no CameraInfo came; --intrinsics can tell")
        try:
            depth, stamp = depth_of(message), stamp_of(message, time.time_ns())
        except DecodeError as error:
            return Notice(error.kind, str(error))
        frame_id = message.header.frame_id or "camera"
        with self._changed:
            self._transforms.forget(stamp - KEPT_NS)
            pose = self._transforms.pose(frame_id, stamp) if self._uses_tf else None
            root = self._transforms.root(frame_id)
        return CameraFrame(stamp, frame_id, depth, camera, pose, root)
