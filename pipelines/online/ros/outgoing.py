"""What the system tells, as messages of ROS on their topics."""

from collections import OrderedDict
from collections.abc import Iterator

from pipelines.online.messages import (
    CameraFrame,
    CameraPose,
    Detections,
    OrientationResult,
    Plan,
    SkeletonResult,
    TrackedPersons,
    TrackSkeleton,
)
from pipelines.online.ros.camera import frame_messages, pose_message
from pipelines.online.ros.making import Maker, Outgoing
from pipelines.online.ros.people import detections_message, persons_messages
from pipelines.online.ros.results import (
    orientation_message,
    plan_message,
    roi_message,
    skeleton_2d_message,
    skeleton_messages,
)

N_FRAMES = 100
"""Images that are kept for skeletons that are still to come."""


class Translator:
    """Makes messages of ROS out of those of the system.

    Attributes:
        camera_name: In the topics.
    """

    def __init__(self, camera_name: str = "rgbd_front_top", maker: Maker | None = None) -> None:
        """Takes the camera's name, and what makes the messages; None = messages of ROS 2.

        Raises:
            UserError: rosbags is not installed.
        """
        self.camera_name = camera_name
        self._maker = maker or Maker()
        self._frames: OrderedDict[int, CameraFrame] = OrderedDict()

    def translate(self, message: object) -> Iterator[Outgoing]:
        """The messages of ROS that tell what a message of the system does; none of those that have no topic."""
        maker, name = self._maker, self.camera_name
        if isinstance(message, CameraFrame):
            self._frames[message.stamp] = message
            if len(self._frames) > N_FRAMES:
                self._frames.popitem(last=False)
            yield from frame_messages(maker, message, name)
        elif isinstance(message, CameraPose):
            yield pose_message(maker, message)
        elif isinstance(message, Detections):
            yield detections_message(maker, message, name)
        elif isinstance(message, TrackedPersons):
            yield from persons_messages(maker, message, name)
            frame = self._frames.get(message.stamp)
            for one in message.persons:
                if frame is not None and one.detection is not None:
                    yield roi_message(maker, one, frame)
        elif isinstance(message, SkeletonResult) and message.stamp in self._frames:
            yield skeleton_2d_message(maker, message, self._frames[message.stamp])
        elif isinstance(message, TrackSkeleton):
            yield from skeleton_messages(maker, message, name)
        elif isinstance(message, OrientationResult):
            yield orientation_message(maker, message, name)
        elif isinstance(message, Plan):
            yield plan_message(maker, message)
