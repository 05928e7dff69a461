"""What every exporter is given, and small things that several of them write."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus import Corpus
from pipelines.drawing.files import encoded
from synth.frame import Frame, RoomFrame


@dataclass(frozen=True)
class ExportJob:
    """One split to be exported.

    Attributes:
        corpus: The open corpus.
        split: Its split's name.
        indices: (n,) int64, the split's frame numbers.
        folder: Where to write; there and empty at first, shared by the splits.
        sensor: Sensor model for the composite depth, or None for clean depth.
        on_frame: Called after each frame.
        prefix: Of the names of files that hold a whole split, where each camera has its own.
    """

    corpus: Corpus
    split: str
    indices: NDArray[np.int64]
    folder: Path
    sensor: str | None
    on_frame: Callable[[], object] = field(repr=False)
    prefix: str = ""

    def frame(self, index: int) -> Frame:
        """A frame with the sensor applied."""
        return self.corpus.frame(int(index), self.sensor)

    def scene(self, index: int) -> RoomFrame:
        """A whole scene with the sensor applied."""
        return self.corpus.scene(int(index), self.sensor)


def png_bytes(image: NDArray) -> bytes:
    """An 8 or 16 bit grey PNG."""
    return encoded(image)
