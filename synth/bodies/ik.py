"""Inverse kinematics of an arm or a leg within joint limits.

A two-bone closed form bends and swings the limb to the first goal; Levenberg-Marquardt steps with the hinges at
their limits held (a projected Gauss-Newton method, Nocedal & Wright 2006, chapters 10 and 16.7) do the rest.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from synth.bodies.kinematics import AXIS_IDX, AXIS_SIGN, turn_about
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, PARENT_LINK, UPPER, Skeleton

MAX_STEPS = 30
DAMPING = 1e-3
"""First Levenberg-Marquardt damping; goals are of the order of metres."""
SMALL_GAIN = 1e-10
"""Squared cost gain of a step below which the search ends."""
EXTRA_START = -0.7
"""A second start turns the limb about its long axis by this much [rad] when the first ends off its goals."""


class Chain(NamedTuple):
    """Hinges of one limb from the trunk outwards.

    Attributes:
        dof: (n,) hinge indices, each on the link that the one before moves.
        swing: Position in `dof` of the flexion hinge of the ball joint at the limb's root; abduction follows it.
        bend: Position in `dof` of the elbow or knee.
    """

    dof: NDArray[np.int64]
    swing: int
    bend: int


_ARM = (
    "clavicle_elevation", "clavicle_protraction", "shoulder_flexion", "shoulder_abduction", "shoulder_rotation",
    "elbow_flexion", "forearm_pronation", "wrist_flexion", "wrist_deviation",
)  # fmt: skip
_LEG = ("hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "ankle_flexion", "ankle_inversion")


def _chain(side: str, names: tuple[str, ...], swing: int, bend: int) -> Chain:
    return Chain(np.array([DOF_IDX[f"{side}_{name}"] for name in names], dtype=np.int64), swing, bend)


CHAINS: dict[str, Chain] = {
    "l_arm": _chain("l", _ARM, 2, 5),
    "r_arm": _chain("r", _ARM, 2, 5),
    "l_leg": _chain("l", _LEG, 0, 3),
    "r_leg": _chain("r", _LEG, 0, 3),
}
"""The limbs that can be solved."""


@dataclass(frozen=True)
class Goal:
    """What a point fixed to a link, or an axis of it, should become.

    Attributes:
        link: Name of the hinge that moves the link, without side, such as "wrist_deviation".
        local: (3,) point [m] or unit axis in the link's frame.
        target: (3,) world point [m] or unit direction.
        weight: One number, or one a world axis; 0 leaves that coordinate free. A direction is as strong as a
            point when its weight is about 0.1 (0.1 m a radian).
        is_point: A point if true, else a direction.
    """

    link: str
    local: ArrayLike
    target: ArrayLike
    weight: float | tuple[float, float, float] = 1.0
    is_point: bool = True


class GoalArrays(NamedTuple):
    """Goals as the kernel takes them.

    Attributes:
        position: (m,) place of the goal's link in the chain.
        local: (m, 3).
        target: (m, 3).
        weight: (m, 3).
        is_point: (m,) 1.0 or 0.0.
    """

    position: NDArray[np.int64]
    local: NDArray[np.float64]
    target: NDArray[np.float64]
    weight: NDArray[np.float64]
    is_point: NDArray[np.float64]


@dataclass(frozen=True)
class Solution:
    """Outcome of one solve.

    Attributes:
        angles: (n_dofs,) all hinges; only the chain's differ from the given ones.
        point_error: Largest weighted distance of a point goal [m].
        axis_error: Largest angle of a direction goal whose coordinates all count [rad].
    """

    angles: NDArray[np.float64]
    point_error: float
    axis_error: float


@njit(cache=True, nogil=True)
def _place_chain(chain, offsets, axis_idx, axis_sign, theta, T_parent, T_out):  # type: ignore[no-untyped-def]
    """Places the chain's links; T_out is (n, 4, 4)."""
    for i in range(chain.shape[0]):
        dof = chain[i]
        before = T_parent if i == 0 else T_out[i - 1]
        T = T_out[i]
        for row in range(3):
            moved = before[row, 3]
            for k in range(3):
                T[row, k] = before[row, k]
                moved += before[row, k] * offsets[dof, k]
            T[row, 3] = moved
        turn_about(T, axis_idx[dof], axis_sign[dof] * theta[i])


