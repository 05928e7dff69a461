"""Training points: around a joint, and along the way to it from where walks start."""

import math
from typing import NamedTuple

import numpy as np
from numba import int32, njit, uint64
from numpy.typing import NDArray

from forests.crops import NOTHING, Crops
from forests.frames import is_known
from forests.growing import DIRECTION_ONE
from forests.hashing import hash4, splitmix64, unit_float
from forests.rwf.walk import NEAREST_M, gated, pixel_of
from forests.samples import Samples

_POINT_STREAM = 0x9B17


class WayPoints(NamedTuple):
    """Training points of one expert.

    Attributes:
        samples: Where they read the images; the label is 1.
        offsets: (n, 3) float32, from the point to the joint [m].
    """

    samples: Samples
    offsets: NDArray[np.float32]


def draw_way_points(
    crops: Crops,
    joints: NDArray[np.float32],
    starts: NDArray[np.float32],
    gate_m: NDArray[np.float32],
    n_points: int,
    near_share: float,
    reach_m: float,
    noise_m: float,
    seed: int,
    stream: int,
) -> WayPoints:
    """Draws an expert's training points.

    The first of them lie in a ball around the joint, all radii alike; the rest on the lines to the joint from
    places spread normally about the start. All are moved into the gate, as the points of a walk are. Frames that
    do not know the joint give no points; the other frames' points do not depend on them.

    Args:
        crops: The images.
        joints: (n_frames, 3) float32, the expert's joint, camera frame [m]; NaN = unknown.
        starts: (n_frames, 3) float32, where its walks start, camera frame [m].
        gate_m: (2,) float32: points less than the first behind the measured depth are put on it, and none lies
            farther behind it than the second [m].
        n_points: Points a frame.
        near_share: Share of the points in the ball.
        reach_m: Radius of the ball [m].
        noise_m: Standard deviation of the starts, along each axis [m].
        seed: Of the drawing.
        stream: Number of the expert and its tree: experts draw independently of one another.
    """
    known = np.flatnonzero(is_known(joints)).astype(np.int32)
    n = len(known) * n_points
    frame = np.repeat(known, n_points)
    x, y, z = np.empty(n, np.int16), np.empty(n, np.int16), np.empty(n, np.uint16)
    offsets = np.empty((n, 3), np.float32)
    n_near = round(near_share * n_points)
    _draw(crops, known, joints, starts, gate_m, n_points, n_near, reach_m, noise_m, seed, stream, x, y, z, offsets)
    order = np.lexsort((x, y, frame))
    samples = Samples(frame, x[order], y[order], z[order], np.ones(n, np.uint8))
    return WayPoints(samples, offsets[order])


def growth_targets(offsets: NDArray[np.float32], softness_m: float) -> NDArray[np.int16]:
    """What trees are grown by: offsets d shortened to d / sqrt(|d|^2 + s^2), so that far points do not outweigh near.

    Far from the joint this is its direction, near it the offset itself.

    Args:
        offsets: (n, 3) float32 [m].
        softness_m: s [m]; 0 = directions alone.

    Returns:
        (n, 3) int16, DIRECTION_ONE a unit.
    """
    exact = offsets.astype(np.float64)
    length = np.sqrt((exact**2).sum(axis=1, keepdims=True) + softness_m**2)
    return np.round(exact * (DIRECTION_ONE / np.maximum(length, 1e-6))).astype(np.int16)


@njit(cache=True, nogil=True)
def crop_depth(crops: Crops, frame: int, column: float, row: float) -> int:
    """Depth at a pixel of the image [mm], NOTHING where nothing is. Coordinates plus one half."""
    x = int32(math.floor(column)) - crops.origin[frame, 0]
    y = int32(math.floor(row)) - crops.origin[frame, 1]
    if x < 0 or y < 0 or x >= crops.width[frame] or y >= crops.height[frame]:
        return int32(NOTHING)
    return int32(crops.pixels[crops.start[frame] + np.int64(y) * crops.width[frame] + x])


