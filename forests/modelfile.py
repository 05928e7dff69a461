"""Model files: named arrays and JSON metadata in one safetensors file, with a digest over both."""

import contextlib
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, cast

import numpy as np
import safetensors
import safetensors.numpy

FORMAT = "undergrowth model"
FORMAT_VERSION = 1

_KEY = "undergrowth"
"""Of the one metadata entry: safetensors writes several in no fixed order."""
_MAX_HEADER_BYTES = 2**24
_DTYPES: dict[str, np.dtype[Any]] = {
    "F64": np.dtype("<f8"),
    "F32": np.dtype("<f4"),
    "F16": np.dtype("<f2"),
    "I64": np.dtype("<i8"),
    "I32": np.dtype("<i4"),
    "I16": np.dtype("<i2"),
    "I8": np.dtype("i1"),
    "U64": np.dtype("<u8"),
    "U32": np.dtype("<u4"),
    "U16": np.dtype("<u2"),
    "U8": np.dtype("u1"),
    "BOOL": np.dtype("?"),
}
"""What a model file may hold, by safetensors' names."""


class ModelFileError(ValueError):
    """A file that is no model, or none that can be used. The message is one sentence that names the file."""


class ModelContents(NamedTuple):
    """What a model file holds.

    Attributes:
        kind: Which sort of model, such as "oarf".
        arrays: By name; little endian, contiguous, writable.
        metadata: JSON values.
    """

    kind: str
    arrays: dict[str, np.ndarray]
    metadata: dict[str, Any]


def write_model(path: Path, kind: str, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> None:
    """Writes a model file: beside, synced and renamed, so that it is whole or absent.

    The same contents give the same bytes, whatever the order of the two mappings.

    Args:
        path: The file; replaced if there is one.
        kind: Which sort of model.
        arrays: By name; integers, floats or booleans.
        metadata: JSON values; no NaN and no infinity.

    Raises:
        ValueError: An array or a value that the file cannot hold.
    """
    plain = {name: np.asarray(values, order="C") for name, values in arrays.items()}
    for name, values in plain.items():
        if values.dtype not in _DTYPES.values():
            raise ValueError(f"array {name} is {values.dtype}; a model file holds {', '.join(_DTYPES)}")
    document = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "kind": kind,
        "metadata": metadata,
        "sha256": _digest(kind, plain, metadata),
    }
    _replace(path, safetensors.numpy.save(plain, {_KEY: _canonical(document)}))


def read_model(path: Path, kind: str | None = None) -> ModelContents:
    """Reads a model file.

    Args:
        path: The file.
        kind: The sort of model that is wanted; None takes any.

    Raises:
        ModelFileError: No such file, no safetensors file, truncated, damaged, another program's, another version
            or kind.
    """
    try:
        with path.open("rb") as file:
            document = _read_document(path, file)
            file.seek(0)
            data = file.read()
    except (FileNotFoundError, NotADirectoryError):
        raise ModelFileError(f"there is no model file {path}") from None
    except IsADirectoryError:
        raise ModelFileError(f"{path} is a folder, not a model file") from None
    _refuse_others(path, document, kind)
    contents = ModelContents(document["kind"], _arrays(path, data), document["metadata"])
    try:
        is_whole = document.get("sha256") == _digest(*contents)
    except (ValueError, RecursionError):
        is_whole = False
    if not is_whole:
        raise ModelFileError(f"{path} is damaged: its digest does not fit its contents")
    return contents


def take_array(
    arrays: Mapping[str, np.ndarray], name: str, dtype: np.dtype | type, shape: tuple[int | None, ...]
) -> np.ndarray:
    """An array of a model file that must be there.

    Args:
        arrays: As they were read.
        name: Its name.
        dtype: What it must be.
        shape: What it must be; None where any length is right.

    Raises:
        ValueError: It is missing, or of another dtype or shape.
    """
    if name not in arrays:
        raise ValueError(f"array {name} is missing")
    values = arrays[name]
    fits = values.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, values.shape, strict=True))
    if values.dtype != dtype or not fits:
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise ValueError(f"array {name} is {values.dtype} {values.shape}, must be {np.dtype(dtype)} ({wanted})")
    return values


@contextlib.contextmanager
def naming_file(path: Path) -> Iterator[None]:
    """Turns a ValueError about the contents of a file into a ModelFileError that names the file."""
    try:
        yield
    except ModelFileError:
        raise
    except ValueError as error:
        raise ModelFileError(f"{path} holds no usable model: {error}") from None


def _read_document(path: Path, file: BinaryIO) -> dict[str, Any]:
    """Our metadata, from the header alone: a foreign file of any size is refused before it is read."""
    n_bytes = os.fstat(file.fileno()).st_size
    n_header = int.from_bytes(file.read(8), "little")
    if n_bytes < 8 or n_header < 2 or n_header > _MAX_HEADER_BYTES:
        raise ModelFileError(f"{path} is no model file: it is not in the safetensors format")
    if n_header > n_bytes - 8:
        raise ModelFileError(f"{path} is truncated, or no model file: its header ends beyond its end")
    try:
        header = json.loads(file.read(n_header))
    except (ValueError, RecursionError):
        raise ModelFileError(f"{path} is no model file: its header is no JSON") from None
    own = header.get("__metadata__") if isinstance(header, dict) else None
    try:
        document = json.loads(own[_KEY]) if isinstance(own, dict) else None
    except (KeyError, TypeError, ValueError, RecursionError):
        document = None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise ModelFileError(f"{path} is no undergrowth model: it lacks our metadata")
    return document


def _refuse_others(path: Path, document: dict[str, Any], kind: str | None) -> None:
    version, given = document.get("format_version"), document.get("kind")
    if version != FORMAT_VERSION:
        raise ModelFileError(f"{path} has format version {version}; this program reads version {FORMAT_VERSION}")
    if not isinstance(given, str) or not isinstance(document.get("metadata"), dict):
        raise ModelFileError(f"{path} is damaged: its metadata is incomplete")
    if kind is not None and given != kind:
        raise ModelFileError(f"{path} holds a model of kind {given!r}, must be {kind!r}")


def _arrays(path: Path, data: bytes) -> dict[str, np.ndarray]:
    arrays = {}
    try:
        for name, item in cast("list[tuple[str, dict[str, Any]]]", safetensors.deserialize(data)):
            flat = np.frombuffer(item["data"], _DTYPES[item["dtype"]])
            arrays[name] = flat.reshape(item["shape"]).copy()
    except safetensors.SafetensorError as error:
        raise ModelFileError(f"{path} is damaged or truncated: {error}") from None
    except (KeyError, ValueError, OverflowError):
        raise ModelFileError(f"{path} is damaged: it holds an array of unknown type or size") from None
    return arrays


def _digest(kind: str, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> str:
    """SHA-256 over kind, metadata, and name, type, shape and bytes of every array."""
    names = sorted(arrays)
    table = [[name, arrays[name].dtype.str, arrays[name].shape] for name in names]
    digest = hashlib.sha256(_canonical([kind, metadata, table]).encode())
    for name in names:
        digest.update(arrays[name].tobytes())
    return digest.hexdigest()


def _canonical(value: object) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _replace(path: Path, data: bytes) -> None:
    temporary = path.with_name(path.name + ".tmp")
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
