"""A forest's answer about one image made into a skeleton, with probabilities."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numba import njit

from forests.calibration import logistic, probability_of
from forests.estimate import JointEstimate
from forests.skeleton.answers import Answers, edges_of
from forests.skeleton.frame import decode_frame
from forests.skeleton.heading import N_SECTORS, Heading, facing_towards, hypotheses_of
from forests.skeleton.model import OUTCOMES, Decoded, Rules, SkeletonModel, room_for
from forests.skeleton.network import Network
from forests.skeleton.prior import BodyPrior
from forests.skeleton.proposal import propose

LEAST_CONFIDENCE = 1e-6
"""Of a joint that is somewhere."""
LEAST_THOUGHT = 0.05
"""A second heading that is at least this probable gets a skeleton of its own."""
LEAST_PROBABILITY = 0.5
"""A heading that is less probable than this is not known."""


def headings_of(model: SkeletonModel, estimate: JointEstimate, shape: tuple[int, ...]) -> tuple[Heading, Heading]:
    """The two likeliest headings by the proposals of all joints; NaN if the model has no network, or nobody is seen.

    Args:
        model: What is known of skeletons.
        estimate: The forest's answer, joint by joint.
        shape: (height, width) of the image.
    """
    angle, probability = np.full(2, np.nan, np.float32), np.zeros(2, np.float32)
    look(_answers(estimate, shape), model.prior, model.trunk, model.network, angle, probability)
    first, second = (Heading(float(a), float(p)) for a, p in zip(angle, probability, strict=True))
    return first, second


def _answers(estimate: JointEstimate, shape: tuple[int, ...]) -> Answers:
    return Answers(
        estimate.proposals[None],
        estimate.proposal_confidence[None],
        estimate.probability[None],
        estimate.hidden_probability[None],
        estimate.spread[None],
        edges_of(shape, estimate.camera)[None],
        facing_towards(estimate.heading)[None],
        np.array([estimate.body_share], np.float32),
    )


@njit(cache=True, nogil=True)
def look(
    answers: Answers, prior: BodyPrior, trunk: np.ndarray, network: Network, angle: np.ndarray,
    probability: np.ndarray,
) -> None:  # fmt: skip
    """Fills in the two likeliest headings (2,) [rad] of the only frame, and their probabilities (2,)."""
    if len(network.b1) == 0:
        return
    n_joints = len(prior.parent)
    places, scale = np.empty((n_joints, 3), np.float32), np.empty(n_joints, np.float32)
    sectors = np.empty(N_SECTORS, np.float32)
    if propose(network, answers, 0, prior.mirror, trunk, places, scale, sectors) > 0:
        hypotheses_of(sectors, angle, probability)


def decoded_facing(
    model: SkeletonModel, ask: Callable[[float], JointEstimate], shape: tuple[int, ...], n_proposals: int
) -> JointEstimate:
    """The skeleton of the likeliest heading, and beside it that of the second, if that is worth a thought.

    Args:
        model: What is known of skeletons.
        ask: The forest's answer, joint by joint, given a heading [rad], NaN = none.
        shape: (height, width) of the image.
        n_proposals: Proposals given per joint.
    """
    estimate = ask(math.nan)
    headings = headings_of(model, estimate, shape)
    if math.isnan(headings[0].angle):
        return decoded(model, estimate, shape, n_proposals)
    answers: list[JointEstimate] = []
    for angle, probability in headings:
        if probability >= LEAST_THOUGHT or not answers:
            told = replace(ask(angle), heading_probability=probability)
            answers.append(decoded(model, told, shape, n_proposals))
    return replace(answers[0], alternative=answers[1] if len(answers) > 1 else None)


def decoded(
    model: SkeletonModel, estimate: JointEstimate, shape: tuple[int, ...], n_proposals: int
) -> JointEstimate:
    """One skeleton out of the proposals of all joints.

    The skeleton's joints are the first proposals, with their probability of being within 10 cm as confidence; the
    other proposals share what is left of it. A forest whose joints have no probabilities keeps its confidences.
    A heading that votes were weighed by stays the estimate's; else it is what the network says, if that is sure.

    Args:
        model: What is known of skeletons.
        estimate: The forest's answer, joint by joint.
        shape: (height, width) of the image.
        n_proposals: Proposals given per joint.
    """
    n_joints = len(estimate.spread)
    answers = _answers(estimate, shape)
    proposals = np.full((n_joints, n_proposals, 3), np.nan, np.float32)
    confidence = np.zeros((n_joints, n_proposals), np.float32)
    probability = np.empty((len(OUTCOMES), n_joints), np.float32)
    angle, sureness = np.full(2, np.nan, np.float32), np.zeros(2, np.float32)
    out = room_for(n_joints)
    answer_frame(
        answers, model.prior, model.trunk, model.network, model.rules, model.weights, out, proposals, confidence,
        probability, angle, sureness,
    )  # fmt: skip
    person = logistic(model.person_weights[None], out.person[None])[0]
    heading, heading_probability = estimate.heading, estimate.heading_probability
    if math.isnan(heading) and sureness[0] >= LEAST_PROBABILITY:
        heading, heading_probability = float(angle[0]), float(sureness[0])
    within, hidden, outside = probability
    return replace(
        estimate,
        proposals=proposals,
        proposal_confidence=confidence,
        probability=within,
        hidden_probability=hidden,
        outside_probability=outside,
        heading=heading,
        heading_probability=heading_probability,
        person_probability=0.0 if np.isnan(out.person[0]) else float(person),
    )


@njit(cache=True, nogil=True)
def answer_frame(
    answers: Answers, prior: BodyPrior, trunk: np.ndarray, network: Network, rules: Rules, weights: np.ndarray,
    out: Decoded, proposals: np.ndarray, confidence: np.ndarray, probability: np.ndarray, angle: np.ndarray,
    sureness: np.ndarray,
) -> None:  # fmt: skip
    """Decodes the only frame of `answers`: one call, since taking so many arrays apart costs more than decoding.

    Args:
        answers: The forest's.
        prior: What bodies are like.
        trunk: Places of the trunk's joints.
        network: Proposes all joints at once.
        rules: How candidates are weighed.
        weights: (n_outcomes, n_joints, n_terms) float32 of the logistic regressions.
        out: To fill.
        proposals: (n_joints, n_proposals, 3) float32, NaN, to fill.
        confidence: (n_joints, n_proposals) float32, zeros, to fill.
        probability: (n_outcomes, n_joints) float32 to fill; the forest's own where there are no weights.
        angle: (2,) float32 to fill where there is a network: the two likeliest headings [rad].
        sureness: (2,) float32 to fill likewise: their probabilities.
    """
    n_outcomes, n_joints, _ = weights.shape
    decode_frame(answers, 0, prior, trunk, network, rules, out)
    joints, choice, terms = out.joints, out.choice, out.terms
    if len(network.b1) > 0:
        hypotheses_of(out.sectors, angle, sureness)
    for joint in range(n_joints):
        for k in range(n_outcomes):
            probability[k, joint] = probability_of(weights[k, joint], terms[joint])
        if np.isnan(weights[0, joint, 0]):
            probability[0, joint] = answers.within[0, joint]
        elif np.isnan(joints[joint, 0]):
            probability[0, joint] = 0.0
        if np.isnan(weights[1, joint, 0]):
            probability[1, joint] = answers.hidden[0, joint]
    rank_proposals(answers, joints, choice, probability[0], proposals, confidence)


@njit(cache=True, nogil=True)
def rank_proposals(
    answers: Answers, joints: np.ndarray, choice: np.ndarray, within: np.ndarray, proposals: np.ndarray,
    confidence: np.ndarray,
) -> None:  # fmt: skip
    """Puts the skeleton before the forest's other proposals, with confidences that fall.

    Args:
        answers: The forest's, of one frame.
        joints: (n_joints, 3) float32, the skeleton [m]; NaN = nowhere.
        choice: (n_joints,) int64, the proposal that was taken, -1 = none.
        within: (n_joints,) float32, probability of each joint; NaN = not told.
        proposals: (n_joints, n_proposals, 3) float32, NaN, to fill.
        confidence: (n_joints, n_proposals) float32, zeros, to fill.
    """
    n_joints, n = confidence.shape
    for joint in range(n_joints):
        if np.isnan(joints[joint, 0]):
            continue
        given = answers.confidence[0, joint]
        total = given.sum()
        is_told = not np.isnan(within[joint])
        first = max(within[joint] if is_told else total, np.float32(LEAST_CONFIDENCE))
        factor = np.float32((1.0 - within[joint]) / max(total, np.float32(1e-12)) if is_told else 1.0)
        proposals[joint, 0], confidence[joint, 0] = joints[joint], first
        rank = 1
        for k in range(len(given)):
            if rank < n and k != choice[joint] and given[k] > 0.0:
                proposals[joint, rank] = answers.proposals[0, joint, k]
                confidence[joint, rank] = min(first, factor * given[k])
                rank += 1
