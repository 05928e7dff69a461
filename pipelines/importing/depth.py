"""Recorded depth images as an order for a corpus."""

import functools
import hashlib
import json
from dataclasses import asdict
from pathlib import Path

from pipelines.corpus import Order
from pipelines.errors import UserError
from pipelines.recordings.entries import list_files
from pipelines.recordings.frames import Options, RecordedFrames
from pipelines.recordings.layout import Layout
from synth.vocabulary import SPLITS


def recorded_order(folder: Path, layout: Layout, options: Options) -> Order[RecordedFrames]:
    """A corpus of the frames of a folder.

    Args:
        folder: Where the recordings are.
        layout: How they read.
        options: How they become frames.

    Raises:
        UserError: The folder has no frames.
    """
    make = functools.partial(RecordedFrames, folder, layout, options)
    config = {
        "import": {
            "parts": "none" if layout.annotation is None else "geodesic",
            "files": files_digest(folder, layout),
            "layout": asdict(layout),
            **asdict(options),
        }
    }
    return Order(0, len(make()), config, make)


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
            raise UserError(f"splits={text!r} must have the form train=0.5,val=0,test=0.5") from None
    if not all(share >= 0.0 for share in shares.values()) or abs(sum(shares.values()) - 1.0) > 1e-6:
        raise UserError(f"splits={text!r} must be shares that sum to 1")
    return shares["train"], shares["val"], shares["test"]


def files_digest(folder: Path, layout: Layout) -> str:
    """SHA-256 over names and sizes of the files of depth, so that a corpus is not finished with other files."""
    listed = [(path.name, path.stat().st_size) for path in list_files(folder, layout.files)]
    return hashlib.sha256(json.dumps(listed).encode()).hexdigest()
