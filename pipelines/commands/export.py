"""undergrowth export: a corpus in the formats that others read."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from pipelines.corpus import Corpus
from pipelines.export.write import export
from synth.vocabulary import SPLITS

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ExportSettings:
    """Writes a corpus in another format.

    Attributes:
        corpus: Folder of the corpus.
        to: Format: exr, coco (with PNG maps), webdataset or itop (HDF5).
        out: New or empty folder.
        split: Split to write. By default all splits are written.
        sensor: Add the noise of this sensor model to the composite depth. By default the depth stays clean.
        allow_incomplete: Use the finished frames of an unfinished corpus.
    """

    corpus: Annotated[Path, tyro.conf.Positional]
    to: Literal["exr", "coco", "webdataset", "itop"]
    out: Path
    split: Literal["train", "val", "test"] | None = None
    sensor: str | None = None
    allow_incomplete: bool = False

    def run(self) -> int:
        """Exports and tells how much."""
        corpus = Corpus.open(self.corpus, self.allow_incomplete)
        splits = SPLITS if self.split is None else (self.split,)
        n_frames = export(corpus, self.to, self.out, splits, self.sensor)
        log.info("%d frames in %s", n_frames, self.out)
        return 0
