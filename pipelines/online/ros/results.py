"""Skeletons and orientations as messages of ROS."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from pipelines.online.messages import (
    CameraFrame,
    OrientationResult,
    Plan,
    SkeletonResult,
    TrackedPerson,
    TrackSkeleton,
)
from pipelines.online.ros.making import Maker, Outgoing, body_id
from pipelines.online.ros.markers import skeleton_markers
from pipelines.online.ros.people import INTERNAL

COCO = {
    "neck": 1,
    "r_shoulder": 2,
    "r_elbow": 3,
    "r_hand": 4,
    "l_shoulder": 5,
    "l_elbow": 6,
    "l_hand": 7,
    "r_hip": 8,
    "r_knee": 9,
    "r_foot": 10,
    "l_hip": 11,
    "l_knee": 12,
    "l_foot": 13,
}
"""Place of a joint in Skeleton2D; hands stand for wrists and feet for ankles. Eyes, ears and nose are not known."""
N_COCO = 18
PLAN = "/undergrowth/plan"


def skeleton_2d_message(maker: Maker, told: SkeletonResult, frame: CameraFrame) -> Outgoing:
    """Joints in the image, in shares of its width and height; those not known have the confidence 0."""
    height, width = frame.depth.shape
    points = [(0.0, 0.0, 0.0)] * N_COCO
    for name, xyz, confidence in zip(told.joints, told.positions, told.confidence, strict=True):
        if name in COCO and np.isfinite(xyz).all() and xyz[2] > 0:
            u = frame.camera.fx * xyz[0] / xyz[2] + frame.camera.cx
            v = frame.camera.fy * xyz[1] / xyz[2] + frame.camera.cy
            if 0 <= u <= width - 1 and 0 <= v <= height - 1:
                points[COCO[name]] = float(u / width), float(v / height), float(np.nan_to_num(confidence))
    message = maker.make(
        "hri_msgs/msg/Skeleton2D",
        header=maker.header(told.stamp, told.frame_id),
        skeleton=[maker.make("hri_msgs/msg/NormalizedPointOfInterest2D", x=x, y=y, c=c) for x, y, c in points],
    )
    topic = f"/humans/bodies/{body_id(told.track_id)}/skeleton2d"
    return Outgoing(topic, "hri_msgs/msg/Skeleton2D", told.stamp, message)


def roi_message(maker: Maker, one: TrackedPerson, frame: CameraFrame) -> Outgoing:
    """The box of somebody who was detected, in shares of the image's width and height."""
    assert one.detection is not None
    height, width = frame.depth.shape
    left, top, right, bottom = one.detection.box
    message = maker.make(
        "hri_msgs/msg/NormalizedRegionOfInterest2D",
        header=maker.header(frame.stamp, frame.frame_id),
        xmin=left / width,
        ymin=top / height,
        xmax=right / width,
        ymax=bottom / height,
        c=one.detection.confidence,
    )
    topic = f"/humans/bodies/{body_id(one.track_id)}/roi"
    return Outgoing(topic, "hri_msgs/msg/NormalizedRegionOfInterest2D", frame.stamp, message)


def skeleton_messages(maker: Maker, told: TrackSkeleton, camera_name: str) -> Iterator[Outgoing]:
    """Joints in the frame of reference of the floor, with stamp, track and confidence, and drawn."""
    header = maker.header(told.stamp, told.frame_id)
    name = "undergrowth_msgs/msg/Skeleton"
    message: Any = maker.make(
        name,
        header=header,
        track_id=told.track_id,
        module=told.module,
        names=list(told.joints),
        positions=[maker.point(xyz) for xyz in told.positions],
        confidence=told.confidence.astype(np.float32),
        deviation=told.deviation.astype(np.float32),
        hidden=told.hidden.astype(np.float32),
    )
    stem = f"{INTERNAL}/detailed_upper_body_analysis/{camera_name}"
    yield Outgoing(f"{stem}/upper_body_skeleton", name, told.stamp, message)
    yield Outgoing(f"/humans/bodies/{body_id(told.track_id)}/joint_positions", name, told.stamp, message)
    markers = skeleton_markers(maker, header, told)
    yield Outgoing("/undergrowth/skeletons", "visualization_msgs/msg/MarkerArray", told.stamp, markers)


def orientation_message(maker: Maker, told: OrientationResult, camera_name: str) -> Outgoing:
    """Which way somebody faces, with stamp, track and probability."""
    name = "undergrowth_msgs/msg/Orientation"
    message = maker.make(
        name,
        header=maker.header(told.stamp, told.frame_id),
        track_id=told.track_id,
        module=told.module,
        region=told.region,
        angle=told.angle,
        concentration=told.concentration,
        probability=told.probability,
        posture=told.posture,
        posture_probability=told.posture_probability,
    )
    topic = f"{INTERNAL}/detailed_body_analysis/{camera_name}/{told.region}_orientation"
    return Outgoing(topic, name, told.stamp, message)


def plan_message(maker: Maker, told: Plan) -> Outgoing:
    """Whom the planner chose, whom not, and why."""
    name = "undergrowth_msgs/msg/Plan"
    message = maker.make(
        name,
        header=maker.header(told.stamp, ""),
        asked_tracks=np.array([one.track_id for one in told.requests], np.uint64),
        asked_modules=[one.module for one in told.requests],
        skipped_tracks=np.array([one.track_id for one in told.skips], np.uint64),
        skipped_modules=[one.module for one in told.skips],
        reasons=[one.reason for one in told.skips],
        spent=told.spent_s,
        budget=told.budget_s,
    )
    return Outgoing(PLAN, name, told.stamp, message)
