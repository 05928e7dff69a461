"""Detections and tracks as messages of ROS."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from pipelines.online.messages import NS, Detections, TrackedPerson, TrackedPersons
from pipelines.online.ros.making import Maker, Outgoing, body_id
from pipelines.online.ros.markers import person_markers

INTERNAL = "/spencer/perception_internal"
UNKNOWN_VARIANCE = 1e6
"""Stands in covariances for what is not known, such as the height of a track [m^2]."""


def detections_message(maker: Maker, told: Detections, camera_name: str) -> Outgoing:
    """Boxes around heads and shoulders."""
    boxes = np.ascontiguousarray(np.array([one.upper_body for one in told.people], np.float64).reshape(-1, 4).T)
    distance = np.array([one.distance for one in told.people], np.float64)
    name = "rwth_perception_people_msgs/msg/UpperBodyDetector"
    message = maker.make(
        name,
        header=maker.header(told.stamp, told.frame_id),
        pos_x=boxes[0],
        pos_y=boxes[1],
        width=boxes[2] - boxes[0],
        height=boxes[3] - boxes[1],
        dist=distance,
        median_depth=np.array([one.axis[2] for one in told.people], np.float64),
    )
    topic = f"{INTERNAL}/people_detection/{camera_name}/upper_body_detector/detections"
    return Outgoing(topic, name, told.stamp, message)


def persons_messages(maker: Maker, told: TrackedPersons, camera_name: str) -> Iterator[Outgoing]:
    """Tracks, their boxes, and the topics of each body."""
    header, stamp = maker.header(told.stamp, told.frame_id), told.stamp
    stem = f"{INTERNAL}/people_tracking/{camera_name}"
    name = "spencer_tracking_msgs/msg/TrackedPersons"
    tracks = [_track(maker, one) for one in told.persons]
    yield Outgoing(f"{stem}/tracked_persons", name, stamp, maker.make(name, header=header, tracks=tracks))
    name = "spencer_tracking_msgs/msg/TrackedPersons2d"
    boxes = [_box(maker, one) for one in told.persons if one.detection is not None]
    yield Outgoing(f"{stem}/tracked_persons_2d", name, stamp, maker.make(name, header=header, boxes=boxes))
    ids = maker.make("hri_msgs/msg/IdsList", header=header, ids=[body_id(one.track_id) for one in told.persons])
    yield Outgoing("/humans/bodies/tracked", "hri_msgs/msg/IdsList", stamp, ids)
    for one in told.persons:
        yield from _body(maker, one, header, stamp)
    markers = person_markers(maker, header, told)
    yield Outgoing("/undergrowth/people", "visualization_msgs/msg/MarkerArray", stamp, markers)


def _track(maker: Maker, one: TrackedPerson) -> Any:
    position, velocity = np.eye(6) * UNKNOWN_VARIANCE, np.eye(6) * UNKNOWN_VARIANCE
    position[:2, :2], velocity[:2, :2] = one.covariance[:2, :2], one.covariance[2:, 2:]
    yaw = math.atan2(one.velocity[1], one.velocity[0])
    turn = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    pose = maker.make(
        "geometry_msgs/msg/Pose", position=maker.point((*one.place, 0.0)), orientation=maker.quaternion(turn)
    )
    twist = maker.make(
        "geometry_msgs/msg/Twist",
        linear=maker.vector((*one.velocity, 0.0)),
        angular=maker.vector((0.0, 0.0, 0.0)),
    )
    age = round(one.age_s * NS)
    return maker.make(
        "spencer_tracking_msgs/msg/TrackedPerson",
        track_id=one.track_id,
        is_occluded=one.detection is None,
        is_matched=one.detection is not None,
        detection_id=one.track_id,
        age=maker.make("builtin_interfaces/msg/Duration", sec=age // NS, nanosec=age % NS),
        pose=maker.make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=position.ravel()),
        twist=maker.make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=velocity.ravel()),
    )


def _box(maker: Maker, one: TrackedPerson) -> Any:
    assert one.detection is not None
    left, top, right, bottom = (round(edge) for edge in one.detection.box)
    return maker.make(
        "spencer_tracking_msgs/msg/TrackedPerson2d",
        track_id=one.track_id,
        person_height=float(np.nan_to_num(one.height)),
        x=left,
        y=top,
        w=max(0, right - left),
        h=max(0, bottom - top),
        depth=float(one.detection.axis[2]),
    )


def _body(maker: Maker, one: TrackedPerson, header: Any, stamp: int) -> Iterator[Outgoing]:
    stem = f"/humans/bodies/{body_id(one.track_id)}"
    place = maker.make("geometry_msgs/msg/PointStamped", header=header, point=maker.point((*one.place, 0.0)))
    yield Outgoing(f"{stem}/position", "geometry_msgs/msg/PointStamped", stamp, place)
    twist = maker.make(
        "geometry_msgs/msg/Twist", linear=maker.vector((*one.velocity, 0.0)), angular=maker.vector((0.0, 0.0, 0.0))
    )
    moving = maker.make("geometry_msgs/msg/TwistStamped", header=header, twist=twist)
    yield Outgoing(f"{stem}/velocity", "geometry_msgs/msg/TwistStamped", stamp, moving)
