"""Digested files: named arrays and JSON metadata in one safetensors file, with a SHA-256 over both.

Trained models, pose libraries and object libraries are such files; a `DigestedFormat` says which.
"""

import contextlib
import hashlib
import json
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import safetensors
import safetensors.numpy
from numpy.typing import NDArray

from storage.atomic import write_atomically
from storage.remote import get, url_of

_KEY = "undergrowth"
"""Of the one metadata entry: safetensors writes several in no fixed order."""
_MAX_HEADER_BYTES = 2**24
DTYPES: dict[str, np.dtype[Any]] = {
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
"""What a digested file may hold, by safetensors' names."""


@dataclass(frozen=True)
class DigestedFormat:
    """A sort of digested file.

    Attributes:
        name: As the files have it, such as "undergrowth model".
        version: Of the files that are written.
        noun: What errors call such a file: "model file".
        error: What is raised for a file that cannot be used; its message is one sentence that names the file.
        remedy: What to do about a file of another version, as the end of a sentence; "" if nothing can be.
        older: Versions that are read besides; those of any other are refused.
    """

    name: str
    version: int
    noun: str
    error: type[ValueError]
    remedy: str = ""
    older: tuple[int, ...] = ()

    @property
    def content(self) -> str:
        """What is in such a file: "model"."""
        return self.name.removeprefix("undergrowth ")

    @contextlib.contextmanager
    def naming_file(self, path: Path) -> Iterator[None]:
        """Turns whatever contents of the wrong shape raise into the format's error, which names the file.

        For the code that builds an object out of the JSON values and arrays of a file.
        """
        try:
            yield
        except KeyError as error:
            raise self.error(f"{path} holds no usable {self.content}: it lacks {error}") from None
        except (ValueError, TypeError, AttributeError, LookupError, ArithmeticError, RecursionError) as error:
            if isinstance(error, self.error) and str(path) in str(error):
                raise
            raise self.error(f"{path} holds no usable {self.content}: {error}") from None


class Contents(NamedTuple):
    """What a digested file holds.

    Attributes:
        kind: Which sort of the format, such as "oarf".
        arrays: By name; little endian, contiguous, writable.
        metadata: JSON values.
    """

    kind: str
    arrays: dict[str, np.ndarray]
    metadata: dict[str, Any]


def write_digested(
    path: Path, form: DigestedFormat, kind: str, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]
) -> None:
    """Writes a digested file; the same contents give the same bytes, whatever the order of the two mappings.

    Args:
        path: The file; replaced if there is one.
        form: Its format.
        kind: Which sort of the format.
        arrays: By name; integers, floats or booleans.
        metadata: JSON values; no NaN and no infinity.

    Raises:
        ValueError: An array or a value that the file cannot hold.
        OSError: It cannot be written.
    """
    plain = {name: np.asarray(values, order="C") for name, values in arrays.items()}
    for name, values in plain.items():
        if values.dtype not in DTYPES.values():
            raise ValueError(f"array {name} is {values.dtype}; a {form.noun} holds {', '.join(DTYPES)}")
    document = {
        "format": form.name,
        "format_version": form.version,
        "kind": kind,
        "metadata": metadata,
        "sha256": _digest(kind, plain, metadata),
    }
    write_atomically(path, safetensors.numpy.save(plain, {_KEY: _canonical(document)}))


def read_digested(path: Path, form: DigestedFormat, kind: str | None = None, is_mapped: bool = False) -> Contents:
    """Reads a digested file; a foreign one of any size is refused by its header, before it is read.

    Args:
        path: The file, or its URL.
        form: Its format.
        kind: The sort that is wanted; None takes any.
        is_mapped: Leave the arrays in the file and let the system read their pages as they are asked for; they can
            be written to, which does not change the file. For files that are replaced, never changed in place.

    Raises:
        ValueError: The format's error: no such file, no safetensors file, truncated, damaged, another program's,
            another version or kind.
    """
    if (url := url_of(path)) is not None:
        return _read_url(url, form, kind)
    with _told_as(path, form):
        document = _read_document(path, form)
        _refuse_others(path, form, document, kind)
        data = np.memmap(path, np.uint8, "c") if is_mapped else np.fromfile(path, np.uint8)
    try:
        arrays = _views(np.asarray(data))
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError):
        raise form.error(f"{path} is damaged: it holds an array of unknown type or size") from None
    contents = Contents(document["kind"], arrays, document["metadata"])
    try:
        is_whole = document.get("sha256") == _digest(*contents)
    except (ValueError, RecursionError):
        is_whole = False
    if not is_whole:
        raise form.error(f"{path} is damaged: its digest does not match its contents")
    return contents


