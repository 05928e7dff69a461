"""Records what the system tells as an MCAP file of ROS 2."""

import shutil
from pathlib import Path
from tempfile import mkdtemp
from types import TracebackType
from typing import Any

from pipelines.online.ros.definitions import ros2_types
from pipelines.online.ros.outgoing import Translator


class Recorder:
    """Writes messages; the file appears under its name when it is complete.

    Use it as a context manager, and have the bus hand it everything: `bus.subscribe(object, recorder.take)`.

    Attributes:
        path: The file.
    """

    def __init__(self, path: Path, camera_name: str = "rgbd_front_top") -> None:
        """Opens a file beside the one that is to be; an old one is replaced in the end.

        Raises:
            UserError: rosbags is not installed.
            OSError: The folder cannot be written to.
        """
        self.path = path
        self._translator = Translator(camera_name)
        from rosbags.rosbag2 import StoragePlugin, Writer

        path.parent.mkdir(parents=True, exist_ok=True)
        self._folder = Path(mkdtemp(prefix=f".{path.name}.", dir=path.parent))
        self._writer = Writer(self._folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP)
        self._connections: dict[str, Any] = {}

    def __enter__(self) -> "Recorder":
        self._writer.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._writer.close()
            (found,) = (self._folder / "bag").glob("*.mcap")
            found.replace(self.path)
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)

    def take(self, message: object) -> None:
        """Writes what a message of the system tells."""
        types = ros2_types()
        for out in self._translator.translate(message):
            if out.topic not in self._connections:
                self._connections[out.topic] = self._writer.add_connection(
                    out.topic, out.type_name, typestore=types
                )
            data = types.serialize_cdr(out.message, out.type_name)
            self._writer.write(self._connections[out.topic], out.stamp, data)