@njit(cache=True, nogil=True)
def _goal_vector(T, local, is_point, out):  # type: ignore[no-untyped-def]
    for row in range(3):
        out[row] = T[row, 0] * local[0] + T[row, 1] * local[1] + T[row, 2] * local[2] + is_point * T[row, 3]


@njit(cache=True, nogil=True)
def _cost(goals, T, theta, rest, rest_weight):  # type: ignore[no-untyped-def]
    total = 0.0
    now = np.empty(3)
    for m in range(goals.position.shape[0]):
        _goal_vector(T[goals.position[m]], goals.local[m], goals.is_point[m], now)
        for row in range(3):
            total += (goals.weight[m, row] * (now[row] - goals.target[m, row])) ** 2
    for i in range(theta.shape[0]):
        total += (rest_weight[i] * (theta[i] - rest[i])) ** 2
    return total


@njit(cache=True, nogil=True)
def _normal_equations(goals, T, chain, axis_idx, axis_sign, theta, rest, rest_weight, H, g):  # type: ignore[no-untyped-def]
    """Fills H = J^T W^2 J and g = J^T W^2 e, rest pull included."""
    n = theta.shape[0]
    H[:] = 0.0
    for i in range(n):
        H[i, i] = rest_weight[i] ** 2
        g[i] = rest_weight[i] ** 2 * (theta[i] - rest[i])
    now = np.empty(3)
    J = np.zeros((3, n))
    for m in range(goals.position.shape[0]):
        last = goals.position[m]
        _goal_vector(T[last], goals.local[m], goals.is_point[m], now)
        for i in range(last + 1):
            sign = axis_sign[chain[i]]
            k = axis_idx[chain[i]]
            ax, ay, az = sign * T[i, 0, k], sign * T[i, 1, k], sign * T[i, 2, k]
            pivot = goals.is_point[m]
            rx = now[0] - pivot * T[i, 0, 3]
            ry = now[1] - pivot * T[i, 1, 3]
            rz = now[2] - pivot * T[i, 2, 3]
            J[0, i] = ay * rz - az * ry
            J[1, i] = az * rx - ax * rz
            J[2, i] = ax * ry - ay * rx
        for row in range(3):
            w2 = goals.weight[m, row] ** 2
            if w2 == 0.0:
                continue
            error = now[row] - goals.target[m, row]
            for i in range(last + 1):
                wj = w2 * J[row, i]
                g[i] += wj * error
                for j in range(i + 1):
                    H[i, j] += wj * J[row, j]


@njit(cache=True, nogil=True)
def _cholesky_solve(H, damping, is_free, g, L, step):  # type: ignore[no-untyped-def]
    """Solves (H + damping I) step = -g over the free hinges; the held ones get 0."""
    n = g.shape[0]
    for i in range(n):
        for j in range(i + 1):
            if is_free[i] and is_free[j]:
                total = H[i, j] + (damping if i == j else 0.0)
            else:
                total = 1.0 if i == j else 0.0
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = np.sqrt(max(total, 1e-12)) if i == j else total / L[j, j]
    for i in range(n):
        total = -g[i] if is_free[i] else 0.0
        for k in range(i):
            total -= L[i, k] * step[k]
        step[i] = total / L[i, i]
    for i in range(n - 1, -1, -1):
        total = step[i]
        for k in range(i + 1, n):
            total -= L[k, i] * step[k]
        step[i] = total / L[i, i]


