"""Kernels of the inverse kinematics: one chain of hinges, its goals as arrays."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.rig.kinematics import turn_about

MAX_STEPS = 30
DAMPING = 1e-3
"""First Levenberg-Marquardt damping; goals are of the order of metres."""
SMALL_GAIN = 1e-10
"""Squared cost gain of a step below which the search ends."""
EXTRA_START = -0.7
"""A second start turns the limb about its long axis by this much [rad] when the first ends off its goals."""


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


@njit(cache=True, nogil=True)
def _place_chain(
    chain: NDArray[np.int64],
    offsets: NDArray[np.float64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    theta: NDArray[np.float64],
    T_parent: NDArray[np.float64],
    T_out: NDArray[np.float64],
) -> None:
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
def _goal_vector(
    T: NDArray[np.float64], local: NDArray[np.float64], is_point: float, out: NDArray[np.float64]
) -> None:
    for row in range(3):
        out[row] = T[row, 0] * local[0] + T[row, 1] * local[1] + T[row, 2] * local[2] + is_point * T[row, 3]


@njit(cache=True, nogil=True)
def _cost(
    goals: GoalArrays,
    T: NDArray[np.float64],
    theta: NDArray[np.float64],
    rest: NDArray[np.float64],
    rest_weight: NDArray[np.float64],
) -> float:
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
def _normal_equations(
    goals: GoalArrays,
    T: NDArray[np.float64],
    chain: NDArray[np.int64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    theta: NDArray[np.float64],
    rest: NDArray[np.float64],
    rest_weight: NDArray[np.float64],
    H: NDArray[np.float64],
    g: NDArray[np.float64],
) -> None:
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
def _cholesky_solve(
    H: NDArray[np.float64],
    damping: float,
    is_free: NDArray[np.bool_],
    g: NDArray[np.float64],
    L: NDArray[np.float64],
    step: NDArray[np.float64],
) -> None:
    """Solves (H + damping I) step = -g over the free hinges; the held ones get 0."""
    n = g.shape[0]
    for i in range(n):
        for j in range(i + 1):
            diagonal = 1.0 if i == j else 0.0
            total = H[i, j] + damping * diagonal if is_free[i] and is_free[j] else diagonal
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
def _two_bone_start(
    chain: NDArray[np.int64],
    swing: int,
    bend: int,
    offsets: NDArray[np.float64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    goals: GoalArrays,
    theta: NDArray[np.float64],
    T_parent: NDArray[np.float64],
    T: NDArray[np.float64],
) -> None:
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
    scale = np.sqrt((p @ p) / max(float(t @ t), 1e-12))
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
def _descend(
    chain: NDArray[np.int64],
    offsets: NDArray[np.float64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    goals: GoalArrays,
    rest: NDArray[np.float64],
    rest_weight: NDArray[np.float64],
    theta: NDArray[np.float64],
    T_parent: NDArray[np.float64],
    T: NDArray[np.float64],
) -> float:
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
def solve_chain(
    chain: NDArray[np.int64],
    swing: int,
    bend: int,
    offsets: NDArray[np.float64],
    axis_idx: NDArray[np.int64],
    axis_sign: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    goals: GoalArrays,
    rest: NDArray[np.float64],
    rest_weight: NDArray[np.float64],
    T_parent: NDArray[np.float64],
) -> tuple[NDArray[np.float64], float, float]:
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
