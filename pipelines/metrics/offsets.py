"""Joints of other definitions: a constant offset each, fixed to the body, learned on frames of their own."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from forests.frames import is_known
from pipelines.corpus import Corpus
from pipelines.errors import UserError
from pipelines.metrics.results import Results
from pipelines.spread import at_most
from synth.vocabulary import SPLITS

NEAR_M = 0.2
"""An answer farther than this from the truth is a miss, and tells nothing of definitions [m]."""
LEAST_FRAMES, LEAST_SHARE = 5, 0.25
"""A joint that is answered near the truth in fewer of the frames that know it is left where it is."""
LEAST_WIDTH_M = 0.05
"""Shoulders nearer to each other than this, seen from above, do not say where the person faces [m]."""
AXES = ("forward", "left", "up")
"""Of the body's frame, in the order of an offset's coordinates."""

_FALLBACKS = ((0.0, 0.0, -1.0), (0.0, -1.0, 0.0))
"""Forward, in the camera frame, where nothing is answered; the second for a camera that looks straight down."""


@dataclass(frozen=True)
class JointOffsets:
    """From what a method answers to what a data set calls the joint.

    Attributes:
        joints: Names of the joints.
        metres: (n_joints, 3) float64 in the body's frame (forward, left, up) [m]; 0 where nothing was learned.
        n_frames: (n_joints,) int64, frames that the offset was learned on.
    """

    joints: tuple[str, ...]
    metres: NDArray[np.float64]
    n_frames: NDArray[np.int64]

    def values(self) -> Mapping[str, Mapping[str, float] | None]:
        """By joint as JSON values [cm]; None for joints that are left where they are."""
        keys = [f"{axis}_cm" for axis in AXES]
        rows = [dict(zip(keys, row, strict=True)) for row in (100.0 * self.metres).tolist()]
        return {
            name: {"n_frames": int(n), **row} if n else None
            for name, row, n in zip(self.joints, rows, self.n_frames, strict=True)
        }


def frames_apart(corpus: Corpus, split: str, n_frames: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Frames to learn offsets on, and the frames that are left to be scored.

    Args:
        corpus: The corpus.
        split: Which split is scored.
        n_frames: How many to learn on, 0 = none; fewer if there are no more.

    Returns:
        Frame numbers evenly spread over the other splits and all of the split, or, if there is no other, the
        split's first frames and the rest.

    Raises:
        UserError: The split's frames would all be learned on.
    """
    own = corpus.split(split)
    if not n_frames:
        return own[:0], own
    others = np.concatenate([corpus.split(name) for name in SPLITS if name != split])
    if len(others):
        return others[at_most(len(others), n_frames)], own
    if 0 < len(own) <= n_frames:
        raise UserError(
            f"joint_offsets={n_frames} uses all {len(own)} frames of {split}, so none is left to score"
        )
    return own[:n_frames], own[n_frames:]


def upwards(corpus: Corpus, indices: NDArray[np.int64]) -> NDArray[np.float64]:
    """(n, 3) float64, the world's vertical in the camera frames."""
    return np.asarray(corpus.arrays("T_world_camera", indices)[:, 2, :3], np.float64)


def body_axes(results: Results, up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Frames of reference that turn with the person, upright.

    Left is the level part of the line from the right to the left shoulder, as they were answered. Where a shoulder
    is missing or the line stands upright, the person is taken to face the camera.

    Args:
        results: A method's answers.
        up: (n, 3) float64, the vertical in the camera frames.

    Returns:
        (n, 3, 3) float64, forward, left and up in the camera frame, in columns.
    """
    answers = results.proposals[:, :, 0].astype(np.float64)
    forward = _level(np.cross(_width(results, answers), up), up, LEAST_WIDTH_M)
    others = [_level(-_middle(answers), up, 1e-3)]
    others += [_level(np.broadcast_to(np.array(axis), up.shape), up, 0.5) for axis in _FALLBACKS]
    for other in others:
        forward = np.where(np.isnan(forward), other, forward)
    return np.stack([forward, np.cross(up, forward), up], axis=2)


def _width(results: Results, answers: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3) float64, from the right to the left shoulder [m]; NaN if not both are answered."""
    names = results.truths.joints
    if "l_shoulder" not in names or "r_shoulder" not in names:
        return np.full((len(answers), 3), np.nan)
    return np.asarray(answers[:, names.index("l_shoulder")] - answers[:, names.index("r_shoulder")])


def _middle(answers: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3) float64, mean of the joints that were answered [m]; NaN without any."""
    is_made = np.isfinite(answers).all(axis=2, keepdims=True)
    n = is_made.sum(axis=1)
    return np.where(n > 0, np.where(is_made, answers, 0.0).sum(axis=1) / np.maximum(n, 1), np.nan)


def _level(vector: NDArray[np.float64], up: NDArray[np.float64], least: float) -> NDArray[np.float64]:
    """(n, 3) float64, the level parts, of length 1; NaN where they are shorter than `least`."""
    flat = vector - (vector * up).sum(axis=1, keepdims=True) * up
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    is_long = length >= least
    return np.where(is_long, flat / np.where(is_long, length, 1.0), np.nan)


def learn_offsets(results: Results, up: NDArray[np.float64]) -> JointOffsets:
    """Medians, axis by axis, of what lies between answers and truths in the body's frame.

    Answers farther off than `NEAR_M` are left out, and so are joints with too few others. The median takes all
    that is constant in a method's errors for the data set's: a bias of the method's own goes with it.

    Args:
        results: A method's answers on frames that are not scored.
        up: (n, 3) float64, the vertical in the camera frames.
    """
    gap = results.truths.xyz.astype(np.float64) - results.proposals[:, :, 0].astype(np.float64)
    own = np.einsum("nij,nki->nkj", body_axes(results, up), gap)
    is_near = np.linalg.norm(gap, axis=2) <= NEAR_M  # NaN is not
    n_frames, n_known = is_near.sum(axis=0), is_known(results.truths.xyz).sum(axis=0)
    n_frames[n_frames < np.maximum(LEAST_FRAMES, LEAST_SHARE * n_known)] = 0
    metres = np.zeros((len(n_frames), 3))
    for joint in np.flatnonzero(n_frames):
        metres[joint] = np.median(own[is_near[:, joint], joint], axis=0)
    return JointOffsets(results.truths.joints, metres, n_frames)


def with_offsets(results: Results, up: NDArray[np.float64], offsets: JointOffsets) -> Results:
    """The answers, all proposals of a joint moved by its offset.

    Args:
        results: A method's answers on the joints of the offsets.
        up: (n, 3) float64, the vertical in the camera frames.
        offsets: Learned on other frames.
    """
    moves = np.einsum("nij,kj->nki", body_axes(results, up), offsets.metres)
    return replace(results, proposals=(results.proposals + moves[:, :, None]).astype(np.float32))
