"""Zarr v3 shards, encoded and decoded with the codec libraries alone; zarr reads the same files.

Maps: sharding_indexed with one inner chunk a frame (bytes, blosc-zstd-shuffle, crc32c) and the index at the
end, as in the Zarr v3 specification of sharding; an all-zero map is an absent chunk. Other arrays: one plain chunk
a shard (bytes, crc32c). Writing a shard whole costs a tenth of zarr's own chunk by chunk pipeline.
"""

import itertools
import json
import os
from pathlib import Path

import google_crc32c
import numpy as np
from numcodecs import blosc  # type: ignore[import-untyped]

from pipelines.corpus.fields import SHARD_FRAMES, Field
from pipelines.errors import CorpusError

COMPRESSION_LEVEL = 2
BLOCK_BYTES = 524288
"""One block a map, byte shuffle: on real frames half the time of bit shuffle in 128 KiB blocks, and smaller."""
_ABSENT = 2**64 - 1
_LITTLE = {"name": "bytes", "configuration": {"endian": "little"}}
_CRC = {"name": "crc32c"}

blosc.use_threads = False  # one core a worker, and no lock of its own in each process; the bytes are the same


def group_metadata() -> str:
    """zarr.json of the group."""
    return json.dumps({"zarr_format": 3, "node_type": "group", "attributes": {}}, indent=1)


def array_metadata(item: Field, n_frames: int) -> str:
    """zarr.json of one array."""
    codecs: list[dict] = [_LITTLE, _CRC]
    if item.is_image:
        shuffled = {
            "typesize": item.numpy_dtype.itemsize,
            "cname": "zstd",
            "clevel": COMPRESSION_LEVEL,
            "shuffle": "shuffle",
            "blocksize": BLOCK_BYTES,
        }
        inner = [_LITTLE, {"name": "blosc", "configuration": shuffled}, _CRC]
        sharding = {
            "chunk_shape": list(item.chunk_shape),
            "codecs": inner,
            "index_codecs": [_LITTLE, _CRC],
            "index_location": "end",
        }
        codecs = [{"name": "sharding_indexed", "configuration": sharding}]
    chunk_shape = [SHARD_FRAMES, *item.shape]
    document = {
        "zarr_format": 3,
        "node_type": "array",
        "shape": [n_frames, *item.shape],
        "data_type": item.dtype,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": chunk_shape}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": 0.0 if item.dtype.startswith("float") else 0,
        "codecs": codecs,
        "attributes": {"unit": item.unit, "meaning": item.meaning},
        "dimension_names": ["frame", *(f"{item.name}_{i}" for i in range(len(item.shape)))],
    }
    return json.dumps(document, indent=1)


def shard_path(root: Path, item: Field, shard: int) -> Path:
    """File of one array's shard under the Zarr group."""
    return root / item.name / "c" / str(shard) / Path(*["0"] * len(item.shape))


def _with_crc(data: bytes) -> bytes:
    return data + google_crc32c.value(data).to_bytes(4, "little")


def _without_crc(data: bytes, what: str) -> bytes:
    if len(data) < 4 or google_crc32c.value(data[:-4]) != int.from_bytes(data[-4:], "little"):
        raise CorpusError(f"{what} is damaged: its checksum does not match")
    return data[:-4]


def encode_maps(item: Field, entry: np.ndarray) -> list[bytes]:
    """One frame's entry as inner chunks, one a layer; empty bytes for an all-zero map.

    Args:
        item: The array.
        entry: item.shape; of several layers the last ones may be left out, which are empty then.
    """
    if item.n_layers == 1:
        return [_encode_map(item, entry)]
    return [_encode_map(item, image) for image in entry] + [b""] * (item.n_layers - len(entry))


def _encode_map(item: Field, image: np.ndarray) -> bytes:
    if not image.any():
        return b""
    plain = np.ascontiguousarray(image, dtype=item.numpy_dtype)
    packed = blosc.compress(plain, b"zstd", COMPRESSION_LEVEL, blosc.SHUFFLE, BLOCK_BYTES)
    return _with_crc(packed)


