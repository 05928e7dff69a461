"""Visibility labels from a rendered pair: states of joints, visible shares of joints, parts, person, objects."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from synth.camera import Camera
from synth.render.records import NEAR, RenderedPair
from synth.vocabulary import JOINT_NAMES, N_JOINTS, N_PARTS, PART, JointState

JOINT_RADIUS: tuple[float, ...] = (
    0.09, 0.06, 0.12, 0.07, 0.07, 0.05, 0.05, 0.05, 0.05, 0.09, 0.09, 0.06, 0.06, 0.05, 0.05,
)  # fmt: skip
"""Radius of the disc that is looked at around each joint [m], about that of the limb there."""
DISC_MIN_PIXELS = 1.5
"""A disc is at least this large [px], so that it holds pixels however far the person is."""
REACH = 0.15
"""A surface belongs to a joint if its depth is within the joint's radius plus this of the joint's [m]."""
SELF_OCCLUDED_BELOW = 0.2
"""A joint hides behind its own body if a smaller share of the disc's body pixels belongs to it."""
OCCLUDED_ABOVE = 0.5
"""A joint is occluded if objects cover a larger share of the pixels looked at."""


def _parts_of_joint(name: str) -> tuple[str, ...]:
    """Names of the parts that lie over a joint."""
    both = {
        "head": ("lu_head", "ru_head", "lw_head", "rw_head"),
        "neck": ("neck", "lu_torso", "ru_torso", "l_shoulder", "r_shoulder"),
        "torso": ("lu_torso", "ru_torso", "lw_torso", "rw_torso"),
    }
    if name in both:
        return both[name]
    side, joint = name.split("_")
    limb = {
        "shoulder": ("{}_shoulder", "{}u_arm", "{}u_torso"),
        "elbow": ("{}_elbow", "{}u_arm", "{}w_arm"),
        "hand": ("{}_hand", "{}_wrist"),
        "hip": ("{}w_torso", "{}u_leg"),
        "knee": ("{}_knee", "{}u_leg", "{}w_leg"),
        "foot": ("{}_foot", "{}_ankle"),
    }
    return tuple(part.format(side) for part in limb[joint])


def _joint_part_table() -> NDArray[np.bool_]:
    table = np.zeros((N_JOINTS, N_PARTS + 1), np.bool_)
    for joint_idx, name in enumerate(JOINT_NAMES):
        table[joint_idx, [PART[part] for part in _parts_of_joint(name)]] = True
    table.setflags(write=False)
    return table


IS_PART_OF_JOINT = _joint_part_table()
"""(15, 32) bool: whether the surface of a part lies over a joint."""


@dataclass(frozen=True)
class Visibility:
    """How much of a person and of the objects the composite shows; fields as in `Frame` and its records.

    Attributes:
        joint_state: (15,) uint8 `JointState`.
        joint_visible_fraction: (15,) float32.
        part_visible_fraction: (32,) float32 by part label.
        visible_fraction: Person's pixels in the composite over those of the body alone; 0 if it has none.
        object_visible_fraction: (largest instance + 1,) float64 by instance: pixels in the composite over those
            of the object alone; 0 if it covers none.
    """

    joint_state: NDArray[np.uint8]
    joint_visible_fraction: NDArray[np.float32]
    part_visible_fraction: NDArray[np.float32]
    visible_fraction: float
    object_visible_fraction: NDArray[np.float64]


