"""Images, cameras, point clouds and the camera's pose, as messages of ROS."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipelines.online.messages import CameraFrame, CameraPose
from pipelines.online.ros.making import Maker, Outgoing

CLOUD_STEP = 4
"""Every so many rows and columns of the image are in the point cloud."""


def frame_messages(maker: Maker, frame: CameraFrame, camera_name: str) -> Iterator[Outgoing]:
    """An image, its camera, and a point cloud of every fourth row and column."""
    header = maker.header(frame.stamp, frame.frame_id)
    height, width = frame.depth.shape
    camera = frame.camera
    image = maker.make(
        "sensor_msgs/msg/Image",
        header=header,
        height=height,
        width=width,
        encoding="16UC1",
        is_bigendian=0,
        step=2 * width,
        data=np.ascontiguousarray(frame.depth).view(np.uint8).ravel(),
    )
    intrinsics = np.array([camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1.0])
    none = maker.make(
        "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    info = maker.make(
        "sensor_msgs/msg/CameraInfo",
        header=header,
        height=height,
        width=width,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=intrinsics,
        r=np.eye(3).ravel(),
        p=np.hstack([intrinsics.reshape(3, 3), np.zeros((3, 1))]).ravel(),
        binning_x=0,
        binning_y=0,
        roi=none,
    )
    stem = f"/{camera_name}/depth"
    yield Outgoing(f"{stem}/image_rect_raw", "sensor_msgs/msg/Image", frame.stamp, image)
    yield Outgoing(f"{stem}/camera_info", "sensor_msgs/msg/CameraInfo", frame.stamp, info)
    yield Outgoing(f"{stem}/points", "sensor_msgs/msg/PointCloud2", frame.stamp, _cloud(maker, frame, header))


def _cloud(maker: Maker, frame: CameraFrame, header: Any) -> Any:
    points = cloud_points(frame)
    fields = [
        maker.make("sensor_msgs/msg/PointField", name=name, offset=4 * k, datatype=7, count=1)
        for k, name in enumerate("xyz")
    ]
    return maker.make(
        "sensor_msgs/msg/PointCloud2",
        header=header,
        height=1,
        width=len(points),
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=12 * len(points),
        data=np.frombuffer(points.tobytes(), np.uint8),
        is_dense=True,
    )


def pose_message(maker: Maker, pose: CameraPose) -> Outgoing:
    """Where the camera is, as a transform."""
    turn = Rotation.from_matrix(pose.T_floor_camera[:3, :3]).as_quat()
    transform = maker.make(
        "geometry_msgs/msg/Transform",
        translation=maker.vector(pose.T_floor_camera[:3, 3]),
        rotation=maker.quaternion(turn),
    )
    stamped = maker.make(
        "geometry_msgs/msg/TransformStamped",
        header=maker.header(pose.stamp, pose.frame_id),
        child_frame_id=pose.camera_frame_id,
        transform=transform,
    )
    message = maker.make("tf2_msgs/msg/TFMessage", transforms=[stamped])
    return Outgoing("/tf", "tf2_msgs/msg/TFMessage", pose.stamp, message)


def cloud_points(frame: CameraFrame, step: int = CLOUD_STEP) -> NDArray[np.float32]:
    """(n, 3) float32 points of every step-th row and column that has depth, camera frame [m]."""
    camera, height, width = frame.camera, *frame.depth.shape
    v, u = np.mgrid[0:height:step, 0:width:step]
    z = frame.depth[::step, ::step] * np.float32(1e-3)
    points = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z], axis=-1)
    return np.ascontiguousarray(points[z > 0], np.float32)
