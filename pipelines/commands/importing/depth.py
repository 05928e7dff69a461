"""undergrowth import depth: recorded depth images as a corpus."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.corpus import Order
from pipelines.errors import UserError
from pipelines.generation.writing import write_shown
from pipelines.importing.depth import parse_shares, recorded_order
from pipelines.recordings.choosing import choose_layout
from pipelines.recordings.entries import SMALLEST_BLOB
from pipelines.recordings.frames import Options, RecordedFrames
from storage.ranges import MAX_FRAMES, MAX_THREADS, check_fields

log = logging.getLogger(__name__)

N_LISTED = 20
"""Of more frames that are left out, not every one is told."""


@dataclass(frozen=True)
class DepthSettings:
    """Makes a corpus from recorded depth images, with joints and part labels where the recordings have joints.

    Frames that cannot be read, show nobody or hold no depth of a person are reported and left out.

    Attributes:
        folder: Folder of the recordings.
        out: Folder of the corpus: new, empty, or begun with the same settings.
        layout: Name of a known layout, or a .toml file. By default the layout is found from the contents of the
            folder.
        splits: Shares of the splits, in the order of the frames, such as train=0.5,val=0.1,test=0.4.
        every: Use every Nth frame.
        smallest_blob: Remove connected regions that hold less than this share of the person's pixels; 0 keeps all.
        registration: Move the joints as the layout says, where the recordings misplace them.
        workers: Number of processes. The corpus does not depend on it.
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
        check_fields(self, {"every": (1, MAX_FRAMES), "workers": (1, MAX_THREADS)})
        if not 0.0 <= self.smallest_blob < 1.0:
            raise ValueError(f"smallest_blob={self.smallest_blob} must be at least 0 and less than 1")

    def run(self) -> int:
        """Imports the folder and tells what it read it as."""
        name, order = self.order()
        log.info("%s has the layout %s: %d frames", self.folder, name, order.n_frames)
        if order.config["import"]["parts"] == "none":
            log.info("the recordings have no joints, so pixels get no part labels")
        write_shown(self.out, order, self.workers)
        n_left_out = order.config["import"].get("left_out", 0)
        said = f"; {n_left_out} of {order.n_frames + n_left_out} were left out" if n_left_out else ""
        log.info("%d frames in %s%s", order.n_frames, self.out, said)
        return 0

    def order(self) -> tuple[str, Order[RecordedFrames]]:
        """The name of the layout, and the corpus to be made; reads every frame once and tells which are left out.

        Raises:
            UserError: The folder or its layout is not there, or it has no frame that can be used.
        """
        if not self.folder.is_dir():
            raise UserError(f"{self.folder} is not a folder")
        name, layout = choose_layout(self.folder, self.layout)
        options = Options(name, self.smallest_blob, self.registration, self.every, parse_shares(self.splits))
        recorded = recorded_order(self.folder, layout, options)
        _tell("left out", recorded.left_out)
        _tell("warning", recorded.unlikely)
        return name, recorded.order


def _tell(what: str, sentences: Sequence[str]) -> None:
    """Says the first of some sentences, and how many there are."""
    for sentence in sentences[:N_LISTED]:
        log.info("%s: %s", what, sentence)
    if len(sentences) > N_LISTED:
        log.info("%s: %d frames more", what, len(sentences) - N_LISTED)
