"""Training pixels gathered by workers: each reads some frames and leaves what it gathered in a folder that all see."""

import hashlib
import io
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from forests.crops import Crops
from forests.frames import DepthFrame
from forests.samples import Layer, Samples, TrainingSet, gather_some
from pipelines.corpus.joined import FrameChoice, JoinedFrames
from pipelines.engine.cluster import this_worker
from pipelines.errors import UserError
from storage.atomic import write_atomically

PIECE_FRAMES = 128
"""Frames that one task reads."""


@dataclass(frozen=True)
class GatherJob:
    """What is gathered.

    Attributes:
        folder: Where the pieces are left.
        choice: The frames.
        n_frames: How many there are.
        first_frame: SHA-256 of the first frame as it must be read.
        layer: As of `forests.samples.gather`; so are the rest.
        n_body_pixels: Pixels drawn from the person in a frame.
        n_occluder_pixels: Pixels drawn from the objects in a frame.
        seed: Of the drawing.
    """

    folder: Path
    choice: FrameChoice
    n_frames: int
    first_frame: str
    layer: Layer
    n_body_pixels: int
    n_occluder_pixels: int
    seed: int

    @property
    def n_pieces(self) -> int:
        """Tasks."""
        return -(-self.n_frames // PIECE_FRAMES)

    def piece(self, number: int) -> Path:
        """The file of a task; that of another job, whose worker may be late, has another name."""
        name = hashlib.sha256(repr(self).encode()).hexdigest()[:16]
        return self.folder / f"piece-{name}-{number:06d}.npz"


class _Part:
    """Consecutive frames of a sequence."""

    def __init__(self, frames: JoinedFrames, numbers: range) -> None:
        self.labels = frames.labels
        self._frames, self._numbers = frames, numbers

    def __len__(self) -> int:
        return len(self._numbers)

    def __getitem__(self, place: int) -> DepthFrame:
        return self._frames[self._numbers[place]]


def gather_piece(job: GatherJob, number: int) -> int:
    """Gathers the pixels of some frames into the piece's file; gives the number of frames.

    Raises:
        UserError: This worker reads other frames than the command.
    """
    frames = _frames_of(job.choice, job.n_frames, job.first_frame)
    numbers = range(number * PIECE_FRAMES, min((number + 1) * PIECE_FRAMES, job.n_frames))
    part = gather_some(
        _Part(frames, numbers), job.layer, job.n_body_pixels, job.n_occluder_pixels, job.seed, numbers.start
    )
    crops, samples = part.crops, part.samples
    content = io.BytesIO()
    np.savez(
        content,
        joints=part.joints,
        **{name: getattr(crops, name) for name in _CROP_NAMES},
        **{f"sample_{name}": getattr(samples, name) for name in Samples._fields},
    )
    write_atomically(job.piece(number), content.getvalue())
    return len(numbers)


_CROP_NAMES = ("pixels", "start", "width", "height", "origin", "intrinsics")


@lru_cache(maxsize=1)
def _frames_of(choice: FrameChoice, n_frames: int, first_frame: str) -> JoinedFrames:
    frames = choice.frames()
    if len(frames) != n_frames or digest_of_frame(frames) != first_frame:
        raise UserError(
            f"the worker {this_worker()} reads other frames of {', '.join(map(str, choice.corpora))} than the "
            "command; all workers must see the same corpora, on machines of one kind"
        )
    return frames


def digest_of_frame(frames: JoinedFrames) -> str:
    """SHA-256 of what is learned from the first frame."""
    frame = frames[0]
    parts = (frame.depth, frame.label, frame.body_depth, frame.body_label, frame.joints)
    return hashlib.sha256(b"".join(part.tobytes() for part in parts)).hexdigest()


def joined_pieces(job: GatherJob) -> TrainingSet:
    """What all pieces hold together, in files of the folder that this process maps; the pieces are removed."""
    columns: dict[str, list[np.ndarray]] = {}
    n_pixels = 0
    with (job.folder / "pixels.raw").open("wb") as file:
        for number, arrays in enumerate(_pieces(job)):
            file.write(arrays.pop("pixels").data)
            arrays["start"] += n_pixels
            arrays["sample_frame"] += np.int32(number * PIECE_FRAMES)
            n_pixels = file.tell() // 2
            for name, values in arrays.items():
                columns.setdefault(name, []).append(values)
            job.piece(number).unlink()
    whole = {name: np.concatenate(values) for name, values in columns.items()}
    pixels = np.memmap(job.folder / "pixels.raw", np.uint16, "c", shape=(n_pixels,)).view(np.ndarray)
    crops = Crops(pixels, **{name: whole[name] for name in _CROP_NAMES[1:]}, facts=np.zeros((0, 0), np.int16))
    samples = Samples(*(whole[f"sample_{name}"] for name in Samples._fields))
    return TrainingSet(crops, samples, whole["joints"])


def _pieces(job: GatherJob) -> Iterator[dict[str, np.ndarray]]:
    for number in range(job.n_pieces):
        with np.load(job.piece(number)) as file:
            yield dict(file)
