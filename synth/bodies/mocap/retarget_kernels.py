"""Kernels of the retargeting: closed forms for ball joints, then the limbs' least squares within limits."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.rig.ik_kernels import GoalArrays, solve_chain
from synth.bodies.rig.kinematics import place_links

LIMB_WEIGHT = 0.2
"""Strength of a limb's direction [m/rad], beside which the rest is weak."""
TURN_WEIGHT = 0.1
"""Likewise of the axes of thorax and head."""
HAND_WEIGHT = 0.05
"""Likewise of fingers and palms, which markers tell worst."""
TOES_WEIGHT = 0.07
SOLE_WEIGHT = 0.05
REST_WEIGHT = 0.004
"""Pull to the closed form, which decides what no direction does [m/rad]."""
STRAIGHT = 0.26
"""Sine of the bend of an elbow or knee below which it does not tell the limb's twist."""
FLEXION_SHARE = 0.55
LATERAL_SHARE = 0.5
ROTATION_SHARE = 0.2
"""Share of the trunk's turn that the lumbar hinges take, about as their ranges."""
NO_BEND = 99
"""Place of a bend that no goal lies beyond: the closed form of `solve_chain` is left out."""


class MotionArrays(NamedTuple):
    """A motion in the root's frame; directions are unit vectors.

    Attributes:
        thorax: (n, 3, 3) rotation.
        head: (n, 3, 3) rotation.
        limb: (n, 2, 4, 3) by side: upper arm, forearm, thigh, shank.
        fingers: (n, 2, 3).
        palm: (n, 2, 3) out of the palm.
        toes: (n, 2, 3).
        sole: (n, 2, 3) up through the sole.
    """

    thorax: NDArray[np.float64]
    head: NDArray[np.float64]
    limb: NDArray[np.float64]
    fingers: NDArray[np.float64]
    palm: NDArray[np.float64]
    toes: NDArray[np.float64]
    sole: NDArray[np.float64]


@njit(cache=True, nogil=True)
def _set_goal(
    goals: GoalArrays,
    m: int,
    position: int,
    axis: int,
    sign: float,
    target: NDArray[np.float64],
    weight: float,
) -> None:
    """Goal m: an axis of the link at a place of the chain points to the target."""
    goals.position[m] = position
    goals.is_point[m] = 0.0
    for k in range(3):
        goals.local[m, k] = sign if k == axis else 0.0
        goals.target[m, k] = target[k]
        goals.weight[m, k] = weight


@njit(cache=True, nogil=True)
def _new_goals(n: int) -> GoalArrays:
    return GoalArrays(np.empty(n, np.int64), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty(n))


@njit(cache=True, nogil=True)
def _euler(R: NDArray[np.float64]) -> tuple[float, float, float]:
    """Flexion, lateral lean and rotation of R = Ry Rx Rz [rad]."""
    lateral = -np.arcsin(min(max(R[1, 2], -1.0), 1.0))
    return np.arctan2(R[0, 2], R[2, 2]), lateral, np.arctan2(R[1, 0], R[1, 1])


@njit(cache=True, nogil=True)
def ball_start(
    limb: NDArray[np.float64], beyond: NDArray[np.float64], bend_sign: float, side_sign: float
) -> tuple[float, float, float, float]:
    """Closed form of a shoulder or hip and its elbow or knee.

    Args:
        limb: (3,) direction of upper arm or thigh in the frame that carries the joint.
        beyond: (3,) direction of forearm or shank, likewise.
        bend_sign: +1 if bending moves the limb's end forward (elbow), -1 backward (knee).
        side_sign: +1 left, -1 right.

    Returns:
        Flexion, abduction, rotation and bend [rad]; rotation is 0 where the limb is straight.
    """
    sideways = side_sign * limb[1]
    abduction = np.arcsin(min(max(sideways, -1.0), 1.0))
    flexion = np.arctan2(limb[0], -limb[2])
    if flexion < -0.5 * np.pi:
        flexion += 2.0 * np.pi
    # `beyond` in the frame after flexion and abduction: Rx(-abduction) Ry(flexion) applied to it.
    c, s = np.cos(flexion), np.sin(flexion)
    x = c * beyond[0] + s * beyond[2]
    z = -s * beyond[0] + c * beyond[2]
    y = side_sign * beyond[1]
    ca, sa = np.cos(abduction), np.sin(abduction)
    y, z = ca * y + sa * z, -sa * y + ca * z
    bend = np.arccos(min(max(-z, -1.0), 1.0))
    rotation = 0.0
    if np.sin(bend) > STRAIGHT:
        rotation = np.arctan2(-bend_sign * y, bend_sign * x)
    return flexion, abduction, rotation, bend