@njit(cache=True, nogil=True)
def _normal(key: int) -> float:
    """A normal deviate from a key (Box and Muller 1958)."""
    radius = math.sqrt(-2.0 * math.log(1.0 - unit_float(key)))
    return radius * math.cos(2.0 * math.pi * unit_float(splitmix64(key)))


@njit(cache=True, nogil=True)
def _draw_point(
    joint: np.ndarray, start: np.ndarray, is_near: bool, reach_m: float, noise_m: float, key: int, out: np.ndarray
) -> None:
    keys = np.empty(4, np.uint64)
    for i in range(4):
        key = splitmix64(uint64(key) + uint64(i))
        keys[i] = key
    share = unit_float(keys[3])
    if is_near:
        cosine = 2.0 * unit_float(keys[0]) - 1.0
        sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
        angle = 2.0 * math.pi * unit_float(keys[1])
        out[0] = joint[0] + reach_m * share * sine * math.cos(angle)
        out[1] = joint[1] + reach_m * share * sine * math.sin(angle)
        out[2] = joint[2] + reach_m * share * cosine
    else:
        for axis in range(3):
            place = start[axis] + noise_m * _normal(keys[axis])
            out[axis] = joint[axis] + share * (place - joint[axis])


@njit(cache=True, nogil=True)
def _draw(
    crops: Crops, known: np.ndarray, joints: np.ndarray, starts: np.ndarray, gate_m: np.ndarray, n_points: int,
    n_near: int, reach_m: float, noise_m: float, seed: int, stream: int,
    x: np.ndarray, y: np.ndarray, z_mm: np.ndarray, offsets: np.ndarray,
) -> None:  # fmt: skip
    point = np.empty(3, np.float32)
    for number in range(len(known)):
        frame = known[number]
        fx, fy, cx, cy = crops.intrinsics[frame]
        for k in range(n_points):
            i = number * n_points + k
            key = hash4(seed, _POINT_STREAM + stream, frame, k)
            _draw_point(joints[frame], starts[frame], k < n_near, reach_m, noise_m, key, point)
            z = max(point[2], np.float32(NEAREST_M))
            column, row = pixel_of(point[0], z, fx, cx), pixel_of(point[1], z, fy, cy)
            kept = gated(z, crop_depth(crops, frame, column, row), gate_m[0], gate_m[1])
            x[i] = int32(math.floor(column)) - crops.origin[frame, 0]
            y[i] = int32(math.floor(row)) - crops.origin[frame, 1]
            z_mm[i] = np.uint16(kept * np.float32(1e3) + np.float32(0.5))
            offsets[i, 0] = joints[frame, 0] - point[0] * (kept / z)
            offsets[i, 1] = joints[frame, 1] - point[1] * (kept / z)
            offsets[i, 2] = joints[frame, 2] - kept


def farthest_behind(crops: Crops, joints: NDArray[np.float32], share: float) -> float:
    """How far one joint lies behind what the image shows at its pixel, at most.

    Args:
        crops: The images.
        joints: (n_frames, 3) float32, camera frame [m]; NaN = unknown.
        share: Share of the frames whose joint lies farther behind.

    Returns:
        A distance along z [m]; inf if no joint has anything before it.
    """
    gap = _gaps(crops, joints)
    gap = gap[np.isfinite(gap)]
    return float(max(np.quantile(gap, 1.0 - share), 0.0)) if len(gap) else np.inf


@njit(cache=True, nogil=True)
def _gaps(crops: Crops, joints: np.ndarray) -> np.ndarray:
    gap = np.full(len(joints), np.nan, np.float64)
    for frame in range(len(joints)):
        fx, fy, cx, cy = crops.intrinsics[frame]
        x, y, z = joints[frame]
        if not z >= NEAREST_M:  # NaN neither
            continue
        surface = crop_depth(crops, frame, pixel_of(x, z, fx, cx), pixel_of(y, z, fy, cy))
        if surface != NOTHING:
            gap[frame] = z - surface * 1e-3
    return gap
