"""Organised PCD point clouds: the z field as an image; ascii, binary and binary_compressed (LZF)."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError, check_size
from pipelines.recordings.formats.whole import check_pixels, read_whole

_DATA = ("ascii", "binary", "binary_compressed")
_MAX_HEADER = 65536
_MOST_UNPACKED = 88
"""LZF makes at most so many bytes of one: 264 of three."""


def read_cloud_depth(path: Path) -> NDArray:
    """(height, width) z of an organised cloud's points as stored; NaN where there is none.

    Raises:
        ForeignFileError: No organised cloud with a field z, damaged, or too large.
    """
    header, body = _split(path, read_whole(path))
    try:
        points = _points(header)
        way = header["DATA"][0]
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise ForeignFileError(f"{path} is damaged: its PCD header cannot be read ({error})") from None
    if way not in _DATA or points.height < 2:
        raise ForeignFileError(
            f"{path} must be an organised cloud with a field z, stored as one of {', '.join(_DATA)}"
        )
    check_pixels(path, points.width, points.height)
    check_size(
        path, points.n * points.n_bytes, f"its {points.width}x{points.height} points of {points.n_bytes} bytes"
    )
    try:
        z = _READERS[way](body, points)
    except (ValueError, IndexError, UnicodeDecodeError) as error:
        raise ForeignFileError(f"{path} is damaged: {error}") from None
    return z.reshape(points.height, points.width)


class _Points(NamedTuple):
    """How the points of a cloud lie in its file.

    Attributes:
        width: Points of a row.
        height: Rows.
        n_columns: Numbers of a point.
        n_bytes: Bytes of a point.
        column: Which of the numbers is z.
        offset: Which of the bytes z begins at.
        kind: Type of z.
    """

    width: int
    height: int
    n_columns: int
    n_bytes: int
    column: int
    offset: int
    kind: np.dtype

    @property
    def n(self) -> int:
        """Number of points."""
        return self.width * self.height


def _points(header: dict[str, list[str]]) -> _Points:
    """What a header tells; no memory is taken for the columns that it promises."""
    names = header["FIELDS"]
    sizes = [int(size) for size in header["SIZE"]]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    if not len(names) == len(sizes) == len(counts) == len(header["TYPE"]):
        raise ValueError("its lines FIELDS, SIZE, TYPE and COUNT have different lengths")
    if min(counts, default=0) < 1 or not set(sizes) <= {1, 2, 4, 8}:
        raise ValueError("a field must have a size of 1, 2, 4 or 8 bytes and a count of at least 1")
    if "z" not in names or counts[names.index("z")] != 1:
        raise ValueError("there is no field z")
    z = names.index("z")
    kind = np.dtype(f"<{header['TYPE'][z].lower()}{sizes[z]}")
    if kind.kind not in "iuf":
        raise ValueError(f"z is of the type {header['TYPE'][z]}")
    ends = [size * count for size, count in zip(sizes, counts, strict=True)]
    width, height = int(header["WIDTH"][0]), int(header["HEIGHT"][0])
    return _Points(width, height, sum(counts), sum(ends), sum(counts[:z]), sum(ends[:z]), kind)


def _split(path: Path, content: bytes) -> tuple[dict[str, list[str]], bytes]:
    """Header lines by key, and what follows them."""
    header: dict[str, list[str]] = {}
    start = 0
    while "DATA" not in header:
        end = content.find(b"\n", start, start + 1001)
        if end < 0 or start > _MAX_HEADER:
            raise ForeignFileError(f"{path} is not a PCD file: its header has no end")
        words = content[start:end].decode("latin-1").split("#")[0].split()
        if words:
            header[words[0]] = words[1:]
        start = end + 1
    return header, content[start:]


def _read_text(body: bytes, points: _Points) -> NDArray:
    n_numbers = points.n * points.n_columns
    words = body.split() if len(body) >= 2 * n_numbers - 1 else []
    if len(words) != n_numbers:
        raise ValueError(f"it must hold {points.n} points of {points.n_columns} numbers")
    return np.array(words[points.column :: points.n_columns], dtype=np.float64)


def _read_binary(body: bytes, points: _Points) -> NDArray:
    n_bytes = points.n * points.n_bytes
    if len(body) < n_bytes:
        raise ValueError(f"it holds {len(body)} bytes of points, must hold {n_bytes}")
    rows = np.frombuffer(body, np.uint8, n_bytes).reshape(points.n, points.n_bytes)
    z = rows[:, points.offset : points.offset + points.kind.itemsize]
    return np.ascontiguousarray(z).view(points.kind)[:, 0]


def _read_packed(body: bytes, points: _Points) -> NDArray:
    if len(body) < 8:
        raise ValueError("its compressed points are cut short")
    n_packed, n_plain = (int(v) for v in np.frombuffer(body[:8], "<u4"))
    if n_plain != points.n * points.n_bytes or len(body) < 8 + n_packed or n_plain > _MOST_UNPACKED * n_packed:
        raise ValueError("its compressed points are cut short or have the wrong number")
    plain = np.empty(n_plain, np.uint8)
    if _unpack(np.frombuffer(body, np.uint8, n_packed, 8), plain) != n_plain:
        raise ValueError("its compressed points cannot be decompressed")
    # Packed points lie field by field.
    start = points.n * points.offset
    return plain[start : start + points.n * points.kind.itemsize].view(points.kind)


_READERS: dict[str, Callable[[bytes, _Points], NDArray]] = {
    "ascii": _read_text, "binary": _read_binary, "binary_compressed": _read_packed,
}  # fmt: skip


@njit(cache=True, nogil=True)
def _unpack(packed: NDArray[np.uint8], plain: NDArray[np.uint8]) -> int:
    """LZF: runs of literals, and copies of what was written before; bytes written, or -1 if damaged."""
    i, o = 0, 0
    while i < packed.size:
        control = int(packed[i])
        i += 1
        if control < 32:
            n = control + 1
            if i + n > packed.size or o + n > plain.size:
                return -1
            for k in range(n):
                plain[o + k] = packed[i + k]
            i += n
            o += n
            continue
        n = control >> 5
        if n == 7:
            if i >= packed.size:
                return -1
            n += int(packed[i])
            i += 1
        if i >= packed.size:
            return -1
        source = o - ((control & 31) << 8) - int(packed[i]) - 1
        i += 1
        n += 2
        if source < 0 or o + n > plain.size:
            return -1
        for k in range(n):
            plain[o + k] = plain[source + k]
        o += n
    return o