@njit(cache=True, nogil=True)
def _solve_axes(
    R: NDArray[np.float64],
    chain: NDArray[np.int64],
    offsets: NDArray[np.float64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    angles: NDArray[np.float64],
    T_parent: NDArray[np.float64],
) -> None:
    """Turns the last link of a chain as R says, from and near the angles it has; in place."""
    goals = _new_goals(2)
    last = chain.shape[0] - 1
    _set_goal(goals, 0, last, 0, 1.0, R[:, 0], TURN_WEIGHT)
    _set_goal(goals, 1, last, 2, 1.0, R[:, 2], TURN_WEIGHT)
    _solve(goals, chain, offsets, axis_idx, axis_sign, lower, upper, angles, T_parent)


@njit(cache=True, nogil=True)
def _solve(
    goals: GoalArrays,
    chain: NDArray[np.int64],
    offsets: NDArray[np.float64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    angles: NDArray[np.float64],
    T_parent: NDArray[np.float64],
) -> None:
    n = chain.shape[0]
    rest = np.empty(n)
    low = np.empty(n)
    high = np.empty(n)
    for i in range(n):
        low[i] = lower[chain[i]]
        high[i] = upper[chain[i]]
        rest[i] = min(max(angles[chain[i]], low[i]), high[i])
    weight = np.full(n, REST_WEIGHT)
    theta, _, _ = solve_chain(
        chain, 0, NO_BEND, offsets, axis_idx, axis_sign, low, high, goals, rest, weight, T_parent
    )
    for i in range(n):
        angles[chain[i]] = theta[i]


@njit(cache=True, nogil=True)
def solve_motion(
    motion: MotionArrays,
    trunk: NDArray[np.int64],
    neck: NDArray[np.int64],
    l_arm: NDArray[np.int64],
    r_arm: NDArray[np.int64],
    l_leg: NDArray[np.int64],
    r_leg: NDArray[np.int64],
    offsets: NDArray[np.float64],
    parent_link: NDArray[np.int64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    angles: NDArray[np.float64],
) -> None:
    """Kernel of `retarget`.

    Args:
        motion: The source.
        trunk: Hinges of lumbar and thorax, each on the link of the one before.
        neck: Hinges of neck and head.
        l_arm: Hinges from the shoulder to the wrist.
        r_arm: Likewise.
        l_leg: Hinges from the hip to the ankle.
        r_leg: Likewise.
        offsets: (n_dofs, 3) of any body.
        parent_link: (n_dofs,).
        axis_idx: (n_dofs,).
        axis_sign: (n_dofs,).
        lower: (n_dofs,) [rad].
        upper: (n_dofs,) [rad].
        angles: (n, n_dofs), overwritten but for clavicles and fingers [rad].
    """
    T = np.empty((angles.shape[1] + 1, 4, 4))
    T_root = np.eye(4)
    for f in range(angles.shape[0]):
        own = angles[f]
        flexion, lateral, rotation = _euler(motion.thorax[f])
        own[trunk[0]], own[trunk[3]] = FLEXION_SHARE * flexion, (1.0 - FLEXION_SHARE) * flexion
        own[trunk[1]], own[trunk[4]] = LATERAL_SHARE * lateral, (1.0 - LATERAL_SHARE) * lateral
        own[trunk[2]], own[trunk[5]] = ROTATION_SHARE * rotation, (1.0 - ROTATION_SHARE) * rotation
        _solve_axes(motion.thorax[f], trunk, offsets, axis_idx, axis_sign, lower, upper, own, T_root)
        place_links(offsets, parent_link, axis_idx, axis_sign, own, T_root, T)
        T_thorax = T[parent_link[neck[0]]].copy()
        flexion, lateral, rotation = _euler(T_thorax[:3, :3].T.copy() @ motion.head[f])
        own[neck[0]], own[neck[3]] = 0.6 * flexion, 0.4 * flexion
        own[neck[1]] = lateral
        own[neck[2]], own[neck[4]] = 0.5 * rotation, 0.5 * rotation
        _solve_axes(motion.head[f], neck, offsets, axis_idx, axis_sign, lower, upper, own, T_thorax)
        for side in range(2):
            arm = l_arm if side == 0 else r_arm
            leg = l_leg if side == 0 else r_leg
            place_links(offsets, parent_link, axis_idx, axis_sign, own, T_root, T)
            _solve_arm(
                motion,
                f,
                side,
                arm,
                offsets,
                axis_idx,
                axis_sign,
                lower,
                upper,
                own,
                T[parent_link[arm[0]]].copy(),
            )
            _solve_leg(motion, f, side, leg, offsets, axis_idx, axis_sign, lower, upper, own, T_root)


@njit(cache=True, nogil=True)
def _solve_arm(
    motion: MotionArrays,
    f: int,
    side: int,
    chain: NDArray[np.int64],
    offsets: NDArray[np.float64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    angles: NDArray[np.float64],
    T_parent: NDArray[np.float64],
) -> None:
    """Points upper arm, forearm, fingers and palm."""
    sign = 1.0 - 2.0 * side
    R = T_parent[:3, :3].T.copy()
    start = ball_start(R @ motion.limb[f, side, 0], R @ motion.limb[f, side, 1], 1.0, sign)
    for i in range(4):
        angles[chain[i]] = start[i]
    for i in range(4, 7):
        angles[chain[i]] = 0.0
    goals = _new_goals(4)
    _set_goal(goals, 0, 2, 2, -1.0, motion.limb[f, side, 0], LIMB_WEIGHT)
    _set_goal(goals, 1, 3, 2, -1.0, motion.limb[f, side, 1], LIMB_WEIGHT)
    _set_goal(goals, 2, 6, 2, -1.0, motion.fingers[f, side], HAND_WEIGHT)
    _set_goal(goals, 3, 6, 1, -sign, motion.palm[f, side], HAND_WEIGHT)
    _solve(goals, chain, offsets, axis_idx, axis_sign, lower, upper, angles, T_parent)


@njit(cache=True, nogil=True)
def _solve_leg(
    motion: MotionArrays,
    f: int,
    side: int,
    chain: NDArray[np.int64],
    offsets: NDArray[np.float64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    angles: NDArray[np.float64],
    T_root: NDArray[np.float64],
) -> None:
    """Points thigh, shank, toes and sole."""
    start = ball_start(motion.limb[f, side, 2], motion.limb[f, side, 3], -1.0, 1.0 - 2.0 * side)
    for i in range(4):
        angles[chain[i]] = start[i]
    angles[chain[4]] = 0.0
    angles[chain[5]] = 0.0
    goals = _new_goals(4)
    _set_goal(goals, 0, 2, 2, -1.0, motion.limb[f, side, 2], LIMB_WEIGHT)
    _set_goal(goals, 1, 3, 2, -1.0, motion.limb[f, side, 3], LIMB_WEIGHT)
    _set_goal(goals, 2, 5, 0, 1.0, motion.toes[f, side], TOES_WEIGHT)
    _set_goal(goals, 3, 5, 2, 1.0, motion.sole[f, side], SOLE_WEIGHT)
    _solve(goals, chain, offsets, axis_idx, axis_sign, lower, upper, angles, T_root)
