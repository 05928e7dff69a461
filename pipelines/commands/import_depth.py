"""undergrowth import depth: recorded depth images as a corpus."""

import functools
import hashlib
import json
import logging
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.commands.generate import generate
from pipelines.corpus import Order
from pipelines.errors import UserError
from pipelines.recordings.entries import SMALLEST_BLOB, list_files
from pipelines.recordings.frames import Options, RecordedFrames
from pipelines.recordings.layout import Layout, choose_layout
from synth.vocabulary import SPLITS

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
        name, order = self.order()
        log.info("%s read as %s: %d frames", self.folder, name, order.n_frames)
        if order.config["import"]["parts"] == "none":
            log.info("it has no joints, so pixels get no part labels")
        generate(self.out, order, self.workers)
        log.info("%d frames in %s", order.n_frames, self.out)
        return 0

    def order(self) -> tuple[str, Order[RecordedFrames]]:
        """The layout's name, and what `write_corpus` is to make.

        Raises:
            UserError: No such folder, no layout for it, or shares that are none.
        """
        if not self.folder.is_dir():
            raise UserError(f"{self.folder} is no folder")
        name, layout = choose_layout(self.folder, self.layout)
        options = Options(name, self.smallest_blob, self.registration, self.every, parse_shares(self.splits))
        make = functools.partial(RecordedFrames, self.folder, layout, options)
        config = {
            "import": {
                "parts": "none" if layout.annotation is None else "geodesic",
                "files": files_digest(self.folder, layout),
                "layout": asdict(layout),
                **asdict(options),
            }
        }
        return name, Order(0, len(make()), config, make)


def parse_shares(text: str) -> tuple[float, float, float]:
    """Shares of train, val and test out of "train=0.5,val=0,test=0.5"; those not named get none.

    Raises:
        UserError: Another split, no number, or shares that do not sum to 1.
    """
    shares = dict.fromkeys(SPLITS, 0.0)
    for item in text.split(","):
        split, _, number = item.strip().partition("=")
        if split not in shares:
            raise UserError(f"splits={text!r} names {split!r}; known are {', '.join(SPLITS)}")
        try:
            shares[split] = float(number)
        except ValueError:
            raise UserError(f"splits={text!r} must read like train=0.5,val=0,test=0.5") from None
    if not all(share >= 0.0 for share in shares.values()) or abs(sum(shares.values()) - 1.0) > 1e-6:
        raise UserError(f"splits={text!r} must be shares that sum to 1")
    return shares["train"], shares["val"], shares["test"]


def files_digest(folder: Path, layout: Layout) -> str:
    """SHA-256 over names and sizes of the files of depth, so that a corpus is not finished with other files."""
    listed = [(path.name, path.stat().st_size) for path in list_files(folder, layout.files)]
    return hashlib.sha256(json.dumps(listed).encode()).hexdigest()
