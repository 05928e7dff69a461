"""Learns what makes skeletons out of a kind of forest's proposals: from its answers on frames that are new to it."""

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.calibration import WITHIN_M, fit_logistic, fit_logistic_alike
from forests.frames import FrameSequence, FrameSubset, is_known
from forests.skeleton.answers import Answers, Truth, View, joined
from forests.skeleton.decoded import look
from forests.skeleton.features import trunk_of
from forests.skeleton.folds import Answering, answers_across
from forests.skeleton.frame import decode_frame
from forests.skeleton.heading import facings_of
from forests.skeleton.model import OUTCOMES, PERSON_TERMS, TERMS, Decoded, Rules, SkeletonModel, room_for
from forests.skeleton.network import Network, no_network
from forests.skeleton.prior import BodyPrior, measure_bodies
from forests.skeleton.proposal import train_proposal

MODES_ALONE = Rules(share=1.0, trust=0.0, limb=0.1, gap=0.0, reach_m=1.0)
"""Rules where there is no network."""
BESIDE_NETWORK = Rules(share=0.5, trust=0.15, limb=0.03, gap=1.0, reach_m=0.3)
"""Rules where there is one, but for those that are tried."""
TRUSTS, REACHES_M = (0.0, 0.15, 0.3), (0.15, 0.2, 0.3, 0.4)


def learn_from_frames(
    names: tuple[str, ...],
    frames: FrameSequence,
    validation: FrameSequence | None,
    train_apart: Callable[[FrameSubset, int], Answering | None],
    answers: Answering,
    reads_headings: bool,
    n_ways: int,
    seed: int,
) -> SkeletonModel:
    """Learns what makes skeletons of a forest's proposals.

    Args:
        names: Of the joints that the forest answers.
        frames: Its training frames.
        validation: Frames that are new to it; None = rules and probabilities are not learned.
        train_apart: Trains on a part of the frames, see `forests.skeleton.folds.answers_across`.
        answers: The forest's own answers on frames.
        reads_headings: Whether its votes are weighed by headings.
        n_ways: In how many ways the training frames are halved, 1 or 2.
        seed: Of the network.
    """
    across = answers_across(frames, train_apart, reads_headings, n_ways)
    places = [frames.labels.joints.index(name) for name in names]
    bodies = across[1].joints if across else np.stack([frames[k].joints[places] for k in range(len(frames))])
    model = learn_proposals(names, bodies, across, seed)
    if validation is None or not len(validation):
        return model
    shown = []
    for view in (View(), View(is_cut=True), View(is_deserted=True)):
        seen = answers(validation, view)
        if across and reads_headings:
            seen = answers(validation, view._replace(headings=headings_of_all(model, seen[0])))
        shown.append(seen)
    return settled(model, *shown)


def learn_proposals(
    names: tuple[str, ...],
    bodies: NDArray[np.float32],
    training: tuple[Answers, Truth] | None,
    seed: int,
) -> SkeletonModel:
    """Learns bodies and, if there are answers to learn from, proposals.

    Args:
        names: Of the joints.
        bodies: (n, n_joints, 3) float32, joints of training frames [m]; NaN = unknown.
        training: Answers and truths that the network learns from; None = no network.
        seed: Of the network.
    """
    prior, trunk = measure_bodies(bodies, names), trunk_of(names)
    network, rules = no_network(), MODES_ALONE
    if training is not None:
        answers, truth = training
        facings = facings_of(truth.joints, names)
        network = train_proposal(answers, truth.joints, facings, prior.mirror, trunk, seed)
        rules = BESIDE_NETWORK
    nothing = np.full((len(OUTCOMES), len(names), len(TERMS)), np.nan, np.float32)
    return SkeletonModel(prior, trunk, network, rules, nothing, np.full(len(PERSON_TERMS), np.nan, np.float32))


def settled(
    model: SkeletonModel,
    validation: tuple[Answers, Truth],
    cut: tuple[Answers, Truth],
    deserted: tuple[Answers, Truth] | None = None,
) -> SkeletonModel:
    """Chooses the rules and fits the probabilities.

    Args:
        model: Bodies and proposals.
        validation: Answers and truths of frames that are new to the forest and to the network.
        cut: The same of images that end on the person: probabilities are to hold there as well.
        deserted: The same of images without the person, for the probability that there is one; None = no such.
    """
    if len(model.network.b1):
        model = replace(model, rules=_best_rules(model, *validation))
    if deserted is not None:
        model = replace(model, person_weights=_person_weights(model, [validation[0], cut[0]], deserted[0]))
    return replace(model, weights=_calibrated(model, *joined([validation, cut])))