def read_kind(path: Path, form: DigestedFormat) -> str:
    """The kind of a digested file, by its header; what follows the header is not looked at.

    Raises:
        ValueError: The format's error, as for `read_digested`.
    """
    if url_of(path) is not None:
        return read_digested(path, form).kind
    with _told_as(path, form):
        document = _read_document(path, form)
        _refuse_others(path, form, document, None)
    return str(document["kind"])


@contextlib.contextmanager
def _told_as(path: Path, form: DigestedFormat) -> Iterator[None]:
    """Turns what the system says of a file that is not there into the format's error."""
    try:
        yield
    except (FileNotFoundError, NotADirectoryError):
        raise form.error(f"there is no {form.noun} {path}") from None
    except IsADirectoryError:
        raise form.error(f"{path} is a folder, not a {form.noun}") from None


def _read_url(url: str, form: DigestedFormat, kind: str | None) -> Contents:
    """Reads a digested file at a URL, by way of a temporary one."""
    with tempfile.TemporaryDirectory(prefix="undergrowth-") as folder:
        path = Path(folder) / url.rsplit("/", 1)[-1]
        try:
            path.write_bytes(get(url))
        except OSError as error:
            raise form.error(f"the {form.noun} {url} cannot be read: {error.strerror}") from None
        return read_digested(path, form, kind)


def is_of_format(path: Path, form: DigestedFormat) -> bool:
    """Whether a file's header says that it is of a format; False of what cannot be read."""
    try:
        _read_document(path, form)
    except (OSError, form.error):
        return False
    return True


def _read_document(path: Path, form: DigestedFormat) -> dict[str, Any]:
    """Our metadata, from a header that safetensors found to fit the whole file."""
    with path.open("rb") as file:
        n_bytes = file.seek(0, 2)
        file.seek(0)
        n_header = int.from_bytes(file.read(8), "little")
    if n_bytes < 8 or n_header < 2 or n_header > _MAX_HEADER_BYTES:
        raise form.error(f"{path} is no {form.noun}: it is not in the safetensors format")
    if n_header > n_bytes - 8:
        raise form.error(f"{path} is truncated, or no {form.noun}: its header ends beyond its end")
    try:
        with safetensors.safe_open(path, "numpy") as opened:
            text = (opened.metadata() or {}).get(_KEY, "")
    except safetensors.SafetensorError as error:
        if "JSON" in str(error):
            raise form.error(f"{path} is no {form.noun}: its header is no JSON of safetensors") from None
        raise form.error(f"{path} is damaged or truncated: {error}") from None
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        document = None
    if not isinstance(document, dict) or document.get("format") != form.name:
        remedy = f"; of an older one, {form.remedy}" if form.remedy else ""
        raise form.error(f"{path} is no {form.name}: it lacks the metadata{remedy}")
    return document


def _refuse_others(path: Path, form: DigestedFormat, document: dict[str, Any], kind: str | None) -> None:
    version, given = document.get("format_version"), document.get("kind")
    if version not in (form.version, *form.older):
        remedy = f"; {form.remedy}" if form.remedy else ""
        read = " and ".join(map(str, sorted((form.version, *form.older))))
        raise form.error(f"{path} has format version {version}; this program reads version {read}{remedy}")
    if not isinstance(given, str) or not isinstance(document.get("metadata"), dict):
        raise form.error(f"{path} is damaged: its metadata is incomplete")
    if kind is not None and given != kind:
        raise form.error(f"{path} holds a {form.content} of kind {given!r}, must be {kind!r}")


def _views(data: NDArray[np.uint8]) -> dict[str, np.ndarray]:
    """The arrays of a whole file's bytes, not copied where they lie at multiples of their item size.

    safetensors hands out copies alone and does not tell the places, so they are read from its header here.
    """
    start = 8 + int.from_bytes(data[:8].tobytes(), "little")
    header = json.loads(data[8:start].tobytes())
    header.pop("__metadata__", None)
    arrays = {}
    for name, item in header.items():
        begin, end = item["data_offsets"]
        values = data[start + begin : start + end].view(DTYPES[item["dtype"]]).reshape(item["shape"])
        arrays[name] = values if values.flags.aligned else values.copy()
    return arrays


def _digest(kind: str, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> str:
    """SHA-256 over kind, metadata, and name, type, shape and bytes of every array."""
    names = sorted(arrays)
    table = [[name, arrays[name].dtype.str, arrays[name].shape] for name in names]
    digest = hashlib.sha256(_canonical([kind, metadata, table]).encode())
    for name in names:
        digest.update(arrays[name].reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


def _canonical(value: object) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
