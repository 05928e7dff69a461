"""Forward kinematics: where every link and joint centre of a posed skeleton is."""

from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from synth.bodies.body import Pose
from synth.bodies.skeleton import (
    AXES,
    JOINT_LINKS,
    LINK_IDX,
    MIRRORED_DOF,
    MIRRORED_SIGN,
    N_DOFS,
    N_LINKS,
    PARENT_LINK,
    Skeleton,
)

AXIS_IDX: NDArray[np.int64] = np.argmax(np.abs(AXES), axis=1).astype(np.int64)
"""(n_dofs,) coordinate axis 0, 1 or 2 that hinge i turns about."""
AXIS_SIGN: NDArray[np.float64] = AXES[np.arange(N_DOFS), AXIS_IDX].copy()
"""(n_dofs,) +1 or -1, the sense of the turn."""
JOINT_LINK_IDX: NDArray[np.int64] = np.array([LINK_IDX[name] for name in JOINT_LINKS], dtype=np.int64)
"""(15,) link that carries each joint centre."""

if not np.array_equal(np.abs(AXES).sum(axis=1), np.ones(N_DOFS)):
    raise ValueError("every hinge axis must be a coordinate axis of its parent's frame")


@njit(cache=True, nogil=True)
def turn_about(R: NDArray[np.float64], axis_idx: int, angle: float) -> None:
    """Multiplies a rotation from the right by a turn about a coordinate axis, in place.

    Args:
        R: (3, 3) rotation, or the upper left block of a (4, 4) transform.
        axis_idx: 0, 1 or 2.
        angle: [rad].
    """
    c = np.cos(angle)
    s = np.sin(angle)
    a = (axis_idx + 1) % 3
    b = (axis_idx + 2) % 3
    for row in range(3):
        first = R[row, a]
        second = R[row, b]
        R[row, a] = c * first + s * second
        R[row, b] = c * second - s * first


@njit(cache=True, nogil=True)
def place_links(
    offsets: NDArray[np.float64],
    parent_link: NDArray[np.int64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    angles: NDArray[np.float64],
    T_world_root: NDArray[np.float64],
    T_out: NDArray[np.float64],
) -> None:
    """Kernel of `link_transforms`; T_out is (n_links, 4, 4) and is overwritten."""
    for row in range(4):
        for col in range(4):
            T_out[0, row, col] = T_world_root[row, col]
    for i in range(angles.shape[0]):
        T = T_out[i + 1]
        parent = T_out[parent_link[i]]
        for row in range(3):
            moved = parent[row, 3]
            for k in range(3):
                T[row, k] = parent[row, k]
                moved += parent[row, k] * offsets[i, k]
            T[row, 3] = moved
            T[3, row] = 0.0
        T[3, 3] = 1.0
        if angles[i] != 0.0:
            turn_about(T, axis_idx[i], axis_sign[i] * angles[i])


def link_transforms(skeleton: Skeleton, angles: ArrayLike, T_world_root: ArrayLike) -> NDArray[np.float64]:
    """Places every link of the joint tree.

    Args:
        skeleton: The person's hinges.
        angles: (n_dofs,) [rad], in the order of `DOFS`.
        T_world_root: (4, 4) pose of the root link.

    Returns:
        (n_links, 4, 4) float64 T_world_link, in the order of `LINK_IDX`.
    """
    angles = np.ascontiguousarray(angles, dtype=np.float64)
    T_world_root = np.ascontiguousarray(T_world_root, dtype=np.float64)
    if angles.shape != (N_DOFS,):
        raise ValueError(f"angles have shape {angles.shape}, must be ({N_DOFS},)")
    if T_world_root.shape != (4, 4):
        raise ValueError(f"T_world_root has shape {T_world_root.shape}, must be (4, 4)")
    T_world_link = np.empty((N_LINKS, 4, 4))
    place_links(skeleton.offsets, PARENT_LINK, AXIS_IDX, AXIS_SIGN, angles, T_world_root, T_world_link)
    return T_world_link


def joint_positions(skeleton: Skeleton, pose: Pose) -> NDArray[np.float64]:
    """Centres of the 15 named joints.

    Args:
        skeleton: The person's hinges.
        pose: Angles and root.

    Returns:
        (15, 3) float64 world [m], in the order of `JOINT_NAMES`.
    """
    T = link_transforms(skeleton, pose.angles, pose.T_world_root)[JOINT_LINK_IDX]
    return np.einsum("jab,jb->ja", T[:, :3, :3], skeleton.joint_offsets) + T[:, :3, 3]


def mirror_pose(pose: Pose) -> Pose:
    """Swaps left and right: the pose seen in a mirror standing on the plane y = 0.

    Args:
        pose: Any pose. A symmetric body in the mirrored pose is the mirror image of the body in the pose.
    """
    flip = np.diag([1.0, -1.0, 1.0, 1.0])
    return replace(
        pose,
        angles=pose.angles[MIRRORED_DOF] * MIRRORED_SIGN,
        T_world_root=flip @ pose.T_world_root @ flip,
    )
