"""Kernels of the retargeting: closed forms for ball joints, then the limbs' least squares within limits."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.mocap.ball_joint import STRAIGHT, ball_miss, ball_start, other_start
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
BARELY_BENT = 0.02
"""Sine of a bend that tells the limb's twist where a first solution missed."""
MISSED = 0.05
"""A limb farther off than this is solved from other starts, too [rad]."""
N_STARTS = 3
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
    goals = _new_goals(4)
    _set_goal(goals, 0, 2, 2, -1.0, motion.limb[f, side, 0], LIMB_WEIGHT)
    _set_goal(goals, 1, 3, 2, -1.0, motion.limb[f, side, 1], LIMB_WEIGHT)
    _set_goal(goals, 2, 6, 2, -1.0, motion.fingers[f, side], HAND_WEIGHT)
    _set_goal(goals, 3, 6, 1, -sign, motion.palm[f, side], HAND_WEIGHT)
    R = T_parent[:3, :3].T.copy()
    limb, beyond = R @ motion.limb[f, side, 0], R @ motion.limb[f, side, 1]
    _solve_limb(
        goals, limb, beyond, 1.0, sign, chain, offsets, axis_idx, axis_sign, lower, upper, angles, T_parent
    )


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
    goals = _new_goals(4)
    _set_goal(goals, 0, 2, 2, -1.0, motion.limb[f, side, 2], LIMB_WEIGHT)
    _set_goal(goals, 1, 3, 2, -1.0, motion.limb[f, side, 3], LIMB_WEIGHT)
    _set_goal(goals, 2, 5, 0, 1.0, motion.toes[f, side], TOES_WEIGHT)
    _set_goal(goals, 3, 5, 2, 1.0, motion.sole[f, side], SOLE_WEIGHT)
    limb, beyond = motion.limb[f, side, 2], motion.limb[f, side, 3]
    sign = 1.0 - 2.0 * side
    _solve_limb(goals, limb, beyond, -1.0, sign, chain, offsets, axis_idx, axis_sign, lower, upper, angles, T_root)


@njit(cache=True, nogil=True)
def _solve_limb(
    goals: GoalArrays,
    limb: NDArray[np.float64],
    beyond: NDArray[np.float64],
    bend_sign: float,
    side_sign: float,
    chain: NDArray[np.int64],
    offsets: NDArray[np.float64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    angles: NDArray[np.float64],
    T_parent: NDArray[np.float64],
) -> None:
    """Solves an arm or leg from its closed form; where that misses, from the closed form's other angles, too."""
    best = np.inf
    kept = np.zeros(chain.shape[0])
    for k in range(N_STARTS):
        start = ball_start(limb, beyond, bend_sign, side_sign, STRAIGHT if k == 0 else BARELY_BENT)
        if k == 2:
            start = other_start(start)
        for i in range(chain.shape[0]):
            angles[chain[i]] = start[i] if i < 4 else 0.0
        _solve(goals, chain, offsets, axis_idx, axis_sign, lower, upper, angles, T_parent)
        solved = (angles[chain[0]], angles[chain[1]], angles[chain[2]], angles[chain[3]])
        miss = ball_miss(solved, limb, beyond, bend_sign, side_sign)
        if miss < best:
            best = miss
            for i in range(chain.shape[0]):
                kept[i] = angles[chain[i]]
        if best < MISSED:
            break
    for i in range(chain.shape[0]):
        angles[chain[i]] = kept[i]
