"""Which way the people of a corpus truly face, and their rough posture."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.skeleton.heading import facings_of
from nets.orientation.config import POSTURES
from pipelines.corpus import Corpus
from synth.vocabulary import JOINT_NAMES

Array = NDArray[np.float64]

BENT_RAD = np.radians(40.0)
"""Who stands with the trunk inclined by more than this is bent [rad]."""
SQUATTING_SHARE = 0.75
"""Who stands on legs whose hips are lower than this share of their length squats."""
_STEEP = 0.9
"""A forward axis whose horizontal part is shorter than sqrt(1 - 0.9^2) tells no heading: the person lies."""


class OrientationTruths(NamedTuple):
    """The truth of n frames.

    Attributes:
        heading: (n,) of the pelvis, about the vertical, relative to the ray from the camera to the person: 0 =
            towards the camera, pi / 2 = towards the image's right [rad]; NaN = not known.
        head: (n, 3) pan, tilt and roll of the head relative to the viewing ray through it, see `head_angles` [rad];
            NaN = not known.
        posture: (n,) int64, code in `POSTURES`; -1 = not known.
    """

    heading: Array
    head: Array
    posture: NDArray[np.int64]


def read_orientations(corpus: Corpus, indices: NDArray[np.int64]) -> OrientationTruths:
    """Reads the truth of frames.

    Generated frames tell everything. Recorded ones tell the heading of the line through shoulders and hips, with the
    camera's y axis for the vertical.

    Args:
        corpus: An open corpus.
        indices: (n,) frame numbers.
    """
    joints = corpus.arrays("joints", indices)
    n = len(indices)
    unknown = np.full((n, 3), np.nan), np.full(n, -1, np.int64)
    if corpus.header.is_recorded:
        facing = facings_of(joints, JOINT_NAMES)
        heading = np.where(facing.any(axis=1), np.arctan2(facing[:, 1], facing[:, 0]), np.nan)
        return OrientationTruths(heading.astype(np.float64), *unknown)
    T_world_camera = corpus.arrays("T_world_camera", indices)
    T_world_root = corpus.arrays("T_world_root", indices)
    heading = headings(T_world_root, T_world_camera)
    if not _is_our_skeleton(corpus):
        return OrientationTruths(heading, *unknown)
    R_world_head = head_rotations(corpus.arrays("angles", indices), T_world_root)
    R_camera_head = np.swapaxes(T_world_camera[:, :3, :3], 1, 2) @ R_world_head
    head = head_angles(R_camera_head, joints[:, JOINT_NAMES.index("head")])
    world = np.einsum("nab,njb->nja", T_world_camera[:, :3, :3], joints) + T_world_camera[:, None, :3, 3]
    is_seated = np.array([_is_seated(corpus.info(int(number)).pose_family) for number in indices], np.int64)
    return OrientationTruths(heading, head, postures(world, is_seated))


def _is_our_skeleton(corpus: Corpus) -> bool:
    """Whether the corpus' joint angles are those of this program's skeleton."""
    from synth.bodies.skeleton import DOFS

    return [row[0] for row in corpus.header.labels["angles"]] == [dof.name for dof in DOFS]


def _is_seated(family: str) -> int:
    """1 of families whose people sit, 0 of others, -1 of those that are not known."""
    from synth.bodies.poses.families import FAMILIES

    return int(FAMILIES[family].posture == "sitting") if family in FAMILIES else -1


def headings(T_world_root: Array, T_world_camera: Array) -> Array:
    """(n,) headings of pelvises [rad], see `OrientationTruths`; NaN of people who lie.

    Args:
        T_world_root: (n, 4, 4) poses of the bodies' roots.
        T_world_camera: (n, 4, 4) poses of the cameras.
    """
    forward = T_world_root[:, :2, 0]
    towards = T_world_camera[:, :2, 3] - T_world_root[:, :2, 3]
    is_upright = np.abs(T_world_root[:, 2, 0]) < _STEEP
    # Seen from above, the image's right is a quarter turn counterclockwise from the way to the camera.
    cos = forward[:, 0] * towards[:, 0] + forward[:, 1] * towards[:, 1]
    sin = forward[:, 1] * towards[:, 0] - forward[:, 0] * towards[:, 1]
    return np.where(is_upright, np.arctan2(sin, cos), np.nan)


def head_rotations(angles: NDArray[np.floating], T_world_root: Array) -> Array:
    """(n, 3, 3) R_world_head of people with these joint angles.

    Args:
        angles: (n, n_dof) of this program's skeleton [rad].
        T_world_root: (n, 4, 4) poses of the bodies' roots.
    """
    from synth.bodies.rig.kinematics import AXIS_IDX, AXIS_SIGN, place_links
    from synth.bodies.skeleton import LINK_IDX, N_DOFS, N_LINKS, PARENT_LINK

    offsets = np.zeros((N_DOFS, 3))  # rotations do not depend on lengths
    T_world_link = np.empty((N_LINKS, 4, 4))
    out = np.empty((len(angles), 3, 3))
    for row, (of_person, T) in enumerate(zip(angles.astype(np.float64), T_world_root, strict=True)):
        place_links(offsets, PARENT_LINK, AXIS_IDX, AXIS_SIGN, of_person, np.ascontiguousarray(T), T_world_link)
        out[row] = T_world_link[LINK_IDX["head_rotation"], :3, :3]
    return out


def head_angles(R_camera_head: Array, head: NDArray[np.floating]) -> Array:
    """Pan, tilt and roll of heads relative to the viewing rays through them.

    The reference looks along the ray into the camera, upright in the image: x towards the camera, y towards the
    image's right, z up. R = Rz(pan) Ry(-tilt) Rx(roll): a positive tilt looks up, a positive roll leans towards the
    own right shoulder.

    Args:
        R_camera_head: (n, 3, 3) rotations of the heads (x forward, y left, z up), camera frame.
        head: (n, 3) centres of the heads, camera frame [m].

    Returns:
        (n, 3) [rad]; NaN where the head's place is not known.
    """
    towards = -head / np.linalg.norm(head, axis=1, keepdims=True)
    right = np.cross(towards, np.array([0.0, 1.0, 0.0]))  # y points down
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    R_camera_ray = np.stack([towards, right, np.cross(towards, right)], axis=2)
    R = np.swapaxes(R_camera_ray, 1, 2) @ R_camera_head
    pan = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    tilt = np.arcsin(np.clip(R[:, 2, 0], -1.0, 1.0))
    roll = np.arctan2(R[:, 2, 1], R[:, 2, 2])
    return np.stack([pan, tilt, roll], axis=1)


def postures(joints: NDArray[np.floating], is_seated: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) codes in `POSTURES`.

    Args:
        joints: (n, 15, 3) world frame [m].
        is_seated: (n,) 1 = a seat carries the person, 0 = the feet do, -1 = not known.
    """
    place = {name: joints[:, k].astype(np.float64) for k, name in enumerate(JOINT_NAMES)}
    trunk = place["neck"] - (place["r_hip"] + place["l_hip"]) / 2.0
    inclination = np.arctan2(np.linalg.norm(trunk[:, :2], axis=1), trunk[:, 2])
    height = np.max([_hip_height(place, side) for side in "rl"], axis=0)
    of_feet = np.select(
        [height < SQUATTING_SHARE, inclination > BENT_RAD],
        [POSTURES.index("squatting"), POSTURES.index("bent")],
        POSTURES.index("standing"),
    )
    known = np.where(is_seated == 1, POSTURES.index("sitting"), of_feet)
    return np.where((is_seated < 0) | ~np.isfinite(height), -1, known)


def _hip_height(place: dict[str, Array], side: str) -> Array:
    """Of a hip over the foot, as a share of the length of the leg."""
    hip, knee, foot = (place[f"{side}_{name}"] for name in ("hip", "knee", "foot"))
    length = np.linalg.norm(hip - knee, axis=1) + np.linalg.norm(knee - foot, axis=1)
    return np.asarray((hip - foot)[:, 2] / np.maximum(length, 1e-9))
