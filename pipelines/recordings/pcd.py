"""Organised PCD point clouds: the z field as an image; ascii, binary and binary_compressed (LZF)."""

from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.errors import UserError

_DATA = ("ascii", "binary", "binary_compressed")


def read_cloud_depth(path: Path) -> NDArray[np.float64]:
    """(height, width) z of an organised cloud's points [m]; NaN where there is none.

    Raises:
        UserError: No such file, no organised cloud with a field z, or damaged.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    header, body = _split(path, content)
    try:
        width, height = int(header["WIDTH"][0]), int(header["HEIGHT"][0])
        counts = [int(n) for n in header.get("COUNT", ["1"] * len(header["FIELDS"]))]
        columns = [
            (name if n == 1 else f"{name}_{k}", f"<{kind.lower()}{size}")
            for name, size, kind, n in zip(header["FIELDS"], header["SIZE"], header["TYPE"], counts, strict=True)
            for k in range(n)
        ]
        # Padding may repeat one name; numpy wants each once.
        dtype = np.dtype(
            [(name if name == "z" else f"{name}.{i}", kind) for i, (name, kind) in enumerate(columns)]
        )
        way = header["DATA"][0]
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise UserError(f"{path} is damaged: its PCD header cannot be read ({error})") from None
    if "z" not in (dtype.names or ()) or way not in _DATA or height < 2:
        raise UserError(f"{path} must be an organised cloud with a field z, stored as one of {', '.join(_DATA)}")
    try:
        z = _z_values(body, dtype, width * height, way)
    except (ValueError, IndexError) as error:
        raise UserError(f"{path} is damaged: {error}") from None
    return z.astype(np.float64).reshape(height, width)


def _split(path: Path, content: bytes) -> tuple[dict[str, list[str]], bytes]:
    """Header lines by key, and what follows them."""
    header: dict[str, list[str]] = {}
    rest = content
    while "DATA" not in header:
        line, end, rest = rest.partition(b"\n")
        if not end or len(line) > 1000:
            raise UserError(f"{path} is not a PCD file: its header has no end")
        words = line.decode("latin-1").split("#")[0].split()
        if words:
            header[words[0]] = words[1:]
    return header, rest


def _z_values(body: bytes, dtype: np.dtype, n: int, way: str) -> NDArray:
    """(n,) z in the file's type."""
    if way == "ascii":
        rows = np.array(body.decode("ascii").split(), dtype=np.float64)
        return rows.reshape(n, len(dtype.names or ()))[:, (dtype.names or ()).index("z")]
    if way == "binary":
        if len(body) < n * dtype.itemsize:
            raise ValueError(f"it holds {len(body)} bytes of points, must hold {n * dtype.itemsize}")
        return np.frombuffer(body, dtype, n)["z"]
    n_packed, n_plain = (int(v) for v in np.frombuffer(body[:8], "<u4"))
    if n_plain != n * dtype.itemsize or len(body) < 8 + n_packed:
        raise ValueError("its compressed points are cut short or have the wrong number")
    plain = np.empty(n_plain, np.uint8)
    if _unpack(np.frombuffer(body, np.uint8, n_packed, 8), plain) != n_plain:
        raise ValueError("its compressed points cannot be decompressed")
    # Packed points lie field by field.
    assert dtype.fields is not None
    kind, offset = dtype.fields["z"][:2]
    return plain[n * offset : n * (offset + kind.itemsize)].view(kind)


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
