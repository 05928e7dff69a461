"""What a run has recorded, as the messages that it was: the way back of `ros.outgoing`, as far as topics tell all."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pipelines.online.messages import (
    NS,
    CameraPose,
    OrientationResult,
    Plan,
    Request,
    Skip,
    TrackedPerson,
    TrackedPersons,
    TrackSkeleton,
)
from pipelines.online.ros.people import UNKNOWN_VARIANCE
from pipelines.online.sources.transforms import matrix_of

NOWHERE = (0.0, 0.0, 0.0, 0.0)
"""The box of those who are asked about, which plans do not tell."""


Told = CameraPose | TrackedPersons | TrackSkeleton | OrientationResult | Plan


def message_of(type_name: str, message: Any) -> Told | None:
    """The message of the system that a message of ROS tells; None if it tells none.

    Heights and detections of tracks, their covariance of place and velocity, and the boxes of requests are not in it.

    Args:
        type_name: Such as undergrowth_msgs/msg/Skeleton.
        message: As rosbags reads it.
    """
    maker = MAKERS.get(type_name)
    return None if maker is None else maker(message)


def _stamp(message: Any) -> int:
    return int(message.header.stamp.sec) * NS + int(message.header.stamp.nanosec)


def _pose(message: Any) -> CameraPose | None:
    if not len(message.transforms):
        return None
    one = message.transforms[0]
    shift, turn = one.transform.translation, one.transform.rotation
    T = matrix_of(np.array([shift.x, shift.y, shift.z]), np.array([turn.x, turn.y, turn.z, turn.w]))
    return CameraPose(_stamp(one), one.header.frame_id, one.child_frame_id, T)


def _persons(message: Any) -> TrackedPersons:
    return TrackedPersons(_stamp(message), message.header.frame_id, tuple(map(_person, message.tracks)))


def _person(track: Any) -> TrackedPerson:
    place, moving = track.pose.pose.position, track.twist.twist.linear
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = np.reshape(track.pose.covariance, (6, 6))[:2, :2]
    covariance[2:, 2:] = np.reshape(track.twist.covariance, (6, 6))[:2, :2]
    return TrackedPerson(
        int(track.track_id),
        np.array([place.x, place.y]),
        np.array([moving.x, moving.y]),
        np.where(covariance >= UNKNOWN_VARIANCE, np.inf, covariance),
        float("nan"),
        float("nan"),
        float(track.age.sec + track.age.nanosec / NS),
        0.0 if track.is_matched else float("nan"),
        None,
    )


def _skeleton(message: Any) -> TrackSkeleton:
    positions = np.array([(one.x, one.y, one.z) for one in message.positions], np.float32).reshape(-1, 3)
    return TrackSkeleton(
        _stamp(message),
        message.header.frame_id,
        int(message.track_id),
        message.module,
        tuple(message.names),
        positions,
        np.asarray(message.confidence, np.float32),
        np.asarray(message.deviation, np.float32),
        np.asarray(message.hidden, np.float32),
    )


def _orientation(message: Any) -> OrientationResult:
    return OrientationResult(
        _stamp(message),
        message.header.frame_id,
        int(message.track_id),
        message.module,
        float("nan"),
        message.region,
        float(message.angle),
        float(message.concentration),
        float(message.probability),
        message.posture,
        float(message.posture_probability),
    )


def _plan(message: Any) -> Plan:
    stamp = _stamp(message)
    asked = zip(message.asked_tracks, message.asked_modules, strict=True)
    skipped = zip(message.skipped_tracks, message.skipped_modules, message.reasons, strict=True)
    return Plan(
        stamp,
        tuple(Request(stamp, int(k), module, NOWHERE, NOWHERE, np.full(3, np.nan)) for k, module in asked),
        tuple(Skip(stamp, int(k), module, reason) for k, module, reason in skipped),
        float(message.spent),
        float(message.budget),
    )


MAKERS: Mapping[str, Callable[[Any], Told | None]] = {
    "tf2_msgs/msg/TFMessage": _pose,
    "spencer_tracking_msgs/msg/TrackedPersons": _persons,
    "undergrowth_msgs/msg/Skeleton": _skeleton,
    "undergrowth_msgs/msg/Orientation": _orientation,
    "undergrowth_msgs/msg/Plan": _plan,
}
"""By type."""
