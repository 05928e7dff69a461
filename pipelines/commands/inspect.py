"""undergrowth inspect: contact sheets and a page of statistics."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.corpus import Corpus
from pipelines.inspect.write import write_inspection
from storage.ranges import MAX_FRAMES, check_fields

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class InspectSettings:
    """Draws contact sheets of a corpus and writes a page with its statistics.

    Attributes:
        corpus: Folder of the corpus.
        frames: Number of frames to draw, evenly spread.
        out: Folder for the pictures. By default it lies beside the corpus and is called like it, with "-inspect"
            added.
        sensor: Draw the depth as this sensor would measure it.
        zoom: Size of each picture relative to the box around the person; 0 shows whole images.
        allow_incomplete: Use the finished frames of an unfinished corpus.
    """

    corpus: Annotated[Path, tyro.conf.Positional]
    frames: int = 24
    out: Path | None = None
    sensor: str | None = None
    zoom: float = 1.45
    allow_incomplete: bool = False

    def __post_init__(self) -> None:
        check_fields(self, {"frames": (1, MAX_FRAMES), "zoom": (0.0, 100.0)})

    def run(self) -> int:
        """Writes the pictures and tells where."""
        corpus = Corpus.open(self.corpus, self.allow_incomplete)
        resolved = self.corpus.resolve()
        out = self.out or resolved.with_name(resolved.name + "-inspect")
        for path in write_inspection(corpus, out, self.frames, self.sensor, self.zoom):
            log.info("%s", path)
        return 0
