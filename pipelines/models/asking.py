"""Asks a model for the joints: in one recorded image, or in many frames of a corpus, with the labels of pixels."""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box, upper_body_box, upper_foreground_box
from forests.estimate import JointEstimate, JointPredictor, PixelLabeller
from forests.frames import DepthFrame, FrameSequence, Hints, Pinhole
from pipelines.errors import UserError
from synth.vocabulary import JOINT_NAMES

if TYPE_CHECKING:
    from pipelines.metrics.pixels import Confusion
    from pipelines.metrics.results import Results, Truths


@runtime_checkable
class TakesHints(Protocol):
    """A model that may be told more of an image than its depth."""

    @property
    def asks_for_hints(self) -> bool:
        """Whether it must be told in every prediction."""
        ...

    def given(self, hints: Hints | None, /) -> Any:
        """The model for one image of which that is told."""
        ...


@dataclass(frozen=True)
class Contestant:
    """A model as it is scored.

    Attributes:
        method: Its name.
        predictor: Finds joints; it may be asked from several threads at once.
        joints: Names of the joints that it answers, in its order; others are not scored.
        labeller: Labels pixels; None if labels are not asked for, or the model gives none.
        box_joints: Joints whose true box it is given, as by a perfect detector; none = it looks everywhere.
    """

    method: str
    predictor: JointPredictor
    joints: tuple[str, ...]
    labeller: PixelLabeller | None = None
    box_joints: tuple[str, ...] = ()


def contestant_of(method: str, predictor: JointPredictor) -> Contestant:
    """A predictor as it is scored, with all that it offers."""
    labeller = predictor if isinstance(predictor, PixelLabeller) else None
    return Contestant(method, predictor, predictor.joints, labeller, predictor.box_joints)


def ask(
    contestant: Contestant, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None = None
) -> JointEstimate:
    """The joints of the one person in a depth image.

    Args:
        contestant: The model.
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.
        box: left, top, right, bottom [px] of the person; None = a model that needs a start gets the upper part
            of all that the image shows, others look everywhere.
    """
    told = box
    if told is None and contestant.box_joints:
        told = upper_foreground_box(depth, camera)
    return contestant.predictor.predict(depth, camera, told)


class _Answer(NamedTuple):
    estimate: JointEstimate
    seconds: float
    pixels: NDArray[np.int64] | None


def predict_frames(
    contestant: Contestant,
    frames: FrameSequence,
    truths: "Truths",
    n_threads: int = 1,
    on_frame: Callable[[], object] = lambda: None,
) -> "tuple[Results, Confusion | None]":
    """Asks a model about every frame.

    Args:
        contestant: The model.
        frames: The frames.
        truths: What is true there.
        n_threads: Frames in work at a time; the answers do not depend on it.
        on_frame: Told of each frame that is done.

    Returns:
        The answers on the model's joints, and its labels of pixels if it gives any.

    Raises:
        UserError: A joint that the corpus does not have, or an answer of another shape.
    """
    if not len(frames):
        raise UserError("there are no frames to score")
    own = truths.of_joints(contestant.joints)
    # The first answer may load or compile kernels; that is not the model's time.
    _ask(contestant, frames, 0)
    answers = []
    counts: NDArray[np.int64] | None = None
    with ThreadPoolExecutor(n_threads) as pool:
        try:
            for answer in pool.map(lambda place: _ask(contestant, frames, place), range(len(frames))):
                answers.append(answer._replace(pixels=None))
                if answer.pixels is not None:
                    counts = answer.pixels if counts is None else counts + answer.pixels
                on_frame()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return _results(contestant.method, own, answers), _confusion(contestant, frames, counts)


def _ask(contestant: Contestant, frames: FrameSequence, place: int) -> _Answer:
    frame = frames[place]
    if frame.hints is not None:
        contestant = _told(contestant, frame.hints)
    box = _detected_box(contestant, frame)
    begun = time.thread_time()
    estimate = contestant.predictor.predict(frame.depth, frame.camera, box)
    seconds = time.thread_time() - begun
    n_joints = len(contestant.joints)
    if estimate.proposals.ndim != 3 or estimate.proposals.shape[::2] != (n_joints, 3):
        shape = estimate.proposals.shape
        raise UserError(
            f"{contestant.method} returned proposals of shape {shape}, must be ({n_joints}, n_proposals, 3)"
        )
    if contestant.labeller is None:
        return _Answer(estimate, seconds, None)
    from pipelines.metrics.pixels import count_pixels

    given = contestant.labeller.label_pixels(frame.depth, frame.camera)
    counts = count_pixels(frame.label, given, frames.labels.n_labels, len(contestant.labeller.classes))
    return _Answer(estimate, seconds, counts)


def _told(contestant: Contestant, hints: Hints) -> Contestant:
    """A model that is told more of a frame than its depth."""
    assert isinstance(contestant.predictor, TakesHints)
    predictor = contestant.predictor.given(hints)
    return replace(contestant, predictor=predictor, labeller=contestant.labeller and predictor)


def _detected_box(contestant: Contestant, frame: DepthFrame) -> Box | None:
    """The box of the frame's detector, else that which a perfect one would give: of its joints that are known."""
    if not contestant.box_joints:
        return None
    if frame.box is not None:
        return frame.box
    at = [JOINT_NAMES.index(name) for name in contestant.box_joints]
    return upper_body_box(frame.joints[at], frame.camera)


def _results(method: str, truths: "Truths", answers: list[_Answer]) -> "Results":
    from pipelines.metrics.results import Results

    estimates = [answer.estimate for answer in answers]
    return Results(
        method,
        truths,
        proposals=np.stack([item.proposals for item in estimates]).astype(np.float32),
        proposal_confidence=np.stack([item.proposal_confidence for item in estimates]).astype(np.float32),
        probability=np.stack([item.probability for item in estimates]).astype(np.float32),
        hidden_probability=np.stack([item.hidden_probability for item in estimates]).astype(np.float32),
        seconds=np.array([answer.seconds for answer in answers], np.float32),
    )


def _confusion(
    contestant: Contestant, frames: FrameSequence, counts: NDArray[np.int64] | None
) -> "Confusion | None":
    from pipelines.metrics.pixels import Confusion

    if contestant.labeller is None or counts is None:
        return None
    labels = frames.labels
    names = (*labels.parts, *labels.occluders, *labels.surroundings)
    return Confusion(counts, names, contestant.labeller.classes, labels.n_parts)