def measure_visibility(pair: RenderedPair, joints: ArrayLike, camera: Camera, near: float = NEAR) -> Visibility:
    """Compares the two layers.

    A joint is OUTSIDE if it lies before the near plane or if the pixel nearest to its projection is outside the
    image. Else the disc of its limb's radius around the projection is looked at. The joint's own pixels are
    those where the body alone shows one of the joint's parts, at a depth within reach of the joint's.

    - The joint's own pixels are less than a fifth of the disc's body pixels: OCCLUDED if objects cover more
      than half of the disc's body pixels (an object in front wins over the own body), else SELF_OCCLUDED. Its
      visible fraction is 0.
    - Else it is OCCLUDED if objects cover more than half of its own pixels, VISIBLE otherwise. Its visible
      fraction is the share of its own pixels that the composite shows.

    Args:
        pair: The two layers.
        joints: (15, 3) joint centres, camera frame [m].
        camera: The camera that drew the pair.
        near: Its near plane [m].
    """
    xyz = np.ascontiguousarray(joints, dtype=np.float64)
    if xyz.shape != (N_JOINTS, 3):
        raise ValueError(f"joints have shape {xyz.shape}, must be ({N_JOINTS}, 3)")
    if pair.depth.shape != (camera.height, camera.width):
        raise ValueError(f"images have shape {pair.depth.shape}, the camera's is {(camera.height, camera.width)}")
    n_body, n_seen, n_object = _count_pixels(
        pair.body_part.reshape(-1), pair.part.reshape(-1), pair.instance.reshape(-1)
    )
    state, fraction = _label_joints(
        xyz,
        (camera.fx, camera.fy, camera.cx, camera.cy),
        near,
        np.array(JOINT_RADIUS),
        IS_PART_OF_JOINT,
        pair.body_part,
        pair.body_depth,
        pair.part,
        pair.occluder,
    )
    alone = pair.object_pixels
    return Visibility(
        joint_state=state,
        joint_visible_fraction=fraction,
        part_visible_fraction=(n_seen / np.maximum(n_body, 1)).astype(np.float32),
        visible_fraction=float(n_seen.sum() / max(int(n_body.sum()), 1)),
        object_visible_fraction=n_object[: len(alone)] * (np.arange(len(alone)) > 0) / np.maximum(alone, 1),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _count_pixels(
    body_part: NDArray[np.uint8], part: NDArray[np.uint8], instance: NDArray[np.uint8]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Counts pixels by part in the body layer, those that the composite still shows, and by object.

    Args:
        body_part: (n,) uint8.
        part: (n,) uint8.
        instance: (n,) uint8.

    Returns:
        (32,), (32,), (256,) int64; the counts of part 0 are 0.
    """
    n_body = np.zeros(32, np.int64)
    n_seen = np.zeros(32, np.int64)
    n_object = np.zeros(256, np.int64)
    for i in range(body_part.size):
        if body_part[i] | instance[i]:
            n_body[body_part[i]] += 1
            n_seen[part[i]] += 1
            n_object[instance[i]] += 1
    n_body[0] = 0
    n_seen[0] = 0
    return n_body, n_seen, n_object


@njit(cache=True, nogil=True, error_model="numpy")
def _count_disc(
    u: float,
    v: float,
    radius: float,
    depth_range: tuple[float, float],
    is_own: NDArray[np.bool_],
    body_part: NDArray[np.uint8],
    body_depth: NDArray[np.uint16],
    part: NDArray[np.uint8],
    occluder: NDArray[np.uint8],
) -> tuple[int, int, int, int]:
    """Counts the body's pixels in a disc.

    Args:
        u: Centre [px].
        v: Centre [px].
        radius: [px].
        depth_range: Least and greatest depth of a joint's own surface [mm].
        is_own: (32,) whether a part belongs to the joint.
        body_part: (height, width) uint8.
        body_depth: (height, width) uint16 [mm].
        part: (height, width) uint8.
        occluder: (height, width) uint8.

    Returns:
        Number of body pixels, of those covered by objects, of own pixels, of own pixels in the composite.
    """
    height, width = body_part.shape
    n_body, n_covered, n_own, n_seen = 0, 0, 0, 0
    for y in range(max(int(np.ceil(v - radius)), 0), min(int(np.floor(v + radius)), height - 1) + 1):
        half = np.sqrt(max(radius * radius - (y - v) * (y - v), 0.0))
        for x in range(max(int(np.ceil(u - half)), 0), min(int(np.floor(u + half)), width - 1) + 1):
            label = body_part[y, x]
            if label == 0:
                continue
            is_reached = depth_range[0] <= body_depth[y, x] <= depth_range[1]
            n_body += 1
            n_covered += occluder[y, x] != 0
            n_own += is_own[label] and is_reached
            n_seen += is_own[label] and is_reached and part[y, x] == label
    return n_body, n_covered, n_own, n_seen


@njit(cache=True, nogil=True, error_model="numpy")
def _label_joints(
    joints: NDArray[np.float64],
    intrinsics: tuple[float, float, float, float],
    near: float,
    joint_radius: NDArray[np.float64],
    is_part_of_joint: NDArray[np.bool_],
    body_part: NDArray[np.uint8],
    body_depth: NDArray[np.uint16],
    part: NDArray[np.uint8],
    occluder: NDArray[np.uint8],
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """States and visible fractions of joints, as `measure_visibility` says.

    Args:
        joints: (15, 3) float64, camera frame [m].
        intrinsics: fx, fy, cx, cy [px].
        near: Near plane [m].
        joint_radius: (15,) [m].
        is_part_of_joint: (15, 32) bool.
        body_part: (height, width) uint8.
        body_depth: (height, width) uint16 [mm].
        part: (height, width) uint8.
        occluder: (height, width) uint8.
    """
    n = joints.shape[0]
    state = np.empty(n, np.uint8)
    fraction = np.zeros(n, np.float32)
    fx, fy, cx, cy = intrinsics
    height, width = body_part.shape
    for j in range(n):
        z = joints[j, 2]
        u = fx * joints[j, 0] / z + cx
        v = fy * joints[j, 1] / z + cy
        if not (z > near and -0.5 <= u < width - 0.5 and -0.5 <= v < height - 0.5):
            state[j] = JointState.OUTSIDE.value
            continue
        reach = joint_radius[j] + REACH
        depth_range = ((z - reach) * 1000.0, (z + reach) * 1000.0)
        radius = max(joint_radius[j] * fx / z, DISC_MIN_PIXELS)
        n_body, n_covered, n_own, n_seen = _count_disc(
            u, v, radius, depth_range, is_part_of_joint[j], body_part, body_depth, part, occluder
        )
        if n_own == 0 or n_own < SELF_OCCLUDED_BELOW * n_body:
            is_hidden = n_covered > OCCLUDED_ABOVE * n_body
            state[j] = JointState.OCCLUDED.value if is_hidden else JointState.SELF_OCCLUDED.value
            continue
        fraction[j] = n_seen / n_own
        is_hidden = n_own - n_seen > OCCLUDED_ABOVE * n_own
        state[j] = JointState.OCCLUDED.value if is_hidden else JointState.VISIBLE.value
    return state, fraction
