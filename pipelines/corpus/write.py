"""Writes one shard: the frames of 64 numbers, encoded, on the disk, with their digests."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np

from pipelines.corpus import shards
from pipelines.corpus.fields import stored_values
from pipelines.corpus.frameinfo import info_line, info_path, split_ids
from pipelines.corpus.header import Header
from pipelines.corpus.manifest import ShardLine
from pipelines.errors import UserError
from storage.atomic import write_all_atomically
from synth.frame import Frame, FrameInfo, RoomFrame, RoomInfo

ZARR_NAME = "arrays.zarr"


class FrameSource(Protocol):
    """What makes frames: each a function of the source's settings and the number alone."""

    def frame(self, index: int) -> Frame | RoomFrame:
        """Frame of that number.

        Raises:
            RuntimeError: The settings allow no such frame; the message says which to change.
        """
        ...


def shard_files(root: Path, header: Header, shard: int) -> dict[str, Path]:
    """Every file of a shard by array name, "info" last."""
    zarr_root = root / ZARR_NAME
    paths = {name: shards.shard_path(zarr_root, item, shard) for name, item in header.fields.items()}
    return paths | {"info": info_path(root, shard)}


def write_shard(
    root: Path, header: Header, source: FrameSource, shard: int, on_frame: Callable[[], object] | None = None
) -> ShardLine:
    """Makes the frames of one shard and writes its files; they are on the disk when this returns.

    Args:
        root: The corpus folder.
        header: Its header.
        source: Makes the frames.
        shard: The shard's number.
        on_frame: Called after each frame.

    Returns:
        The line that the manifest is owed.
    """
    fields = header.fields
    chunks: dict[str, list[bytes]] = {name: [] for name, item in fields.items() if item.is_image}
    values: dict[str, list[np.ndarray]] = {name: [] for name, item in fields.items() if not item.is_image}
    infos: list[FrameInfo | RoomInfo] = []
    lines: list[str] = []
    for index in header.frames_of(shard):
        frame = make_frame(source, index)
        _check_frame(frame, header, index)
        for name, value in stored(frame, header).items():
            if name in chunks:
                chunks[name] += shards.encode_maps(fields[name], value)
            else:
                values[name].append(value)
        infos.append(frame.info)
        lines.append(info_line(frame) + "\n")
        if on_frame is not None:
            on_frame()
    data = {name: shards.join_maps(fields[name], listed) for name, listed in chunks.items()}
    data |= {name: shards.encode_plain(fields[name], np.array(listed)) for name, listed in values.items()}
    data["info"] = "".join(lines).encode()
    paths = shard_files(root, header, shard)
    write_all_atomically({paths[name]: content for name, content in data.items()})
    return ShardLine(
        shard=shard,
        first=header.frames_of(shard).start,
        n_frames=len(infos),
        n_bytes={name: len(content) for name, content in data.items()},
        sha256={name: hashlib.sha256(content).hexdigest() for name, content in data.items()},
        splits=split_ids(infos),
    )


def stored(frame: Frame | RoomFrame, header: Header) -> dict[str, np.ndarray]:
    """A frame's entries by array name."""
    if isinstance(frame, RoomFrame):
        from pipelines.corpus.rooms.layers import room_values

        return room_values(frame, header.n_dof)
    return stored_values(frame)


def make_frame(source: FrameSource, index: int) -> Frame | RoomFrame:
    """A source's frame; what the settings do not allow becomes the user's error."""
    try:
        return source.frame(index)
    except RuntimeError as error:
        raise UserError(str(error)) from error


def _check_frame(frame: Frame | RoomFrame, header: Header, index: int) -> None:
    if frame.info.index != index or frame.info.seed != header.seed:
        raise ValueError(f"the source gave frame {frame.info.index} of seed {frame.info.seed} for {index}")
    if isinstance(frame, RoomFrame) != header.has_rooms:
        raise ValueError(f"the source gave a {type(frame).__name__} for schema version {header.schema_version}")
    for name, item in header.fields.items():
        value = getattr(frame, name, None)
        if value is not None and (value.shape != item.shape or value.dtype != item.dtype):
            raise ValueError(
                f"{name} of frame {index} is {value.shape} {value.dtype}, must be {item.shape} {item.dtype}"
            )