def decode_all(model: SkeletonModel, answers: Answers) -> Decoded:
    """Skeletons of many frames."""
    out = room_for(*answers.within.shape)
    _decode_frames(answers, model.prior, model.trunk, model.network, model.rules, out)
    return out


def headings_of_all(model: SkeletonModel, answers: Answers) -> NDArray[np.float32]:
    """(n,) float32: the likeliest heading of every frame [rad]; NaN where nobody is seen."""
    angle, probability = np.full((2, len(answers.within), 2), np.nan, np.float32)
    for k in range(len(angle)):
        one = Answers(*(values[k : k + 1] for values in answers))
        look(one, model.prior, model.trunk, model.network, angle[k], probability[k])
    return np.asarray(angle[:, 0])


@njit(cache=True, nogil=True)
def _decode_frames(
    answers: Answers, prior: BodyPrior, trunk: np.ndarray, network: Network, rules: Rules, out: Decoded
) -> None:
    for i in range(len(out.joints)):
        one = Decoded(out.joints[i], out.choice[i], out.terms[i], out.sectors[i], out.person[i])
        decode_frame(answers, i, prior, trunk, network, rules, one)


def _best_rules(model: SkeletonModel, answers: Answers, truth: Truth) -> Rules:
    """The rules that find the most joints; a joint's score falls from 1 at 5 cm of error to 0 at 15 cm."""
    best, most = model.rules, -1.0
    for trust, reach_m in itertools.product(TRUSTS, REACHES_M):
        rules = BESIDE_NETWORK._replace(trust=trust, reach_m=reach_m)
        joints = decode_all(replace(model, rules=rules), answers).joints
        error = np.linalg.norm(joints - truth.joints, axis=2)[is_known(truth.joints)]
        score = float(np.clip(1.5 - np.nan_to_num(error, nan=np.inf) / WITHIN_M, 0.0, 1.0).sum())
        if score > most:
            best, most = rules, score
    return best


def _calibrated(model: SkeletonModel, answers: Answers, truth: Truth) -> NDArray[np.float32]:
    """(n_outcomes, n_joints, n_terms) float32, the weights that tell how probable each outcome is."""
    joints, _, terms, _, _ = decode_all(model, answers)
    can_learn = is_known(truth.joints) & is_known(joints)
    outcomes = (
        np.linalg.norm(joints - truth.joints, axis=2) <= WITHIN_M,  # NaN is not within
        truth.is_hidden,
        is_outside(truth.joints, answers.edges),
    )
    if not can_learn.any():
        return np.full_like(model.weights, np.nan)
    weights = [fit_logistic_alike(terms, outcome, can_learn) for outcome in outcomes]
    return np.stack(weights).astype(np.float32)


def _person_weights(model: SkeletonModel, peopled: list[Answers], deserted: Answers) -> NDArray[np.float32]:
    """(n_person_terms,) float32, the weights that tell how probable a person is; NaN if no image is deserted."""
    terms = [decode_all(model, answers).person for answers in (*peopled, deserted)]
    terms = [rows[np.isfinite(rows).all(axis=1)] for rows in terms]
    if not len(terms[-1]):
        return np.full(len(PERSON_TERMS), np.nan, np.float32)
    is_person = np.arange(sum(map(len, terms))) < sum(map(len, terms[:-1]))
    return fit_logistic(np.concatenate(terms), is_person).astype(np.float32)


def is_outside(joints: NDArray[np.float32], edges: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(n, n_joints) bool: which joints (n, n_joints, 3) [m] are not in images with these edges (n, 4)."""
    ahead = joints[..., 2] > 0
    x, y = (joints[..., k] / np.where(ahead, joints[..., 2], 1.0) for k in (0, 1))
    left, top, right, bottom = edges.T[:, :, None]
    return np.asarray(~ahead | (x < left) | (x > right) | (y < top) | (y > bottom))
