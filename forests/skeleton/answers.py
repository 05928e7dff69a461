"""What a forest answered on many frames, beside what is true there: what skeletons are learned from."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from forests.frames import DepthFrame, FrameSequence, Pinhole, in_order, is_known
from forests.skeleton.heading import facing_towards

N_CANDIDATES = 6
"""Proposals of a joint that decoding chooses from."""
CUT_SHARES = (0.15, 0.0, 0.15, 0.7)
"""How often images are cut at the left, top, right and bottom."""
CUT_RANGE = (0.4, 1.0)
"""How much of the person's extent is left, as a share."""
_CUT_STREAM = 0xC07


class Answers(NamedTuple):
    """A forest's answers on frames, one beside the other.

    Attributes:
        proposals: (n, n_joints, n_proposals, 3) float32, camera frame [m]; NaN = none.
        confidence: (n, n_joints, n_proposals) float32.
        within: (n, n_joints) float32, probability that the first is near; NaN = not told.
        hidden: (n, n_joints) float32, probability that an object hides the joint; NaN = not told.
        spread: (n, n_joints) float32 [m]; NaN = not told.
        edges: (n, 4) float32, the image's left, top, right and bottom edge as slopes: x / z and y / z.
        facing: (n, 2) float32, cosine and sine of the heading that votes were weighed by; zeros = of none.
        body_share: (n,) float32, share of the voting pixels that seem to show a person; NaN = not told.
    """

    proposals: NDArray[np.float32]
    confidence: NDArray[np.float32]
    within: NDArray[np.float32]
    hidden: NDArray[np.float32]
    spread: NDArray[np.float32]
    edges: NDArray[np.float32]
    facing: NDArray[np.float32]
    body_share: NDArray[np.float32]


class Truth(NamedTuple):
    """What is true in the same frames.

    Attributes:
        joints: (n, n_joints, 3) float32, camera frame [m]; NaN = unknown.
        is_hidden: (n, n_joints) bool, an object hides the joint.
    """

    joints: NDArray[np.float32]
    is_hidden: NDArray[np.bool_]


class View(NamedTuple):
    """How frames are shown to a forest.

    Attributes:
        is_cut: Whether the images end somewhere on the person.
        is_deserted: Whether the person is taken out, so that only objects are left.
        headings: (n,) float32, headings that the forest is told [rad], NaN = none; None = none in any frame.
    """

    is_cut: bool = False
    is_deserted: bool = False
    headings: NDArray[np.float32] | None = None


def edges_of(shape: tuple[int, ...], camera: Pinhole) -> NDArray[np.float32]:
    """(4,) float32: the left, top, right and bottom edge of an image of (height, width) as x / z and y / z."""
    height, width = shape
    left, right = (-0.5 - camera.cx) / camera.fx, (width - 0.5 - camera.cx) / camera.fx
    top, bottom = (-0.5 - camera.cy) / camera.fy, (height - 0.5 - camera.cy) / camera.fy
    return np.array([left, top, right, bottom], np.float32)


def answers_of(
    ask: Callable[[DepthFrame, float, NDArray[np.float32]], JointEstimate],
    frames: FrameSequence,
    view: View,
    places: NDArray[np.int32] | None = None,
    n_threads: int = 1,
) -> tuple[Answers, Truth]:
    """Asks a forest about frames.

    Args:
        ask: The forest's joints of a frame, given a heading [rad], NaN = of none, and the image's edges (4,).
        frames: The frames, at least one.
        view: How they are shown.
        places: Of the joints that the forest answers among those of the frames; None = all.
        n_threads: Frames in work at a time; the answers do not depend on it.
    """

    def answer(index: int) -> tuple[tuple[Any, ...], NDArray[np.float32], NDArray[np.bool_]]:
        frame = frames[index]
        edges = edges_of(frame.depth.shape, frame.camera)
        own = frame.joints if places is None else frame.joints[places]
        if view.is_cut:
            frame, edges = cut_frame(frame, own, edges, np.random.default_rng([_CUT_STREAM, index]))
        if view.is_deserted:
            frame = replace(frame, depth=frame.depth * (frame.label > frames.labels.n_parts))
        angle = math.nan if view.headings is None else float(view.headings[index])
        said = ask(frame, angle, edges)
        told = (said.proposals, said.proposal_confidence, said.probability, said.hidden_probability, said.spread)
        is_hidden = frame.is_occluded if places is None else frame.is_occluded[places]
        return (*told, edges, facing_towards(angle), np.float32(said.body_share)), own, is_hidden

    answers, joints, hidden = zip(*in_order(answer, len(frames), n_threads), strict=True)
    stacked = (np.stack(column).astype(np.float32) for column in zip(*answers, strict=True))
    return Answers(*stacked), Truth(np.stack(joints).astype(np.float32), np.stack(hidden))


def cut_frame(
    frame: DepthFrame, joints: NDArray[np.float32], edges: NDArray[np.float32], rng: np.random.Generator
) -> tuple[DepthFrame, NDArray[np.float32]]:
    """A frame as of a camera that stands so near that the image ends on the person: below, or at one side.

    Args:
        frame: Any frame.
        joints: (n_joints, 3) float32, joints between which the image is to end, camera frame [m]; NaN = unknown.
        edges: (4,) of its image.
        rng: Draws where the image ends.

    Returns:
        The frame without the depth beyond the new edge, and the edges.
    """
    known = joints[is_known(joints) & (joints[:, 2] > 0)]
    if not len(known):
        return frame, edges
    side = int(rng.choice(4, p=CUT_SHARES))
    axis = side % 2
    slopes = known[:, axis] / known[:, 2]
    share = rng.uniform(*CUT_RANGE)
    low, high = float(slopes.min()), float(slopes.max())
    edge = low + share * (high - low) if side >= 2 else high - share * (high - low)
    focal, centre = (frame.camera.fx, frame.camera.cx) if axis == 0 else (frame.camera.fy, frame.camera.cy)
    at = int(np.clip(np.ceil(edge * focal + centre), 0, frame.depth.shape[1 - axis]))
    depth = frame.depth.copy()
    beyond = slice(at, None) if side >= 2 else slice(None, at)
    depth[(slice(None), beyond) if axis == 0 else beyond] = 0
    edges = edges.copy()
    edges[side] = (at - 0.5 - centre) / focal
    return replace(frame, depth=depth), edges


def joined(parts: list[tuple[Answers, Truth]]) -> tuple[Answers, Truth]:
    """Answers and truths of several sets of frames as one."""
    answers, truths = zip(*parts, strict=True)
    return (
        Answers(*(np.concatenate(column) for column in zip(*answers, strict=True))),
        Truth(*(np.concatenate(column) for column in zip(*truths, strict=True))),
    )