@njit(cache=True, nogil=True)
def _two_bone_start(chain, swing, bend, offsets, axis_idx, axis_sign, lower, upper, goals, theta, T_parent, T):  # type: ignore[no-untyped-def]
    """Bends the elbow or knee to the goal's distance, then swings the ball joint so that goal 0 is met."""
    _place_chain(chain, offsets, axis_idx, axis_sign, theta, T_parent, T)
    end = np.empty(3)
    _goal_vector(T[goals.position[0]], goals.local[0], 1.0, end)
    reach2 = 0.0
    near2 = 0.0
    far2 = 0.0
    for k in range(3):
        reach2 += (goals.target[0, k] - T[swing, k, 3]) ** 2
        near2 += (T[bend, k, 3] - T[swing, k, 3]) ** 2
        far2 += (end[k] - T[bend, k, 3]) ** 2
    cosine = (near2 + far2 - reach2) / (2.0 * np.sqrt(near2 * far2))
    theta[bend] = np.pi - np.arccos(min(max(cosine, -1.0), 1.0))
    theta[bend] = min(max(theta[bend], lower[bend]), upper[bend])
    theta[swing] = 0.0
    theta[swing + 1] = 0.0
    _place_chain(chain, offsets, axis_idx, axis_sign, theta, T_parent, T)
    _goal_vector(T[goals.position[0]], goals.local[0], 1.0, end)
    # In the frame before the swing: p is where the point hangs, t where it should be. Ry(a) Rx(b) p = t.
    p = np.zeros(3)
    t = np.zeros(3)
    for k in range(3):
        for row in range(3):
            p[k] += T[swing, row, k] * (end[row] - T[swing, row, 3])
            t[k] += T[swing, row, k] * (goals.target[0, row] - T[swing, row, 3])
    scale = np.sqrt((p @ p) / max(t @ t, 1e-12))
    t *= scale
    across = np.sqrt(p[1] ** 2 + p[2] ** 2)
    about = np.arccos(min(max(t[1] / max(across, 1e-9), -1.0), 1.0))
    offset = np.arctan2(p[2], p[1])
    best = 1e9
    b_best = 0.0
    for sense in (-1.0, 1.0):
        b = sense * about - offset
        b = (b + np.pi) % (2.0 * np.pi) - np.pi
        if abs(b) < best:
            best = abs(b)
            b_best = b
    z = p[1] * np.sin(b_best) + p[2] * np.cos(b_best)
    a = np.arctan2(t[0], t[2]) - np.arctan2(p[0], z)
    a = (a + np.pi) % (2.0 * np.pi) - np.pi
    flexion = axis_sign[chain[swing]] * a
    if flexion < -0.5 * np.pi:
        flexion += 2.0 * np.pi
    theta[swing] = min(max(flexion, lower[swing]), upper[swing])
    abduction = axis_sign[chain[swing + 1]] * b_best
    theta[swing + 1] = min(max(abduction, lower[swing + 1]), upper[swing + 1])


@njit(cache=True, nogil=True)
def _descend(chain, offsets, axis_idx, axis_sign, lower, upper, goals, rest, rest_weight, theta, T_parent, T):  # type: ignore[no-untyped-def]
    """Levenberg-Marquardt within limits, in place on theta; T is (n, 4, 4) scratch. Returns the cost."""
    n = theta.shape[0]
    H = np.empty((n, n))
    L = np.zeros((n, n))
    g = np.empty(n)
    step = np.empty(n)
    trial = np.empty(n)
    is_free = np.ones(n, dtype=np.bool_)
    damping = DAMPING
    _place_chain(chain, offsets, axis_idx, axis_sign, theta, T_parent, T)
    cost = _cost(goals, T, theta, rest, rest_weight)
    _normal_equations(goals, T, chain, axis_idx, axis_sign, theta, rest, rest_weight, H, g)
    for _ in range(MAX_STEPS):
        for i in range(n):
            is_free[i] = not ((theta[i] <= lower[i] and g[i] > 0.0) or (theta[i] >= upper[i] and g[i] < 0.0))
        _cholesky_solve(H, damping, is_free, g, L, step)
        for i in range(n):
            trial[i] = min(max(theta[i] + step[i], lower[i]), upper[i])
        _place_chain(chain, offsets, axis_idx, axis_sign, trial, T_parent, T)
        trial_cost = _cost(goals, T, trial, rest, rest_weight)
        if trial_cost < cost:
            gain = cost - trial_cost
            cost = trial_cost
            theta[:] = trial
            damping = max(damping * 0.2, 1e-9)
            if gain < SMALL_GAIN:
                break
            _normal_equations(goals, T, chain, axis_idx, axis_sign, theta, rest, rest_weight, H, g)
        else:
            damping *= 6.0
            if damping > 1e4:
                break
    return cost


