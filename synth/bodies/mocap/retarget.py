"""Carries a motion over to our hinges: joint angles within limits whose limbs point where the source's do."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.retarget_kernels import MotionArrays, solve_motion
from synth.bodies.mocap.source import Source
from synth.bodies.rig.kinematics import AXIS_IDX, AXIS_SIGN
from synth.bodies.skeleton import DOF_IDX, LOWER, N_DOFS, PARENT_LINK, UPPER, Lengths, make_skeleton

_TRUNK = (
    "lumbar_flexion", "lumbar_lateral", "lumbar_rotation", "thorax_flexion", "thorax_lateral", "thorax_rotation",
)  # fmt: skip
_NECK = ("neck_flexion", "neck_lateral", "neck_rotation", "head_flexion", "head_rotation")
_ARM = (
    "shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion", "forearm_pronation",
    "wrist_flexion", "wrist_deviation",
)  # fmt: skip
_LEG = ("hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "ankle_flexion", "ankle_inversion")
_CLAVICLE = ("clavicle_elevation", "clavicle_protraction")
RELAXED: dict[str, float] = {"fingers_flexion": 18.0, "fingertips_flexion": 22.0, "thumb_flexion": 12.0}
"""Hinges that motion capture does not tell, both sides [degrees]."""


class Retargeted(NamedTuple):
    """Poses of our skeleton.

    Attributes:
        angles: (n, n_dofs) float64 within the limits [rad].
        root: (n, 3, 3) rotation of the root; its left axis points along y as seen from above.
    """

    angles: NDArray[np.float64]
    root: NDArray[np.float64]


def retarget(source: Source) -> Retargeted:
    """Finds the joint angles of every frame of a motion.

    The pelvis turns as the source's; thorax and head take the source's directions, spread over their hinges;
    limbs point where the source's do. What passes a limit is bent to the nearest direction (damped least squares).

    Args:
        source: The motion.
    """
    root = _without_heading(source.pelvis)
    relative = np.swapaxes(source.pelvis, 1, 2)
    # Angles carry over to any size of body, so one of average proportions stands for all.
    skeleton = make_skeleton(Lengths.of_stature(1.7))
    n = len(root)
    angles = np.zeros((n, N_DOFS))
    for name, degrees in RELAXED.items():
        for side in "lr":
            angles[:, DOF_IDX[f"{side}_{name}"]] = np.radians(degrees)
    for k, side in enumerate("lr"):
        for name, angle in zip(_CLAVICLE, _clavicle_angles(source, k), strict=True):
            dof = DOF_IDX[f"{side}_{name}"]
            angles[:, dof] = np.clip(angle, LOWER[dof], UPPER[dof])
    motion = MotionArrays(
        thorax=relative @ source.thorax,
        head=relative @ source.head,
        limb=_in_root(relative, source.limb),
        fingers=_in_root(relative, source.fingers),
        palm=_in_root(relative, source.palm),
        toes=_in_root(relative, source.toes),
        sole=_in_root(relative, source.sole),
    )
    chains = (_dofs(_TRUNK), _dofs(_NECK), *(_dofs(names, side) for names in (_ARM, _LEG) for side in "lr"))
    solve_motion(motion, *chains, skeleton.offsets, PARENT_LINK, AXIS_IDX, AXIS_SIGN, LOWER, UPPER, angles)
    return Retargeted(angles, root)


def _dofs(names: tuple[str, ...], side: str = "") -> NDArray[np.int64]:
    return np.array([DOF_IDX[f"{side}_{name}" if side else name] for name in names], dtype=np.int64)


def _in_root(relative: NDArray[np.float64], directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Directions of (n, ..., 3) in the pelvis' frame."""
    return np.ascontiguousarray(np.einsum("nab,n...b->n...a", relative, directions))


def heading_of(pelvis: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) direction that a pelvis faces, from its left axis, so that it is plain in deep bends too [rad].

    Args:
        pelvis: (n, 3, 3) rotations.
    """
    return np.arctan2(-pelvis[:, 0, 1], pelvis[:, 1, 1])


def _without_heading(pelvis: NDArray[np.float64]) -> NDArray[np.float64]:
    heading = heading_of(pelvis)
    c, s = np.cos(heading), np.sin(heading)
    turn = np.zeros_like(pelvis)
    turn[:, 0, 0] = turn[:, 1, 1] = c
    turn[:, 0, 1], turn[:, 1, 0], turn[:, 2, 2] = s, -s, 1.0
    return turn @ pelvis


def _clavicle_angles(source: Source, k: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n,) elevation and (n,) protraction since rest [rad]."""
    outward = -1.0 if k else 1.0
    now, rest = source.clavicle[:, k], source.clavicle_rest[k]
    elevation = np.arctan2(now[:, 2], outward * now[:, 1]) - np.arctan2(rest[2], outward * rest[1])
    protraction = np.arctan2(now[:, 0], outward * now[:, 1]) - np.arctan2(rest[0], outward * rest[1])
    return elevation, protraction
