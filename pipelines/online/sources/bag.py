"""Depth images out of recordings of ROS 1 and ROS 2: .bag, .mcap and .db3 files, and folders of ROS 2."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from forests.frames import Intrinsics
from pipelines.errors import UserError
from pipelines.online.messages import CameraFrame, Notice
from pipelines.online.ros.definitions import load_rosbags
from pipelines.online.sources.decoding import DecodeError, camera_of, depth_of, stamp_of
from pipelines.online.sources.transforms import Transforms

SUFFIXES = (".bag", ".mcap", ".db3")
IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
TRANSFORM = "tf2_msgs/msg/TFMessage"


def is_bag(path: Path) -> bool:
    """Whether a path looks like a recording of ROS."""
    return path.suffix.lower() in SUFFIXES or (path / "metadata.yaml").is_file()


@dataclass(frozen=True)
class BagSource:
    """A recording.

    Attributes:
        path: The file or folder.
        topic: Of the depth images; None = the only one, or the only one with depth in its name.
        camera: Intrinsics, instead of those of the CameraInfo.
        uses_tf: Whether the camera's pose is taken from the recorded transforms, whose root is then the world: its
            plane z = 0 must be the floor.
    """

    path: Path
    topic: str | None = None
    camera: Intrinsics | None = None
    uses_tf: bool = True
    is_live: ClassVar[bool] = False

    def frames(self) -> Iterator[CameraFrame | Notice]:
        """The images in the order of the recording; in their place, why one cannot be used.

        Raises:
            UserError: There is no such recording or no depth image in it, it is damaged, or rosbags is not installed.
        """
        is_read = False
        with self.opened() as bag:
            try:
                for item in bag.items():
                    is_read = True
                    yield item
            except reading_errors() as error:
                if not is_read:
                    raise
                yield Notice("damaged recordings", f"{self.path} is damaged and ends early: {error}")

    @contextmanager
    def opened(self) -> "Iterator[OpenBag]":
        """The recording, to be read at any place; errors as of `frames`."""
        load_rosbags()
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        if not self.path.exists():
            raise UserError(f"there is no file or folder {self.path}")
        try:
            with AnyReader([self.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
                yield OpenBag(self, reader)
        except reading_errors() as error:
            raise UserError(f"{self.path} is no sound recording of ROS: {error}") from None


def reading_errors() -> tuple[type[Exception], ...]:
    """What rosbags raises of recordings that are damaged or none."""
    from rosbags.highlevel import AnyReaderError
    from rosbags.rosbag1 import ReaderError as Reader1Error
    from rosbags.rosbag2 import ReaderError as Reader2Error

    return AnyReaderError, Reader1Error, Reader2Error, AssertionError, KeyError, OSError, ValueError


class OpenBag:
    """A recording that is open: its depth images, their camera and the transforms.

    Attributes:
        source: What is read of it.
        topic: Of the images.
    """

    def __init__(self, source: BagSource, reader: Any) -> None:
        """Reads the transforms, and looks for the images and their camera.

        Raises:
            UserError: There is no topic of images, or there are several.
        """
        self.source, self._reader = source, reader
        self.topic = topic = self._chosen(source.topic)
        infos = [c for c in reader.connections if c.msgtype == CAMERA_INFO]
        own = [c for c in infos if c.topic.rpartition("/")[0] == topic.rpartition("/")[0]]
        own = own or [c for c in infos if c.topic.rpartition("/")[0] in topic]
        self._infos = own or (infos if len(infos) == 1 else [])
        self._transforms = self._read_transforms() if source.uses_tf else Transforms()
        self._camera = source.camera or self._first_camera(reader, self._infos)
        self._images = [c for c in reader.connections if c.topic == topic and c.msgtype in IMAGES]

    def items(self, start: int | None = None, stop: int | None = None) -> Iterator[CameraFrame | Notice]:
        """The images that were recorded from `start` on and before `stop` [ns], None = all.

        In place of an image that cannot be used stands why.
        """
        camera = self._camera
        messages = self._reader.messages(connections=[*self._images, *self._infos], start=start, stop=stop)
        for connection, time, data in messages:
            message = self._reader.deserialize(data, connection.msgtype)
            try:
                if connection.msgtype == CAMERA_INFO:
                    camera = self.source.camera or camera_of(message)
                    continue
                if camera is None:
                    sentence = (
                        f"an image of {self.topic} is left out: there is no CameraInfo; --intrinsics can tell"
                    )
                    raise DecodeError("images without a camera", sentence)
                depth, stamp = depth_of(message), stamp_of(message, time)
                frame_id = message.header.frame_id or "camera"
                pose, root = self._transforms.pose(frame_id, stamp), self._transforms.root(frame_id)
                yield CameraFrame(stamp, frame_id, depth, camera, pose, root)
            except DecodeError as error:
                yield Notice(error.kind, str(error))

    def times(self) -> list[int]:
        """When the images were recorded [ns]."""
        return [time for _, time, _ in self._reader.messages(connections=self._images)] if self._images else []

    def told(self, types: Collection[str]) -> Iterator[tuple[str, Any]]:
        """All messages of some types, with their type."""
        connections = [c for c in self._reader.connections if c.msgtype in types]
        for connection, _, data in self._reader.messages(connections=connections) if connections else ():
            yield connection.msgtype, self._reader.deserialize(data, connection.msgtype)

    @staticmethod
    def _first_camera(reader: Any, connections: list[Any]) -> Intrinsics | None:
        """That of the first CameraInfo, for images that come before it."""
        if not connections:
            return None
        connection, _, data = next(iter(reader.messages(connections=connections)), (None, 0, b""))
        if connection is None:
            return None
        try:
            return camera_of(reader.deserialize(data, connection.msgtype))
        except DecodeError:
            return None

    def _chosen(self, wanted: str | None) -> str:
        """The topic of the depth images."""
        path = self.source.path
        topics = sorted({c.topic for c in self._reader.connections if c.msgtype in IMAGES})
        if wanted is not None:
            if wanted not in topics:
                known = ", ".join(topics) or "none"
                raise UserError(f"{path} has no images on the topic {wanted}; topics of images are: {known}")
            return wanted
        for candidates in (topics, [topic for topic in topics if "depth" in topic.lower()]):
            if len(candidates) == 1:
                return candidates[0]
        if not topics:
            raise UserError(f"{path} has no topic of images")
        raise UserError(f"{path} has several topics of images; choose one with --topic: {', '.join(topics)}")

    def _read_transforms(self) -> Transforms:
        out = Transforms()
        connections = [c for c in self._reader.connections if c.msgtype == TRANSFORM]
        if connections:
            for connection, _, data in self._reader.messages(connections=connections):
                message = self._reader.deserialize(data, connection.msgtype)
                out.add(message.transforms, connection.topic.endswith("static"))
        return out
