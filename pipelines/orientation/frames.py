"""Frames of corpora as orientation nets learn from them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box, upper_body_box
from forests.frames import is_known
from nets.orientation.config import Region
from nets.orientation.frames import OrientedFrame, Truth
from pipelines.corpus import Corpus
from pipelines.orientation.truths import OrientationTruths, read_orientations
from synth.vocabulary import JOINT_NAMES

BODY_MARGIN_M = 0.12
"""The box of a body ends this far beyond its joints, about the top of the head [m]."""
HEAD_MARGIN_M = 0.13
"""The box of a head reaches this far from its centre [m]."""
LEAST_SEEN_PX = 40
"""A head of which fewer pixels are seen is left out."""
HEAD_LABELS = (1, 2, 3, 4)
"""Parts of the head."""


@dataclass(frozen=True)
class CorpusOrientations:
    """Some frames of a corpus, with the truth about body or head.

    Attributes:
        corpus: An open corpus.
        indices: (n,) frame numbers.
        region: body or head.
        sensor: Sensor model for the composite's depth; None = clean.
    """

    corpus: Corpus
    indices: NDArray[np.int64]
    region: Region
    sensor: str | None = None

    @cached_property
    def truths(self) -> OrientationTruths:
        """The truth of the frames."""
        return read_orientations(self.corpus, self.indices)

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, place: int) -> OrientedFrame | None:
        truth = self._truth(place)
        number = [int(self.indices[place])]
        joints = self.corpus.arrays("joints", number)[0]
        camera = self.corpus.camera(number[0])
        box = region_box(self.region, joints, camera)
        if not np.isfinite(truth.angle) or box is None:
            return None
        part, occluder = (self.corpus.arrays(name, number)[0] for name in ("part", "occluder"))
        if self.region == "head" and np.isin(part, HEAD_LABELS).sum() < LEAST_SEEN_PX:
            return None
        depth = self.corpus.arrays("depth", number, self.sensor)[0]
        if not _shows(depth, box):
            return None
        kind = np.where(part > 0, 1, np.where(occluder > 0, 2, 0)).astype(np.uint8)
        return OrientedFrame(depth, kind, camera, box, truth)

    def _truth(self, place: int) -> Truth:
        truths = self.truths
        pan, tilt, roll = truths.head[place].tolist()
        if self.region == "head":
            return Truth(pan, tilt, roll, -1)
        return Truth(float(truths.heading[place]), np.nan, np.nan, int(truths.posture[place]))


@dataclass(frozen=True)
class JoinedOrientations:
    """Frames of several corpora, one corpus after the other.

    Attributes:
        parts: Frames of each corpus.
    """

    parts: Sequence[CorpusOrientations]

    def __len__(self) -> int:
        return sum(map(len, self.parts))

    def __getitem__(self, place: int) -> OrientedFrame | None:
        for part in self.parts:
            if place < len(part):
                return part[place]
            place -= len(part)
        raise IndexError(f"frame {place} is beyond the last one")


def region_box(region: Region, joints: NDArray[np.float32], camera: object) -> Box | None:
    """The box that a perfect detector gives of a body or a head; None if no joint of it is known.

    Args:
        region: body or head.
        joints: (15, 3) float32, camera frame [m]; NaN = unknown.
        camera: Intrinsics.
    """
    if region == "body":
        return upper_body_box(joints, camera, BODY_MARGIN_M)  # type: ignore[arg-type]
    head = joints[[JOINT_NAMES.index("head")]]
    return upper_body_box(head, camera, HEAD_MARGIN_M) if is_known(head)[0] else None  # type: ignore[arg-type]


def _shows(depth: NDArray[np.uint16], box: Box) -> bool:
    """Whether an image shows anything in a box."""
    left, top, right, bottom = (max(0, round(edge)) for edge in box)
    return bool(depth[top:bottom, left:right].any())
