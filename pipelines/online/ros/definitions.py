"""The types of ROS messages that are written: those of ROS 2, of people (REP-155, SPENCER), and two of our own."""

from functools import lru_cache
from typing import TYPE_CHECKING, Any

from pipelines.errors import UserError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

HRI = {
    "hri_msgs/msg/IdsList": """
std_msgs/Header header
string[] ids
""",
    "hri_msgs/msg/NormalizedPointOfInterest2D": """
float32 x
float32 y
float32 c
""",
    "hri_msgs/msg/NormalizedRegionOfInterest2D": """
std_msgs/Header header
float32 xmin
float32 ymin
float32 xmax
float32 ymax
float32 c
""",
    "hri_msgs/msg/Skeleton2D": """
std_msgs/Header header
uint8 NOSE=0
uint8 NECK=1
uint8 RIGHT_SHOULDER=2
uint8 RIGHT_ELBOW=3
uint8 RIGHT_WRIST=4
uint8 LEFT_SHOULDER=5
uint8 LEFT_ELBOW=6
uint8 LEFT_WRIST=7
uint8 RIGHT_HIP=8
uint8 RIGHT_KNEE=9
uint8 RIGHT_ANKLE=10
uint8 LEFT_HIP=11
uint8 LEFT_KNEE=12
uint8 LEFT_ANKLE=13
uint8 LEFT_EYE=14
uint8 RIGHT_EYE=15
uint8 LEFT_EAR=16
uint8 RIGHT_EAR=17
hri_msgs/NormalizedPointOfInterest2D[18] skeleton
""",
}
"""Fields of REP-155, without comments."""
SPENCER = {
    "spencer_tracking_msgs/msg/TrackedPerson": """
uint64 track_id
bool is_occluded
bool is_matched
uint64 detection_id
builtin_interfaces/Duration age
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist
""",
    "spencer_tracking_msgs/msg/TrackedPersons": """
std_msgs/Header header
spencer_tracking_msgs/TrackedPerson[] tracks
""",
    "spencer_tracking_msgs/msg/TrackedPerson2d": """
uint64 track_id
float32 person_height
int32 x
int32 y
uint32 w
uint32 h
float32 depth
""",
    "spencer_tracking_msgs/msg/TrackedPersons2d": """
std_msgs/Header header
spencer_tracking_msgs/TrackedPerson2d[] boxes
""",
    "rwth_perception_people_msgs/msg/UpperBodyDetector": """
std_msgs/Header header
float64[] pos_x
float64[] pos_y
float64[] width
float64[] height
float64[] dist
float64[] median_depth
""",
}
"""Fields of the SPENCER project's messages, whose ROS 1 types they follow."""
OWN = {
    "undergrowth_msgs/msg/Skeleton": """
std_msgs/Header header
uint64 track_id
string module
string[] names
geometry_msgs/Point[] positions
float32[] confidence
float32[] deviation
float32[] hidden
""",
    "undergrowth_msgs/msg/Orientation": """
std_msgs/Header header
uint64 track_id
string module
string region
float64 angle
float64 concentration
float64 probability
string posture
float64 posture_probability
""",
    "undergrowth_msgs/msg/Plan": """
std_msgs/Header header
uint64[] asked_tracks
string[] asked_modules
uint64[] skipped_tracks
string[] skipped_modules
string[] reasons
float64 spent
float64 budget
""",
}
"""Skeletons and orientations with stamp, track and confidence, and plans, for which no common message has fields."""


def load_rosbags() -> Any:
    """The module rosbags.

    Raises:
        UserError: It is not installed; says how to get it.
    """
    try:
        import rosbags
    except ImportError:
        raise UserError(
            "bags need rosbags, which is not installed; install it with: pip install 'undergrowth[online]'"
        ) from None
    return rosbags


@lru_cache(maxsize=1)
def ros2_types() -> "Typestore":
    """All types that are written, those of ROS 2 Humble among them.

    Raises:
        UserError: rosbags is not installed.
    """
    load_rosbags()
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in (HRI | SPENCER | OWN).items():
        store.register(get_types_from_msg(text, name))
    return store
