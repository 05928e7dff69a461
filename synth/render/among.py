"""Visibility labels in whole scenes: what hides each joint, the own body, an object or another person."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from synth.camera import Camera
from synth.render.labels import (
    DISC_MIN_PIXELS,
    IS_PART_OF_JOINT,
    JOINT_RADIUS,
    OCCLUDED_ABOVE,
    REACH,
    SELF_OCCLUDED_BELOW,
)
from synth.render.records import NEAR
from synth.render.rooms import BodyCrop, RenderedRoom
from synth.vocabulary import JointState


@dataclass(frozen=True)
class PersonVisibility:
    """How much of one person the composite shows; fields as in `PersonView` and `PersonRecord`.

    Attributes:
        joint_state: (15,) uint8 `JointState`.
        joint_visible_fraction: (15,) float32.
        part_visible_fraction: (32,) float32 by part label.
        visible_fraction: Pixels in the composite over those of the body alone; 0 if it has none.
        n_seen: Pixels in the composite.
    """

    joint_state: NDArray[np.uint8]
    joint_visible_fraction: NDArray[np.float32]
    part_visible_fraction: NDArray[np.float32]
    visible_fraction: float
    n_seen: int


def measure_person(
    room: RenderedRoom, k: int, joints: ArrayLike, camera: Camera, near: float = NEAR
) -> PersonVisibility:
    """Compares the composite with one person alone.

    The rules are those of `measure_visibility`; what covers a joint is an object, a surface or another person.
    Where something hides a joint, it is OCCLUDED_BY_PERSON if other people cover more of the pixels looked at than
    objects and surfaces do, and OCCLUDED else.

    Args:
        room: The scene.
        k: Index of the person, from 0.
        joints: (15, 3) joint centres, camera frame [m].
        camera: The camera that drew the scene.
        near: Its near plane [m].
    """
    body: BodyCrop = room.bodies[k]
    left, top, width, height = body.box
    window = slice(top, top + height), slice(left, left + width)
    person = np.ascontiguousarray(room.person[window])
    n_body, n_seen = _count_parts(body.part, person, np.ascontiguousarray(room.part[window]), k + 1)
    state, fraction = _label_joints(
        np.ascontiguousarray(joints, dtype=np.float64),
        (camera.fx, camera.fy, camera.cx, camera.cy),
        (camera.width, camera.height),
        (left, top),
        near,
        np.array(JOINT_RADIUS),
        IS_PART_OF_JOINT,
        body.part,
        body.depth,
        person,
        k + 1,
    )
    return PersonVisibility(
        joint_state=state,
        joint_visible_fraction=fraction,
        part_visible_fraction=(n_seen / np.maximum(n_body, 1)).astype(np.float32),
        visible_fraction=float(n_seen.sum() / max(int(n_body.sum()), 1)),
        n_seen=int(n_seen.sum()),
    )


def object_fractions(room: RenderedRoom) -> NDArray[np.float64]:
    """(largest instance + 1,) pixels of each object in the composite over those of it alone; 0 if it covers none."""
    alone = room.object_pixels
    n_seen = _count_values(room.instance.reshape(-1))[: len(alone)]
    return n_seen * (np.arange(len(alone)) > 0) / np.maximum(alone, 1)


@njit(cache=True, nogil=True, error_model="numpy")
def _count_values(image: NDArray[np.uint8]) -> NDArray[np.int64]:
    """(256,) int64 how often each value stands in (n,) uint8: `np.bincount` without a copy as integers."""
    n = np.zeros(256, np.int64)
    last, start = image[0], 0  # neighbours are mostly alike: runs are counted
    for i in range(image.size):
        if image[i] != last:
            n[last] += i - start
            last, start = image[i], i
    n[last] += image.size - start
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def _count_parts(
    body_part: NDArray[np.uint8], person: NDArray[np.uint8], part: NDArray[np.uint8], number: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(32,), (32,) int64 pixels by part of the person alone, and in the composite; those of part 0 are 0."""
    n_body = np.zeros(32, np.int64)
    n_seen = np.zeros(32, np.int64)
    for y in range(body_part.shape[0]):
        for x in range(body_part.shape[1]):
            n_body[body_part[y, x]] += 1
            n_seen[part[y, x] if person[y, x] == number else 0] += 1
    n_body[0] = 0
    n_seen[0] = 0
    return n_body, n_seen


