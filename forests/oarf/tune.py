"""Learned on validation frames: how far votes may come from, how wide the kernel is, when to trust."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from forests.calibration import WITHIN_M, fit_logistic
from forests.frames import DepthFrame, FrameSequence, in_order, is_known
from forests.oarf.evidence import TERMS, terms
from forests.oarf.model import OARFModel, Tuning
from forests.oarf.peaks import find_peaks
from forests.oarf.predict import Predictor
from forests.oarf.vote import VoteTable, cast, shortened

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

MAX_OFFSETS_M = (0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, np.inf)
"""lambda_j that are tried [m]."""
BANDWIDTHS_M = (0.03, 0.045, 0.06, 0.08, 0.1, 0.13)
"""b_j that are tried [m]."""
DEFAULT_BANDWIDTH_M = 0.08
"""b_j of a forest that was not tuned [m]."""


def untuned(n_joints: int) -> Tuning:
    """Every leaf vote counts, one bandwidth for all joints, no calibrated probabilities."""
    nothing = np.full((n_joints, len(TERMS)), np.nan, np.float32)
    return Tuning(
        np.full(n_joints, np.inf, np.float32),
        np.full(n_joints, DEFAULT_BANDWIDTH_M, np.float32),
        nothing,
        nothing.copy(),
    )


def tune(model: OARFModel, frames: FrameSequence, n_threads: int = 1) -> OARFModel:
    """Learns lambda_j, b_j and the probabilities of a forest on frames that it was not trained on.

    lambda_j and b_j are the pair with the highest mean score of the first proposals, where a joint's score falls
    from 1 at 5 cm of error over one half at 10 cm to 0 at 15 cm: a share within 10 cm that does not jump. The
    probabilities are then fitted on the same frames with that pair; two numbers a joint have been chosen by them
    before, so they are a little too bold.

    A joint is tuned on the frames that know it. One that none of them knows, or that the forest does not vote for,
    stays untuned and without probabilities.

    Args:
        model: A forest, tuned or not.
        frames: Validation frames.
        n_threads: Threads; the result does not depend on it.

    Raises:
        ValueError: No frames, or frames with other joints than the forest's.
    """
    if len(frames) == 0:
        raise ValueError("there are no frames to tune on")
    if frames.labels.joints != model.labels.joints:
        raise ValueError(f"the frames' joints {frames.labels.joints} are not the forest's {model.labels.joints}")
    untied = replace(model, tuning=untuned(model.labels.n_joints))
    tuning = _with_best_pairs(Predictor(untied), frames, n_threads)
    return calibrated(replace(model, tuning=tuning), frames, n_threads)


def calibrated(model: OARFModel, frames: FrameSequence, n_threads: int = 1) -> OARFModel:
    """Fits a forest's probabilities, "within 10 cm" and "hidden by an object", on the frames that know a joint.

    Args:
        model: A forest whose lambda_j and b_j are settled.
        frames: Frames that it was not trained on.
        n_threads: Threads; the result does not depend on it.
    """
    predictor = Predictor(model)

    def look(frame: DepthFrame) -> tuple[NDArray[Any], ...]:
        proposals, evidence = predictor.given(frame.hints).examine(frame.depth, frame.camera)
        error = np.linalg.norm(proposals[:, 0] - frame.joints, axis=1)
        return terms(evidence), error <= WITHIN_M, frame.is_occluded, is_known(frame.joints)  # NaN is not within

    seen = list(_of_frames(look, frames, n_threads))
    values, is_within, is_hidden, has_truth = (np.stack(column, axis=1) for column in zip(*seen, strict=True))
    within, hidden = np.full((2, *values.shape[::2]), np.nan, np.float32)
    for joint in np.flatnonzero(has_truth.any(axis=1) & _has_votes(model)):
        rows = has_truth[joint]
        within[joint] = fit_logistic(values[joint, rows], is_within[joint, rows])
        hidden[joint] = fit_logistic(values[joint, rows], is_hidden[joint, rows])
    return replace(model, tuning=replace(model.tuning, within_weights=within, hidden_weights=hidden))


def _has_votes(model: OARFModel) -> NDArray[np.bool_]:
    """(n_joints,) bool, which joints any leaf votes for."""
    return np.any([tree.leaves.voted_joints() for tree in model.trees], axis=0)


class _Voted(NamedTuple):
    """What is kept of a validation frame: leaves (n_trees, n) and points (n, 3) of its voters, and its joints."""

    leaves: NDArray[np.int32]
    points: NDArray[np.float32]
    joints: NDArray[np.float32]


def _with_best_pairs(predictor: Predictor, frames: FrameSequence, n_threads: int) -> Tuning:
    """The forest's tuning with the lambda_j and b_j of the highest mean score, of the joints that have one."""

    def reach(frame: DepthFrame) -> _Voted:
        return _Voted(*predictor.given(frame.hints).reach_leaves(frame.depth, frame.camera), frame.joints)

    voted = list(_of_frames(reach, frames, n_threads))
    n_joints = len(voted[0].joints)
    score = np.zeros((len(MAX_OFFSETS_M), len(BANDWIDTHS_M), n_joints))
    for row, length in enumerate(MAX_OFFSETS_M):
        table = shortened(predictor.table, length)
        score[row] = sum(_mapped(partial(_scores, table), voted, n_threads))
    best = score.reshape(-1, n_joints).argmax(axis=0)
    row, column = np.divmod(best, len(BANDWIDTHS_M))
    has_score = is_known(np.stack([each.joints for each in voted])).any(axis=0) & _has_votes(predictor.model)
    tuning = predictor.model.tuning
    return replace(
        tuning,
        max_offset_m=np.where(has_score, np.array(MAX_OFFSETS_M, np.float32)[row], tuning.max_offset_m),
        bandwidth_m=np.where(has_score, np.array(BANDWIDTHS_M, np.float32)[column], tuning.bandwidth_m),
    )


def _scores(table: VoteTable, voted: _Voted) -> NDArray[np.float64]:
    """(n_bandwidths, n_joints) float64: 1 up to 5 cm of error, 0 from 15 cm on or without votes or truth."""
    votes = cast(table, voted.leaves, voted.points)
    n_joints = len(voted.joints)
    out = np.empty((len(BANDWIDTHS_M), n_joints))
    proposals, density = np.empty((n_joints, 2, 3), np.float32), np.empty((n_joints, 2), np.float32)
    spread, share = np.empty(n_joints, np.float32), np.empty(n_joints, np.float32)
    for k, width in enumerate(BANDWIDTHS_M):
        bandwidth = np.full(n_joints, width, np.float32)
        find_peaks(votes.votes, votes.n_votes, table.n_layers, bandwidth, proposals, density, spread, share)
        error = np.linalg.norm(proposals[:, 0] - voted.joints, axis=1)
        out[k] = np.clip(1.5 - np.nan_to_num(error, nan=np.inf) / WITHIN_M, 0.0, 1.0)
    return out


def _of_frames(work: Callable[[DepthFrame], _Result], frames: FrameSequence, n_threads: int) -> Iterator[_Result]:
    """Work on all frames in their order; few are in memory at a time."""
    return in_order(lambda number: work(frames[number]), len(frames), n_threads)


def _mapped(work: Callable[[_Item], _Result], items: Sequence[_Item], n_threads: int) -> list[_Result]:
    if n_threads == 1:
        return [work(item) for item in items]
    with ThreadPoolExecutor(n_threads) as threads:
        return list(threads.map(work, items))
