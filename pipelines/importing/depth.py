"""Recorded depth images as an order for a corpus."""

import functools
import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from pipelines.corpus import Order
from pipelines.errors import UserError
from pipelines.progress import progress
from pipelines.recordings.entries import list_files
from pipelines.recordings.frames import Options, RecordedFrames
from pipelines.recordings.layout import Layout
from synth.vocabulary import SPLITS


@dataclass(frozen=True)
class Recorded:
    """A corpus to be made of a folder's frames.

    Attributes:
        order: The corpus.
        left_out: Why each of the other frames cannot be used.
        unlikely: What is unlikely of frames that are used.
    """

    order: Order[RecordedFrames]
    left_out: tuple[str, ...]
    unlikely: tuple[str, ...]


def recorded_order(folder: Path, layout: Layout, options: Options) -> Recorded:
    """A corpus of the frames of a folder that can be used, which are found by reading all of them first.

    Args:
        folder: Where the recordings are.
        layout: How they read.
        options: How they become frames.

    Raises:
        UserError: The folder has no frames, or none that can be used.
    """
    frames = RecordedFrames(folder, layout, options)
    usable, left_out, unlikely = [], [], []
    for entry in progress(frames.entries, "frame", "read"):
        try:
            sentence = frames.read(entry)[2]
        except (UserError, OSError) as error:
            left_out.append(str(error))
            continue
        usable.append(entry)
        if sentence:
            unlikely.append(sentence)
    if not usable:
        raise UserError(f"{folder} has no frame that can be used; the first of {len(left_out)}: {left_out[0]}")
    config = {
        "import": {
            "parts": "none" if layout.annotation is None else "geodesic",
            "files": files_digest(folder, layout),
            "layout": _values(layout),
            **asdict(options),
            **({"left_out": len(left_out)} if left_out else {}),
        }
    }
    make = functools.partial(RecordedFrames, folder, layout, options, tuple(usable))
    return Recorded(Order(0, len(usable), config, make), tuple(left_out), tuple(unlikely))


def _values(layout: Layout) -> dict:
    """A layout as a corpus tells it: the unit of integers always, what else is rare only where it is given."""
    rare = {"swap_bytes": layout.swap_bytes, "floats_mm_per_unit": layout.mm_per_unit}
    values = asdict(layout) | {"mm_per_unit": layout.mm_per_unit or 1.0}
    del values["swap_bytes"]
    return values | {key: value for key, value in rare.items() if value}


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
