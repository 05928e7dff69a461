"""One candidate a joint that together make the likeliest body: exact max-sum on the kinematic tree."""

import math

import numpy as np
from numba import njit

from forests.skeleton.prior import BodyPrior

MISSING = -1e30
"""The score of a candidate that is not there."""
MOST_DEVIATIONS = 3.0
"""A limb is held to be as wrong as one this many standard deviations off, at most: some candidates are wrong."""
SLACK = 1.04
"""Limbs may be longer than the longest that was seen, and shorter than the shortest, by this factor."""
N_RELAXATIONS = 8
"""Passes over all limbs that share a limb's change between its ends, before the last one moves children alone."""


@njit(cache=True, nogil=True)
def choose_candidates(
    candidates: np.ndarray, score: np.ndarray, prior: BodyPrior, weight: float, choice: np.ndarray
) -> float:
    """Chooses the candidates with the greatest sum of their scores and of the limbs' between them.

    A limb scores `-weight / 2 * min(|t|, MOST_DEVIATIONS)^2`, t its logarithmic length's distance from that of the
    person's size in standard deviations; sizes are tried one after the other. A limb with an end that is nowhere
    scores 0.

    Args:
        candidates: (n_joints, n_candidates, 3) float32 [m]; NaN = nowhere.
        score: (n_joints, n_candidates) float64; MISSING or less = not to be chosen, unless there is no other.
        prior: What bodies are like.
        weight: Of the limbs.
        choice: (n_joints,) int64 to fill.

    Returns:
        The greatest sum.
    """
    n_joints, n = score.shape
    apart = np.zeros((n_joints, n, n), np.float64)
    for joint in range(n_joints):
        if prior.parent[joint] >= 0 and prior.deviation[joint] < np.inf:
            _measure(candidates[joint], candidates[prior.parent[joint]], prior.log_length[joint], apart[joint])
    best_sum = -np.inf
    message, pick = np.empty((n_joints, n), np.float64), np.empty((n_joints, n), np.int64)
    total, tried = np.empty((n_joints, n), np.float64), np.empty(n_joints, np.int64)
    for size in prior.log_size:
        total[:] = score
        for rank in range(n_joints - 1, -1, -1):
            joint = prior.order[rank]
            above = prior.parent[joint]
            if above >= 0:
                _send(
                    total[joint], apart[joint], size, prior.deviation[joint], weight, message[joint], pick[joint]
                )
                total[above] += message[joint]
        found = 0.0
        for rank in range(n_joints):
            joint = prior.order[rank]
            above = prior.parent[joint]
            if above >= 0:
                tried[joint] = pick[joint, tried[above]]
            else:
                tried[joint] = np.argmax(total[joint])
                found += total[joint, tried[joint]]
        if found > best_sum:
            best_sum = found
            choice[:] = tried
    return best_sum


@njit(cache=True, nogil=True)
def _measure(ends: np.ndarray, starts: np.ndarray, log_length: float, out: np.ndarray) -> None:
    """Logarithms of distances over the mean length, (n, n) by end and start; NaN if one is nowhere."""
    for k in range(len(ends)):
        for i in range(len(starts)):
            dx, dy, dz = ends[k, 0] - starts[i, 0], ends[k, 1] - starts[i, 1], ends[k, 2] - starts[i, 2]
            out[k, i] = 0.5 * math.log(max(dx * dx + dy * dy + dz * dz, 1e-4)) - log_length


@njit(cache=True, nogil=True)
def _send(
    total: np.ndarray, apart: np.ndarray, size: float, deviation: float, weight: float, message: np.ndarray,
    pick: np.ndarray,
) -> None:  # fmt: skip
    """The best sum of a joint and all below it, and the candidate that gives it, by its parent's candidate."""
    n = len(total)
    factor, most = 1.0 / deviation, 0.5 * weight * MOST_DEVIATIONS**2
    for i in range(n):
        best, place = -np.inf, 0
        for k in range(n):
            t = (apart[k, i] - size) * factor
            limb = min(0.5 * weight * t * t, most)
            value = total[k] - (limb if limb == limb else 0.0)  # noqa: PLR0124 not NaN
            if value > best:
                best, place = value, k
        message[i], pick[i] = best, place


@njit(cache=True, nogil=True)
def limit_limbs(joints: np.ndarray, trust: np.ndarray, prior: BodyPrior) -> None:
    """Moves joints until every limb is about as long as one that was seen: the less trusted end moves more.

    Args:
        joints: (n_joints, 3) float32 [m], changed; NaN = nowhere.
        trust: (n_joints,) float64 above 0: of two ends the one that is trusted less moves more.
        prior: What bodies are like.
    """
    for step in range(N_RELAXATIONS + 1):
        is_last = step == N_RELAXATIONS
        n_changed = 0
        for joint in prior.order:
            above = prior.parent[joint]
            if above < 0:
                continue
            own = trust[above] / (trust[above] + trust[joint])
            n_changed += _fit(joints[joint], joints[above], prior.length_m[joint], 1.0 if is_last else own)
        if n_changed == 0:
            return


@njit(cache=True, nogil=True)
def _fit(end: np.ndarray, start: np.ndarray, limits: np.ndarray, share: float) -> int:
    """Brings a limb to a possible length, `share` of the way at its end; tells whether it had to be changed."""
    dx, dy, dz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    shortest, longest = limits[0] / SLACK, limits[1] * SLACK
    if not (length < shortest or length > longest):
        return 0
    if length < 1e-6:
        dx, dy, dz, length = 0.0, 1e-6, 0.0, 1e-6
    change = min(max(length, shortest), longest) / length - 1.0
    end[0] += share * change * dx
    end[1] += share * change * dy
    end[2] += share * change * dz
    start[0] -= (1.0 - share) * change * dx
    start[1] -= (1.0 - share) * change * dy
    start[2] -= (1.0 - share) * change * dz
    return 1
