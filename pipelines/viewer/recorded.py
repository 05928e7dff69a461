"""Recordings of ROS: their depth images and, if `undergrowth live` has written them, everything that it told."""

from collections import defaultdict
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from forests.frames import Intrinsics
from pipelines.errors import UserError
from pipelines.online.messages import CameraFrame, CameraPose
from pipelines.online.sources.bag import BagSource
from pipelines.online.sources.runs import MAKERS, message_of
from pipelines.viewer.moments import LEVEL, Gathering, Moment

BEFORE = 15
"""So many images before one are looked through for skeletons that are still believed."""


class RecordedShow:
    """The depth images of a recording; images are read when they are shown, all else at once.

    Attributes:
        fps: Images a second.
    """

    def __init__(self, path: Path, topic: str | None = None, camera: Intrinsics | None = None) -> None:
        """Reads all but the images.

        Raises:
            UserError: No sound recording, no depth image in it, or rosbags is not installed.
        """
        self.path = path
        self._open = ExitStack()
        self._bag = self._open.enter_context(BagSource(path, topic, camera).opened())
        self._told: dict[int, list[object]] = defaultdict(list)
        for kind, message in self._bag.told(tuple(MAKERS)):
            made = message_of(kind, message)
            if made is not None:
                self._told[made.stamp].append(made)
        self._times = self._bag.times()
        if not self._times:
            raise UserError(f"{path} has no depth image")
        gap = float(np.median(np.diff(self._times))) if len(self._times) > 1 else 0.0
        self.fps = float(np.clip(1e9 / gap, 0.1, 100.0)) if gap > 0 else 30.0

    def close(self) -> None:
        """Closes the recording."""
        self._open.close()

    def __len__(self) -> int:
        """How many images there are."""
        return len(self._times)

    def moment(self, number: int) -> Moment:
        """An image, and what was told of it by then."""
        time = self._times[number]
        found = next(self._bag.items(time, time + 1), None)
        if not isinstance(found, CameraFrame):
            why = "it is not there" if found is None else found.sentence
            raise UserError(f"image {number} of {self.path} cannot be shown: {why}")
        gathering = Gathering()
        for earlier in self._times[max(0, number - BEFORE) : number]:
            for message in self._told.get(earlier, ()):
                gathering.take(message)
        gathering.take(found)
        told = self._told.get(found.stamp, [])
        if not any(isinstance(message, CameraPose) for message in told):
            T = LEVEL if found.T_world_camera is None else found.T_world_camera
            gathering.take(CameraPose(found.stamp, "", found.frame_id, T))
        for message in told:
            gathering.take(message)
        moment = gathering.moment()
        assert moment is not None
        return moment