@njit(cache=True, nogil=True)
def _solve(chain, swing, bend, offsets, axis_idx, axis_sign, lower, upper, goals, rest, rest_weight, T_parent):  # type: ignore[no-untyped-def]
    """Best of up to two starts; returns theta and the two errors of `Solution`."""
    n = chain.shape[0]
    T = np.empty((n, 4, 4))
    theta = rest.copy()
    if goals.is_point[0] > 0.0 and goals.position[0] > bend:
        _two_bone_start(chain, swing, bend, offsets, axis_idx, axis_sign, lower, upper, goals, theta, T_parent, T)
    cost = _descend(
        chain, offsets, axis_idx, axis_sign, lower, upper, goals, rest, rest_weight, theta, T_parent, T
    )
    if cost > 1e-3:
        other = rest.copy()
        other[swing + 2] = min(max(other[swing + 2] + EXTRA_START, lower[swing + 2]), upper[swing + 2])
        other_cost = _descend(
            chain, offsets, axis_idx, axis_sign, lower, upper, goals, rest, rest_weight, other, T_parent, T
        )
        if other_cost < cost:
            theta[:] = other
    _place_chain(chain, offsets, axis_idx, axis_sign, theta, T_parent, T)
    point_error = 0.0
    axis_error = 0.0
    now = np.empty(3)
    for m in range(goals.position.shape[0]):
        _goal_vector(T[goals.position[m]], goals.local[m], goals.is_point[m], now)
        if goals.is_point[m] > 0.0:
            error = 0.0
            for row in range(3):
                error += (min(goals.weight[m, row], 1.0) * (now[row] - goals.target[m, row])) ** 2
            point_error = max(point_error, np.sqrt(error))
        elif min(goals.weight[m, 0], goals.weight[m, 1], goals.weight[m, 2]) > 0.0:
            dot = now[0] * goals.target[m, 0] + now[1] * goals.target[m, 1] + now[2] * goals.target[m, 2]
            axis_error = max(axis_error, np.arccos(min(max(dot, -1.0), 1.0)))
    return theta, point_error, axis_error


def solve_limb(
    skeleton: Skeleton,
    limb: str,
    T_world_link: NDArray[np.float64],
    angles: NDArray[np.float64],
    goals: list[Goal],
    rest_weight: float | NDArray[np.float64] = 0.01,
) -> Solution:
    """Moves one limb to its goals, as near to the given angles as the goals allow.

    Args:
        skeleton: The person's hinges.
        limb: Name in `CHAINS`.
        T_world_link: (n_links, 4, 4) from `link_transforms`; only the link that carries the limb is read.
        angles: (n_dofs,) all hinges; the limb's own are the rest pose [rad].
        goals: At least one; the closed-form start uses the first if it is a point.
        rest_weight: Pull towards the rest pose [m/rad], one number or one a hinge of the chain.
    """
    if limb not in CHAINS:
        raise ValueError(f"limb {limb!r} is unknown; known are {', '.join(CHAINS)}")
    chain = CHAINS[limb]
    rest = np.clip(angles[chain.dof], LOWER[chain.dof], UPPER[chain.dof])
    theta, point_error, axis_error = _solve(
        chain.dof,
        chain.swing,
        chain.bend,
        skeleton.offsets,
        AXIS_IDX,
        AXIS_SIGN,
        LOWER[chain.dof],
        UPPER[chain.dof],
        _goal_arrays(limb, chain, goals),
        rest,
        np.full(len(rest), rest_weight) if np.isscalar(rest_weight) else np.asarray(rest_weight, np.float64),
        np.ascontiguousarray(T_world_link[PARENT_LINK[chain.dof[0]]]),
    )
    out = angles.copy()
    out[chain.dof] = theta
    return Solution(out, float(point_error), float(axis_error))


def _goal_arrays(limb: str, chain: Chain, goals: list[Goal]) -> GoalArrays:
    n = len(goals)
    out = GoalArrays(np.empty(n, np.int64), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty(n))
    place = _PLACES[limb]
    for m, goal in enumerate(goals):
        if goal.link not in place:
            raise ValueError(f"link {goal.link!r} is not on {limb}; known are {', '.join(place)}")
        out.position[m] = place[goal.link]
        out.local[m] = goal.local
        out.target[m] = goal.target
        out.weight[m] = goal.weight
        out.is_point[m] = goal.is_point
    return out


_PLACES: dict[str, dict[str, int]] = {
    limb: {name: i for i, name in enumerate(_ARM if limb.endswith("arm") else _LEG)} for limb in CHAINS
}
HAND_LINK: dict[str, int] = {side: LINK_IDX[f"{side}_wrist_deviation"] for side in "lr"}
"""Index of the link of each palm."""
FOOT_LINK: dict[str, int] = {side: LINK_IDX[f"{side}_ankle_inversion"] for side in "lr"}
"""Index of the link of each foot."""
