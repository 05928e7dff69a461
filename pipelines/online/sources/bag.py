"""Depth images out of recordings of ROS 1 and ROS 2: .bag, .mcap and .db3 files, and folders of ROS 2."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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

    def frames(self) -> Iterator[CameraFrame | Notice]:
        """The images in the order of the recording; in their place, why one cannot be used.

        Raises:
            UserError: There is no such recording or no depth image in it, it is damaged, or rosbags is not installed.
        """
        load_rosbags()
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.rosbag1 import ReaderError as Reader1Error
        from rosbags.rosbag2 import ReaderError as Reader2Error
        from rosbags.typesys import Stores, get_typestore

        if not self.path.exists():
            raise UserError(f"there is no file or folder {self.path}")
        is_read = False
        try:
            with AnyReader([self.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
                for item in self._read(reader):
                    is_read = True
                    yield item
        except (
            AnyReaderError,
            Reader1Error,
            Reader2Error,
            AssertionError,
            KeyError,
            OSError,
            ValueError,
        ) as error:
            if not is_read:
                raise UserError(f"{self.path} is no sound recording of ROS: {error}") from None
            yield Notice("damaged recordings", f"{self.path} is damaged and ends early: {error}")

    def _read(self, reader: Any) -> Iterator[CameraFrame | Notice]:
        topic = self._chosen(reader)
        infos = [c for c in reader.connections if c.msgtype == CAMERA_INFO]
        own = [c for c in infos if c.topic.rpartition("/")[0] == topic.rpartition("/")[0]]
        own = (
            own or [c for c in infos if c.topic.rpartition("/")[0] in topic] or (infos if len(infos) == 1 else [])
        )
        transforms = self._transforms(reader) if self.uses_tf else Transforms()
        camera = self.camera or self._first_camera(reader, own)
        chosen = [c for c in reader.connections if c.topic == topic and c.msgtype in IMAGES]
        for connection, time, data in reader.messages(connections=[*chosen, *own]):
            message = reader.deserialize(data, connection.msgtype)
            try:
                if connection.msgtype == CAMERA_INFO:
                    camera = self.camera or camera_of(message)
                    continue
                if camera is None:
                    sentence = f"an image of {topic} is left out: there is no CameraInfo; --intrinsics can tell"
                    raise DecodeError("images without a camera", sentence)
                depth, stamp = depth_of(message), stamp_of(message, time)
                frame_id = message.header.frame_id or "camera"
                yield CameraFrame(stamp, frame_id, depth, camera, transforms.pose(frame_id, stamp))
            except DecodeError as error:
                yield Notice(error.kind, str(error))

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

    def _chosen(self, reader: Any) -> str:
        """The topic of the depth images."""
        topics = sorted({c.topic for c in reader.connections if c.msgtype in IMAGES})
        if self.topic is not None:
            if self.topic not in topics:
                known = ", ".join(topics) or "none"
                raise UserError(
                    f"{self.path} has no images on the topic {self.topic}; topics of images are: {known}"
                )
            return self.topic
        for candidates in (topics, [topic for topic in topics if "depth" in topic.lower()]):
            if len(candidates) == 1:
                return candidates[0]
        if not topics:
            raise UserError(f"{self.path} has no topic of images")
        raise UserError(f"{self.path} has several topics of images; choose one with --topic: {', '.join(topics)}")

    @staticmethod
    def _transforms(reader: Any) -> Transforms:
        out = Transforms()
        connections = [c for c in reader.connections if c.msgtype == TRANSFORM]
        if connections:
            for connection, _, data in reader.messages(connections=connections):
                message = reader.deserialize(data, connection.msgtype)
                out.add(message.transforms, connection.topic.endswith("static"))
        return out
