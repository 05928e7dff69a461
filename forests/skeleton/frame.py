"""One frame decoded: what the network proposes, what is chosen beside it, limbs brought to possible lengths."""

import math

import numpy as np
from numba import njit

from forests.skeleton.answers import N_CANDIDATES, Answers
from forests.skeleton.decode import MISSING, choose_candidates, limit_limbs
from forests.skeleton.heading import N_SECTORS
from forests.skeleton.model import Decoded, Rules
from forests.skeleton.network import Network
from forests.skeleton.prior import BodyPrior
from forests.skeleton.proposal import propose

FILLED_SHARE = 0.3
"""The place that the network proposes is weighed as a mode with this share of its joint's confidence."""
LEAST_SHARE = 0.02
LEAST_MISS = 0.05
"""Added to the probability that a joint is not near; what is left of a limb's error moves the likelier end less."""
FROM_INSIDE_M = 0.5
"""Joints farther from the image's edge than this are taken as this far [m]."""
_LOGIT_MOST = 5.0


@njit(cache=True, nogil=True)
def decode_frame(
    answers: Answers, at: int, prior: BodyPrior, trunk: np.ndarray, network: Network, rules: Rules,
    out: Decoded,
) -> None:  # fmt: skip
    """Makes one skeleton of a forest's proposals.

    Args:
        answers: The forest's.
        at: Which of them.
        prior: What bodies are like.
        trunk: Places of the trunk's joints.
        network: Proposes all joints at once; one without weights proposes none.
        rules: How candidates are weighed.
        out: Of one frame, to fill.
    """
    joints, choice = out.joints, out.choice
    out.sectors[:] = np.float32(1.0 / N_SECTORS)
    n_joints = len(prior.parent)
    n_modes = min(N_CANDIDATES, answers.proposals.shape[2])
    places, scale = np.full((n_joints, 3), np.nan, np.float32), np.full(n_joints, 0.1, np.float32)
    if len(network.b1) > 0:
        propose(network, answers, at, prior.mirror, trunk, places, scale, out.sectors)
    candidates = np.full((n_joints, n_modes + 1, 3), np.nan, np.float32)
    score = np.full((n_joints, n_modes + 1), MISSING, np.float64)
    candidates[:, :n_modes] = answers.proposals[at, :, :n_modes]
    candidates[:, n_modes] = places
    for joint in range(n_joints):
        _weigh(candidates[joint], answers.confidence[at, joint], places[joint], rules, score[joint])
        score[joint, n_modes] -= rules.trust * _logit(answers.within[at, joint])
    choose_candidates(candidates, score, prior, rules.limb, choice)
    trust = np.empty(n_joints, np.float64)
    for joint in range(n_joints):
        joints[joint] = candidates[joint, choice[joint]]
        within = answers.within[at, joint]
        miss = 0.5 if np.isnan(within) else 1.0 - within
        trust[joint] = 1.0 / (LEAST_MISS + miss) ** 2
    limit_limbs(joints, trust, prior)
    for joint in range(n_joints):
        k = choice[joint]
        confidence = answers.confidence[at, joint]
        is_filled = k == n_modes
        share = FILLED_SHARE if is_filled else _share(confidence, k)
        _describe(
            answers, at, joint, joints[joint], places[joint], scale[joint], share, is_filled, out.terms[joint]
        )
        if is_filled or np.isnan(joints[joint, 0]):
            choice[joint] = -1
    _describe_person(answers, at, scale, out.person)


@njit(cache=True, nogil=True)
def _describe_person(answers: Answers, at: int, scale: np.ndarray, person: np.ndarray) -> None:
    """The terms of the probability that a person is in the image: finite, or all NaN if nothing is proposed."""
    n, within, total, log_scale = 0, 0.0, 0.0, 0.0
    for joint in range(len(scale)):
        log_scale += math.log(scale[joint] / 0.1)
        if not np.isnan(answers.proposals[at, joint, 0, 0]):
            n += 1
            within += _logit(answers.within[at, joint])
            total += answers.confidence[at, joint, 0]
    body_share = answers.body_share[at]
    person[0] = 1.0 if n > 0 else np.nan
    person[1], person[2] = within / max(n, 1), math.log(max(total, 1e-6))
    person[3] = 0.5 if np.isnan(body_share) else body_share
    person[4] = log_scale / len(scale)


@njit(cache=True, nogil=True)
def _share(confidence: np.ndarray, k: int) -> float:
    total = 0.0
    for value in confidence:
        total += value
    return confidence[k] / total if total > 0.0 else 0.0


@njit(cache=True, nogil=True)
def _weigh(
    candidates: np.ndarray, confidence: np.ndarray, place: np.ndarray, rules: Rules, score: np.ndarray
) -> None:
    """Scores of a joint's candidates, the last of which is what the network proposed."""
    last = len(candidates) - 1
    for k in range(last):
        if not np.isnan(candidates[k, 0]):
            score[k] = rules.share * math.log(max(_share(confidence, k), LEAST_SHARE))
            if not np.isnan(place[0]):
                score[k] -= rules.gap * _distance(candidates[k], place) / rules.reach_m
    if not np.isnan(place[0]):
        score[last] = rules.share * math.log(FILLED_SHARE) - rules.gap


@njit(cache=True, nogil=True)
def _distance(one: np.ndarray, other: np.ndarray) -> float:
    dx, dy, dz = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@njit(cache=True, nogil=True)
def _describe(
    answers: Answers, at: int, joint: int, place: np.ndarray, proposed: np.ndarray, scale: float, share: float,
    is_filled: bool, terms: np.ndarray,
) -> None:  # fmt: skip
    """The terms of one decoded joint's probabilities; all finite."""
    terms[0] = 1.0
    terms[1], terms[2] = _logit(answers.within[at, joint]), _logit(answers.hidden[at, joint])
    terms[3] = 1.0 if is_filled else 0.0
    gap = _distance(place, proposed)
    terms[4] = 0.0 if np.isnan(gap) else min(gap, 1.0)
    terms[5], terms[6] = math.log(scale / 0.1), share
    edges = answers.edges[at]
    inside = 0.0
    if place[2] > 0.0:
        x, y = place[0] / place[2], place[1] / place[2]
        inside = min(x - edges[0], y - edges[1], edges[2] - x, edges[3] - y) * place[2]
    terms[7] = min(max(inside, -FROM_INSIDE_M), FROM_INSIDE_M)


@njit(cache=True, nogil=True)
def _logit(p: float) -> float:
    if np.isnan(p):
        return 0.0
    p = min(max(p, 1e-3), 1.0 - 1e-3)
    return min(max(math.log(p / (1.0 - p)), -_LOGIT_MOST), _LOGIT_MOST)
