"""A corpus as the forests' sequence of frames."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forests.frames import DepthFrame, LabelTable
from pipelines.corpus.header import Header
from pipelines.corpus.read import Corpus
from pipelines.errors import CorpusError
from synth.vocabulary import JOINT_NAMES, OCCLUDER_CLASSES, PART_NAMES, JointState

LABELS = LabelTable(PART_NAMES[1:], OCCLUDER_CLASSES[1:], JOINT_NAMES)
"""The program's own, for where no corpus is at hand: body parts are 1..31, occluder class c is label 31 + c."""

_IMAGES = ("depth", "part", "occluder", "hidden_depth", "hidden_part")


def label_table(header: Header) -> LabelTable:
    """A corpus' own names of the labels: the parts, then the occluder classes."""
    tables = header.labels
    return LabelTable(tuple(tables["parts"][1:]), tuple(tables["occluders"][1:]), tuple(tables["joints"]))


@dataclass(frozen=True)
class CorpusFrames:
    """Some frames of a corpus of single people, read one at a time.

    Attributes:
        corpus: An open corpus.
        indices: (n,) frame numbers.
        sensor: Sensor model for the composite's depth; None = clean.
    """

    corpus: Corpus
    indices: NDArray[np.int64]
    sensor: str | None = None

    def __post_init__(self) -> None:
        if self.corpus.header.has_rooms:
            raise CorpusError(f"{self.corpus.path} holds whole scenes; models are scored on frames of one person")

    @property
    def labels(self) -> LabelTable:
        """What the label images mean, as the corpus says."""
        return label_table(self.corpus.header)

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, place: int) -> DepthFrame:
        from pipelines.corpus.layers import body_layer

        number = int(self.indices[place])
        depth, part, occluder, *behind = (self.corpus.arrays(name, [number])[0] for name in _IMAGES)
        body_depth, body_part = body_layer(depth, part, *behind)
        label = part + (occluder + np.uint8(self.labels.n_parts)) * (occluder > 0)
        if self.sensor is not None:
            depth = self.corpus.arrays("depth", [number], self.sensor)[0]
        state = self.corpus.arrays("joint_state", [number])[0]
        joints = self.corpus.arrays("joints", [number])[0]
        hidden = state == JointState.OCCLUDED, state == JointState.SELF_OCCLUDED
        camera = self.corpus.camera(number)
        return DepthFrame(
            depth, label, body_depth, body_part, joints, hidden[0], camera, is_self_occluded=hidden[1]
        )
