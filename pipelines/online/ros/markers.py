"""People and skeletons as markers that RViz and Foxglove draw."""

import colorsys
from typing import Any

import numpy as np

from pipelines.online.messages import TrackedPersons, TrackSkeleton
from pipelines.online.ros.making import Maker

ARROW, CYLINDER, LINE_LIST, TEXT = 0, 3, 5, 9
"""Codes of visualization_msgs/Marker."""
SHOWN_S = 0.4
"""A marker that is not renewed disappears after this [s]."""
BONES = (
    ("head", "neck"),
    ("neck", "torso"),
    ("neck", "r_shoulder"),
    ("neck", "l_shoulder"),
    ("r_shoulder", "r_elbow"),
    ("l_shoulder", "l_elbow"),
    ("r_elbow", "r_hand"),
    ("l_elbow", "l_hand"),
    ("torso", "r_hip"),
    ("torso", "l_hip"),
    ("r_hip", "r_knee"),
    ("l_hip", "l_knee"),
    ("r_knee", "r_foot"),
    ("l_knee", "l_foot"),
)
"""Joints that are joined by a line."""


def track_colour(track_id: int) -> tuple[float, float, float]:
    """Red, green and blue, 0..1, of a track; those of successive tracks lie far apart."""
    return colorsys.hsv_to_rgb((track_id * 0.618034) % 1.0, 0.75, 0.95)


def bone_points(told: TrackSkeleton) -> list[tuple[np.ndarray, np.ndarray]]:
    """Both ends of every bone whose joints are known, (3,) each [m]."""
    at = {name: xyz for name, xyz in zip(told.joints, told.positions, strict=True) if np.isfinite(xyz).all()}
    return [(at[one], at[other]) for one, other in BONES if one in at and other in at]


def person_markers(maker: Maker, header: Any, told: TrackedPersons) -> Any:
    """A cylinder, the number and, of those who walk, an arrow for each track."""
    markers = []
    for one in told.persons:
        number = one.track_id
        x, y, height = float(one.place[0]), float(one.place[1]), float(np.nan_to_num(one.height, nan=1.7))
        middle, above = (x, y, height / 2), (x, y, height + 0.2)
        markers.append(_marker(maker, header, "people", number, CYLINDER, middle, (0.5, 0.5, height), 0.3))
        markers.append(_marker(maker, header, "numbers", number, TEXT, above, (0, 0, 0.25), 1.0, (), str(number)))
        if np.linalg.norm(one.velocity) > 0.2:
            tip = (x + one.velocity[0], y + one.velocity[1], 0.1)
            points = [maker.point((x, y, 0.1)), maker.point(tip)]
            markers.append(
                _marker(maker, header, "velocities", number, ARROW, (0, 0, 0), (0.05, 0.1, 0.1), 1.0, points)
            )
    return maker.make("visualization_msgs/msg/MarkerArray", markers=markers)


def skeleton_markers(maker: Maker, header: Any, told: TrackSkeleton) -> Any:
    """Lines between the joints that are known."""
    points = [maker.point(end) for bone in bone_points(told) for end in bone]
    space = f"skeletons of {told.module}"
    marker = _marker(maker, header, space, told.track_id, LINE_LIST, (0, 0, 0), (0.03, 0, 0), 1.0, points)
    return maker.make("visualization_msgs/msg/MarkerArray", markers=[marker] if points else [])


def _marker(
    maker: Maker, header: Any, space: str, number: int, kind: int, place: Any, scale: Any, alpha: float,
    points: Any = (), text: str = "",
) -> Any:  # fmt: skip
    red, green, blue = track_colour(number)
    pose = maker.make(
        "geometry_msgs/msg/Pose", position=maker.point(place), orientation=maker.quaternion((0, 0, 0, 1))
    )
    never = maker.make("builtin_interfaces/msg/Time", sec=0, nanosec=0)
    nowhere = maker.make("std_msgs/msg/Header", stamp=never, frame_id="")
    none = np.empty(0, np.uint8)
    texture = maker.make("sensor_msgs/msg/CompressedImage", header=nowhere, format="", data=none)
    return maker.make(
        "visualization_msgs/msg/Marker",
        header=header,
        ns=space,
        id=number,
        type=kind,
        action=0,
        pose=pose,
        scale=maker.vector(scale),
        color=maker.make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=alpha),
        lifetime=maker.make("builtin_interfaces/msg/Duration", sec=0, nanosec=int(SHOWN_S * 1e9)),
        frame_locked=False,
        points=list(points),
        colors=[],
        texture_resource="",
        texture=texture,
        uv_coordinates=[],
        text=text,
        mesh_resource="",
        mesh_file=maker.make("visualization_msgs/msg/MeshFile", filename="", data=none),
        mesh_use_embedded_materials=False,
    )
