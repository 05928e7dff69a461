"""Tracks that another tracker gives: where they are in the image, so that modules can be asked about them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from pipelines.online.detecting import TYPICAL_HEIGHT_M
from pipelines.online.messages import CameraFrame, Detection, TrackedPerson, TrackedPersons

HALF_M, HALF_UPPER_M = 0.35, 0.3
"""Half the width of a person's box and of one around head and shoulders [m]."""
ABOVE_M, BELOW_M, FEET_M = 0.05, 0.6, 0.05
"""Boxes begin above the top; one around head and shoulders ends below it, a person's above the floor [m]."""
SAME_M = 0.5
"""Pixels are a person's if their depth differs from the axis' by no more [m]."""
LEAST_VISIBLE = 0.05
"""Less is as good as hidden."""
GRID = 12
"""Rows and columns of the pixels that are looked at."""


def placed(tracks: TrackedPersons, frame: CameraFrame, T_floor_camera: NDArray[np.float64]) -> TrackedPersons:
    """Tracks with boxes in an image; those who are not in it, or hidden, are as if not detected.

    Args:
        tracks: Of the time of the image, as another tracker gives them.
        frame: The image.
        T_floor_camera: (4, 4) float64, the camera in the tracks' frame of reference.
    """
    T_camera_floor = np.asarray(np.linalg.inv(T_floor_camera), np.float64)
    return replace(
        tracks,
        persons=tuple(replace(one, detection=_seen(one, frame, T_camera_floor)) for one in tracks.persons),
    )


def _seen(person: TrackedPerson, frame: CameraFrame, T_camera_floor: NDArray[np.float64]) -> Detection | None:
    top = TYPICAL_HEIGHT_M if np.isnan(person.height) else person.height
    axis = _in_camera(T_camera_floor, person.place, top)
    if axis[2] < 0.3:
        return None
    box = _box(frame, T_camera_floor, person.place, FEET_M, top + ABOVE_M, HALF_M)
    upper = _box(frame, T_camera_floor, person.place, top - BELOW_M, top + ABOVE_M, HALF_UPPER_M)
    if box is None or upper is None:
        return None
    share = _share(frame.depth, box, axis[2])
    if share < LEAST_VISIBLE:
        return None
    distance = float(np.hypot(*(T_camera_floor[:3, :3].T @ axis)[:2]))
    return Detection(person.place, person.height, person.confidence, distance, share, box, upper, axis)


def _in_camera(T_camera_floor: NDArray[np.float64], place: NDArray[np.float64], z: float) -> NDArray[np.float64]:
    return T_camera_floor[:3, :3] @ np.array([place[0], place[1], z]) + T_camera_floor[:3, 3]


def _box(
    frame: CameraFrame,
    T_camera_floor: NDArray[np.float64],
    place: NDArray[np.float64],
    low: float,
    high: float,
    half: float,
) -> Box | None:
    """Around an upright cylinder, clipped to the image; None = outside."""
    camera, (height, width) = frame.camera, frame.depth.shape
    ends = np.array([_in_camera(T_camera_floor, place, z) for z in (low, high)])
    z = np.maximum(ends[:, 2], 0.1)
    u, v, reach = (
        camera.fx * ends[:, 0] / z + camera.cx,
        camera.fy * ends[:, 1] / z + camera.cy,
        camera.fx * half / z,
    )
    edges = (u - reach).min(), v.min(), (u + reach).max(), v.max()
    box = tuple(float(np.clip(edge, 0, end)) for edge, end in zip(edges, (width, height) * 2, strict=True))
    return (box[0], box[1], box[2], box[3]) if box[0] + 1 < box[2] and box[1] + 1 < box[3] else None


def _share(depth: NDArray[np.uint16], box: Box, distance: float) -> float:
    """Share of the middle of a box that shows something at the person's distance."""
    left, top, right, bottom = box
    quarter = (right - left) / 4
    u = np.linspace(left + quarter, right - quarter - 1, GRID).round().astype(int).clip(0, depth.shape[1] - 1)
    v = np.linspace(top, bottom - 1, GRID).round().astype(int).clip(0, depth.shape[0] - 1)
    return float((np.abs(depth[np.ix_(v, u)] * 1e-3 - distance) <= SAME_M).mean())
