"""The folder of a corpus: begun, locked, checked before a run goes on in it."""

import contextlib
import fcntl
import json
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

from pipelines.corpus import shards
from pipelines.corpus.header import HEADER_NAME, SCHEMA_VERSION, Angles, Header, build_header, read_header
from pipelines.corpus.manifest import ShardLine, read_manifest, rewrite_manifest
from pipelines.corpus.write import ZARR_NAME, FrameSource, make_frame, shard_files
from pipelines.errors import UserError
from storage.atomic import TEMPORARY_SUFFIX, is_unfinished, write_atomically
from storage.ranges import MAX_FRAMES, MAX_SEED, check_number
from synth.frame import Frame

SourceT_co = TypeVar("SourceT_co", bound=FrameSource, covariant=True)


@dataclass(frozen=True)
class Order(Generic[SourceT_co]):
    """A corpus to be made.

    Attributes:
        seed: The corpus seed.
        n_frames: How many frames, at least 1.
        config: Resolved configuration as JSON values; saved, and compared when going on.
        angles: Names and limits of the skeleton's joint angles; saved.
        schema_version: 1 for frames that show one person, 2 for whole scenes.
        make_source: Makes the frame source; must be picklable for several workers.
    """

    seed: int
    n_frames: int
    config: dict
    make_source: Callable[[], SourceT_co] = field(repr=False)
    angles: Angles = ()
    schema_version: int = SCHEMA_VERSION

    def __post_init__(self) -> None:
        try:
            check_number("n_frames", self.n_frames, 1, MAX_FRAMES)
            check_number("seed", self.seed, 0, MAX_SEED)
        except ValueError as error:
            raise UserError(str(error)) from None


@contextlib.contextmanager
def locked_folder(root: Path) -> Iterator[None]:
    """Holds the folder against a second writer; the lock goes with the process.

    Raises:
        UserError: Another process writes there, or has just renamed the folder.
    """
    handle = os.open(root, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UserError(f"{root} is being written by another command") from None
        if not root.exists() or not os.path.samestat(os.fstat(handle), root.stat()):
            raise UserError(f"{root} has just been written by another command")
        yield
    finally:
        os.close(handle)


def prepare_folder(root: Path, order: Order) -> Header:
    """Begins a corpus in an empty folder, or checks that the one there is the one ordered.

    Raises:
        UserError: The folder holds other files or another corpus; nothing is touched then.
    """
    if not (root / HEADER_NAME).exists():
        foreign = sorted(item.name for item in root.iterdir() if not is_unfinished(item, HEADER_NAME))
        if foreign:
            raise UserError(f"{root} holds other files ({', '.join(foreign[:3])}); choose an empty folder")
        frame = make_frame(order.make_source(), 0)
        n_dof = len(frame.angles) if isinstance(frame, Frame) else len(order.angles)
        document = _document(order, frame.depth.shape, n_dof)
        write_atomically(root / HEADER_NAME, json.dumps(document, indent=1) + "\n")
    header = read_header(root)
    _refuse_other_order(root, header, order)
    _write_array_metadata(root, header)
    return header


def _document(order: Order, size: tuple[int, int], n_dof: int) -> dict:
    """What corpus.json says of an order."""
    return build_header(order.seed, order.n_frames, order.config, order.angles, size, n_dof, order.schema_version)


def _refuse_other_order(root: Path, header: Header, order: Order) -> None:
    asked = _document(order, (header.height, header.width), header.n_dof)
    for name in ("schema_version", "seed", "n_frames", "config", "labels", "software"):
        there, here = getattr(header, name), asked[name]
        if there != here:
            difference = first_difference(name, there, here)
            raise UserError(f"{root} holds a corpus with other settings: {difference}; choose another folder")


def first_difference(name: str, there: object, here: object) -> str:
    """In words, where two trees of JSON values differ first."""
    if isinstance(there, dict) and isinstance(here, dict):
        for key in [*there, *here]:
            if there.get(key) != here.get(key):
                return first_difference(f"{name}.{key}", there.get(key), here.get(key))
    return f"{name} is {there!r} there and {here!r} here"


def _write_array_metadata(root: Path, header: Header) -> None:
    texts = {root / ZARR_NAME / "zarr.json": shards.group_metadata()}
    for item in header.fields.values():
        texts[root / ZARR_NAME / item.name / "zarr.json"] = shards.array_metadata(item, header.n_frames)
    for path, text in texts.items():
        if not path.exists() or path.read_text() != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, text)


def finished_shards(root: Path, header: Header) -> dict[int, ShardLine]:
    """Shards that the manifest names and whose files are all there at full length; clears what else lies about."""
    lines = {}
    for shard, line in read_manifest(root, header).items():
        if all(
            path.is_file() and path.stat().st_size == line.n_bytes[name]
            for name, path in shard_files(root, header, shard).items()
        ):
            lines[shard] = line
    rewrite_manifest(root, lines)
    for leftover in root.rglob("*" + TEMPORARY_SUFFIX):
        leftover.unlink()
    return lines
