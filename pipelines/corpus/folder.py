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
from pipelines.corpus.manifest import (
    MANIFEST_NAME,
    ShardLine,
    part_path,
    part_paths,
    read_lines_of,
    read_manifest,
    rewrite_manifest,
)
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
def locked_folder(root: Path, is_shared: bool = False) -> Iterator[None]:
    """Holds the folder against a second writer; the lock goes with the process.

    Args:
        root: The folder.
        is_shared: Let others in who also share it: jobs that write different shards.

    Raises:
        UserError: Another process writes there, or has just renamed the folder.
    """
    handle = os.open(root, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, (fcntl.LOCK_SH if is_shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
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
        if foreign and not (root / HEADER_NAME).exists():  # else another job of an array has begun it just now
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
    """Shards that a manifest names and whose files are all there at full length; clears what else lies about.

    Manifests of the jobs of an array become part of the corpus' own.
    """
    parts = part_paths(root)
    lines = read_manifest(root, header)
    for part in parts:
        lines |= read_lines_of(part, header)
    lines = whole(root, header, lines)
    rewrite_manifest(root / MANIFEST_NAME, lines)
    for leftover in [*parts, *root.rglob("*" + TEMPORARY_SUFFIX)]:
        leftover.unlink()
    return lines


def whole(root: Path, header: Header, lines: dict[int, ShardLine]) -> dict[int, ShardLine]:
    """Those whose files are all there at full length."""
    return {
        shard: line
        for shard, line in lines.items()
        if all(
            path.is_file() and path.stat().st_size == line.n_bytes[name]
            for name, path in shard_files(root, header, shard).items()
        )
    }


@contextlib.contextmanager
def locked_part(root: Path, shards: range) -> Iterator[Path]:
    """The manifest of one job's shards, held against the same job begun twice, without a line that was cut off.

    Raises:
        UserError: Such a job is at work.
    """
    path = part_path(root, shards)
    with path.open("a+b") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UserError(
                f"the shards {shards.start}:{shards.stop} of {root} are being made by another command"
            ) from None
        file.seek(0)
        file.truncate(file.read().rfind(b"\n") + 1)
        yield path
