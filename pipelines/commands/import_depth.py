"""undergrowth import depth: recorded depth images as a corpus."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.errors import UserError
from pipelines.generation.writing import write_shown
from pipelines.importing.depth import parse_shares, recorded_order
from pipelines.recordings.entries import SMALLEST_BLOB
from pipelines.recordings.frames import Options
from pipelines.recordings.layout import choose_layout

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class DepthSettings:
    """Makes a corpus out of recorded depth images, with joints and labels where the recordings have joints.

    Attributes:
        folder: Where the recordings are.
        out: Folder of the corpus: new, empty, or one begun with the same settings.
        layout: Name of a known layout or a .toml file; by default found from the folder's contents.
        splits: Shares of the splits, by the order of the frames.
        every: Take one frame of so many.
        smallest_blob: Drop regions of fewer of the person's pixels than this share; 0 keeps all.
        registration: Move the joints as the layout says, where recordings misplace them.
        workers: Processes.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    out: Path
    layout: str | None = None
    splits: str = "test=1"
    every: int = 1
    smallest_blob: float = SMALLEST_BLOB
    registration: bool = True
    workers: int = 1

    def __post_init__(self) -> None:
        if self.every < 1:
            raise ValueError(f"every={self.every} must be at least 1")
        if not 0.0 <= self.smallest_blob < 1.0:
            raise ValueError(f"smallest_blob={self.smallest_blob} must be in 0..1, 1 not included")

    def run(self) -> int:
        """Imports the folder and tells what it read it as."""
        if not self.folder.is_dir():
            raise UserError(f"{self.folder} is no folder")
        name, layout = choose_layout(self.folder, self.layout)
        options = Options(name, self.smallest_blob, self.registration, self.every, parse_shares(self.splits))
        order = recorded_order(self.folder, layout, options)
        log.info("%s read as %s: %d frames", self.folder, name, order.n_frames)
        if order.config["import"]["parts"] == "none":
            log.info("it has no joints, so pixels get no part labels")
        write_shown(self.out, order, self.workers)
        log.info("%d frames in %s", order.n_frames, self.out)
        return 0