@njit(cache=True, nogil=True, error_model="numpy")
def _count_disc(
    u: float,
    v: float,
    radius: float,
    depth_range: tuple[float, float],
    is_own: NDArray[np.bool_],
    body_part: NDArray[np.uint8],
    body_depth: NDArray[np.uint16],
    person: NDArray[np.uint8],
    number: int,
) -> NDArray[np.int64]:
    """Counts a body's pixels in a disc of its crop.

    Args:
        u: Centre, in the crop [px].
        v: Centre, in the crop [px].
        radius: [px].
        depth_range: Least and greatest depth of a joint's own surface [mm].
        is_own: (32,) whether a part belongs to the joint.
        body_part: (height, width) uint8.
        body_depth: (height, width) uint16 [mm].
        person: (height, width) uint8 who is seen there.
        number: The person's own number.

    Returns:
        (6,) int64 number of body pixels, of those covered by things, of those covered by people; the same three of
        own pixels.
    """
    height, width = body_part.shape
    n = np.zeros(6, np.int64)
    for y in range(max(int(np.ceil(v - radius)), 0), min(int(np.floor(v + radius)), height - 1) + 1):
        half = np.sqrt(max(radius * radius - (y - v) * (y - v), 0.0))
        for x in range(max(int(np.ceil(u - half)), 0), min(int(np.floor(u + half)), width - 1) + 1):
            label = body_part[y, x]
            if label == 0:
                continue
            is_thing = person[y, x] == 0
            is_other = person[y, x] != number and not is_thing
            n[0] += 1
            n[1] += is_thing
            n[2] += is_other
            if is_own[label] and depth_range[0] <= body_depth[y, x] <= depth_range[1]:
                n[3] += 1
                n[4] += is_thing
                n[5] += is_other
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def _label_joints(
    joints: NDArray[np.float64],
    intrinsics: tuple[float, float, float, float],
    size: tuple[int, int],
    corner: tuple[int, int],
    near: float,
    joint_radius: NDArray[np.float64],
    is_part_of_joint: NDArray[np.bool_],
    body_part: NDArray[np.uint8],
    body_depth: NDArray[np.uint16],
    person: NDArray[np.uint8],
    number: int,
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """States and visible fractions of joints, as `measure_person` says.

    Args:
        joints: (15, 3) float64, camera frame [m].
        intrinsics: fx, fy, cx, cy [px].
        size: Width and height of the image [px].
        corner: Left and top of the crop [px].
        near: Near plane [m].
        joint_radius: (15,) [m].
        is_part_of_joint: (15, 32) bool.
        body_part: (height, width) uint8 crop.
        body_depth: (height, width) uint16 crop.
        person: (height, width) uint8 crop of who is seen.
        number: The person's own number.
    """
    n_joints = joints.shape[0]
    state = np.empty(n_joints, np.uint8)
    fraction = np.zeros(n_joints, np.float32)
    fx, fy, cx, cy = intrinsics
    for j in range(n_joints):
        z = joints[j, 2]
        u = fx * joints[j, 0] / z + cx
        v = fy * joints[j, 1] / z + cy
        if not (z > near and -0.5 <= u < size[0] - 0.5 and -0.5 <= v < size[1] - 0.5):
            state[j] = JointState.OUTSIDE.value
            continue
        reach = joint_radius[j] + REACH
        radius = max(joint_radius[j] * fx / z, DISC_MIN_PIXELS)
        n = _count_disc(
            u - corner[0], v - corner[1], radius, ((z - reach) * 1000.0, (z + reach) * 1000.0),
            is_part_of_joint[j], body_part, body_depth, person, number,
        )  # fmt: skip
        first, otherwise = 3, JointState.VISIBLE.value
        if n[3] == 0 or n[3] < SELF_OCCLUDED_BELOW * n[0]:
            first, otherwise = 0, JointState.SELF_OCCLUDED.value
        else:
            fraction[j] = (n[3] - n[4] - n[5]) / n[3]
        if n[first + 1] + n[first + 2] > OCCLUDED_ABOVE * n[first]:
            is_person = n[first + 2] > n[first + 1]
            state[j] = JointState.OCCLUDED_BY_PERSON.value if is_person else JointState.OCCLUDED.value
        else:
            state[j] = otherwise
    return state, fraction
