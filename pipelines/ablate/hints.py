"""What an experiment tells trees of a corpus' frames beside depth: truths, to bound what knowing them is worth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from forests.frames import FACT_LIMIT, DepthFrame, FrameSequence, Hints, LabelTable
from forests.skeleton.heading import facings_of
from pipelines.ablate.config import Told
from pipelines.corpus import Corpus
from pipelines.corpus.rooms.views import PeopleFrames
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import CorpusError
from synth.vocabulary import JOINT_NAMES

N_DIRECTIONS = 8
"""A heading is told as its cosines with so many directions of a half circle."""
_HEADING_ONE = 1000
_MEAN_STATURE_MM = 1500


@dataclass(frozen=True)
class HintedFrames:
    """Frames of a corpus of which more is told than depth.

    Attributes:
        frames: The frames.
        told: What of them is told.
    """

    frames: CorpusFrames
    told: Told

    @property
    def labels(self) -> LabelTable:
        """What the label images mean."""
        return self.frames.labels

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, place: int) -> DepthFrame:
        frame = self.frames[place]
        hints = _TRUTHS[self.told](self.frames.corpus, int(self.frames.indices[place]), frame)
        return replace(frame, hints=hints)


def frames_told(frames: CorpusFrames | PeopleFrames, told: Told | None) -> FrameSequence:
    """Frames of which a truth is told beside depth, if any is: what is predicted, the model predicts itself.

    Raises:
        CorpusError: Truths are to be told of people in rooms.
    """
    if told is None or told not in _TRUTHS:
        return frames
    if isinstance(frames, PeopleFrames):
        raise CorpusError(f"{frames.corpus.path} holds whole scenes, of which no truths are told")
    return HintedFrames(frames, told)


def _mask(corpus: Corpus, number: int, frame: DepthFrame) -> Hints:
    """1 = the person, 2 = an object."""
    n_parts = len(corpus.header.labels["parts"]) - 1
    return Hints(((frame.label > 0).astype(np.uint8) + (frame.label > n_parts)).astype(np.uint8))


def _classes(corpus: Corpus, number: int, frame: DepthFrame) -> Hints:
    """1 = the person, 1 + c = an object of class c."""
    n_parts = len(corpus.header.labels["parts"]) - 1
    beyond = np.maximum(frame.label, n_parts) - np.uint8(n_parts)
    return Hints(((frame.label > 0) + beyond).astype(np.uint8))


def _heading(corpus: Corpus, number: int, frame: DepthFrame) -> Hints:
    return Hints(facts=heading_facts(frame.joints))


def heading_facts(joints: NDArray[np.float32]) -> NDArray[np.int16]:
    """(N_DIRECTIONS,) int16: a heading as trees are told it, cosines times 1000; zeros where it is not known.

    Args:
        joints: (15, 3) float32, camera frame [m]; the heading is that of `facings_of`.
    """
    turn = np.arange(N_DIRECTIONS) * (np.pi / N_DIRECTIONS)
    cosines = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ facings_of(joints[None], JOINT_NAMES)[0]
    return np.rint(_HEADING_ONE * cosines).astype(np.int16)


def _posture(corpus: Corpus, number: int, frame: DepthFrame) -> Hints:
    """A fact for each family of poses: the frame's own holds."""
    from synth.bodies.poses.families import FAMILIES

    family = corpus.info(number).pose_family
    facts = np.zeros(len(FAMILIES), np.int16)
    if family not in FAMILIES:
        raise CorpusError(f"frame {number} of {corpus.path} is of no known family of poses, but {family!r}")
    facts[list(FAMILIES).index(family)] = FACT_LIMIT
    return Hints(facts=facts)


def _size(corpus: Corpus, number: int, frame: DepthFrame) -> Hints:
    """The stature [mm] above 1.5 m."""
    stature = corpus.info(number).subject.get("stature")
    if not isinstance(stature, float):
        raise CorpusError(f"frame {number} of {corpus.path} does not tell the person's stature")
    fact = np.clip(round(1000 * stature) - _MEAN_STATURE_MM, -FACT_LIMIT, FACT_LIMIT)
    return Hints(facts=np.array([fact], np.int16))


_TRUTHS: Mapping[Told, Callable[[Corpus, int, DepthFrame], Hints]] = {
    "mask": _mask,
    "classes": _classes,
    "heading": _heading,
    "posture": _posture,
    "size": _size,
}