def join_maps(item: Field, chunks: list[bytes]) -> bytes:
    """A shard of the inner chunks of up to 64 frames, index last."""
    index = np.full((item.n_chunks, 2), _ABSENT, dtype="<u8")
    offset = 0
    for slot, chunk in enumerate(chunks):
        if chunk:
            index[slot] = offset, len(chunk)
            offset += len(chunk)
    return b"".join(chunks) + _with_crc(index.tobytes())


def encode_plain(item: Field, values: np.ndarray) -> bytes:
    """A shard of a small array, zero-padded to 64 frames.

    Args:
        item: The array.
        values: (n <= 64, *item.shape).
    """
    full = np.zeros((SHARD_FRAMES, *item.shape), dtype=item.numpy_dtype)
    full[: len(values)] = values
    return _with_crc(full.tobytes())


def read_plain(path: Path, item: Field) -> np.ndarray:
    """(64, *item.shape) values of a small array's shard.

    Raises:
        CorpusError: The file is missing or damaged.
    """
    data = _without_crc(_read_file(path), str(path))
    shape = (SHARD_FRAMES, *item.shape)
    if len(data) != int(np.prod(shape)) * item.numpy_dtype.itemsize:
        raise CorpusError(
            f"{path} is damaged: it holds {len(data)} bytes, which is the wrong number for {shape} {item.dtype}"
        )
    return np.frombuffer(data, dtype=item.numpy_dtype).reshape(shape)


def read_maps(path: Path, item: Field, slots: list[int], first: int) -> np.ndarray:
    """Maps of some frames of one shard.

    Args:
        path: The shard's file.
        item: The array.
        slots: Places in the shard, 0..63.
        first: Number of the shard's first frame, for messages.

    Returns:
        (len(slots), *item.shape).

    Raises:
        CorpusError: The file is missing, or its index or one of the frames is damaged.
    """
    out = np.zeros((len(slots), *item.shape), dtype=item.numpy_dtype)
    layers = out if item.n_layers > 1 else out[:, None]
    n_index_bytes = item.n_chunks * 16 + 4
    try:
        with path.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - n_index_bytes))
            index_bytes = _without_crc(file.read(n_index_bytes), f"the index of {path}")
            if len(index_bytes) != n_index_bytes - 4:
                raise CorpusError(f"the index of {path} is damaged: it is cut short")
            index = np.frombuffer(index_bytes, dtype="<u8").reshape(SHARD_FRAMES, item.n_layers, 2)
            for (row, slot), layer in itertools.product(enumerate(slots), range(item.n_layers)):
                offset, n_bytes = (int(v) for v in index[slot, layer])
                if offset == _ABSENT:
                    continue
                if offset + n_bytes > size - n_index_bytes:
                    raise CorpusError(f"{item.name} of frame {first + slot} in {path} is damaged: it is cut short")
                file.seek(offset)
                what = f"{item.name} of frame {first + slot} in {path}"
                layers[row, layer] = _decode_map(file.read(n_bytes), item, what)
    except FileNotFoundError:
        raise CorpusError(f"{path} is missing") from None
    return out


def _decode_map(chunk: bytes, item: Field, what: str) -> np.ndarray:
    packed = _without_crc(chunk, what)
    if (
        int.from_bytes(packed[4:8], "little") != item.n_chunk_bytes
    ):  # blosc takes so much memory before it decompresses
        raise CorpusError(f"{what} is damaged: it holds another number of pixels")
    try:
        plain = np.frombuffer(blosc.decompress(packed), dtype=item.numpy_dtype)
        return plain.reshape(item.shape[-2:])
    except (RuntimeError, ValueError) as error:
        raise CorpusError(f"{what} is damaged: {error}") from None


def _read_file(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise CorpusError(f"{path} is missing") from None
