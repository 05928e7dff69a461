"""Reads PLY files: ASCII, and binary in both byte orders.

Not with trimesh, which fans polygons where they are concave, and gives triangles only. (The package plyfile reads
polygons, but its licence, the GPL, is not one that we can ask for.)
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import check_size
from pipelines.importing.meshfiles.polygons import strip, triangulated
from synth.occluders.imported.shape import Triangles

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_LISTS = ("vertex_indices", "vertex_index")


@dataclass
class _Element:
    """An element of the header: its properties by name, lists as (type of the length, type of the items)."""

    name: str
    n: int
    types: dict[str, tuple[str, ...]]

    @property
    def least_bytes(self) -> int:
        """Size of a row with empty lists."""
        return sum(np.dtype(types[0]).itemsize for types in self.types.values())


Columns = dict[str, NDArray[np.float64] | list[list[int]]]


def read_ply(path: Path) -> Triangles:
    """The faces, or the triangle strips.

    Raises:
        ValueError: It is damaged, or has no faces.
        ForeignFileError: Its header promises more than there is memory for.
    """
    data = path.read_bytes()
    order, elements, start = _header(data)
    for element in elements:
        check_size(path, element.n * max(element.least_bytes, 1), f"its {element.n} rows of {element.name!r}")
    held = len(data) - start
    least = sum(e.n * (e.least_bytes if order else 2 * len(e.types)) for e in elements)
    if least > held + 1:
        raise ValueError(f"its header promises at least {least} bytes, but {held} follow")
    rows = _ascii_rows(data[start:], elements) if not order else _binary_rows(data, start, order, elements)
    found = dict(rows)
    vertex = found.get("vertex", {})
    if not {"x", "y", "z"} <= vertex.keys():
        raise ValueError("it has no vertices with x, y and z")
    points = np.stack([np.asarray(vertex[name], dtype=np.float64) for name in "xyz"], axis=1)
    polygons = next((found["face"][name] for name in _LISTS if name in found.get("face", {})), None)
    if polygons is not None:
        return Triangles(points, triangulated(points, polygons))  # type: ignore[arg-type]
    strips = next((found["tristrips"][name] for name in _LISTS if name in found.get("tristrips", {})), None)
    if strips is None:
        raise ValueError("it has no faces; a point cloud is no object")
    pieces = [piece for row in strips for piece in _pieces(row) if len(piece) >= 3]
    return Triangles(points, np.concatenate([np.empty((0, 3), np.int64), *(strip(np.array(p)) for p in pieces)]))


def _pieces(row: list[int]) -> Iterator[list[int]]:
    """The parts of a row between its -1."""
    piece: list[int] = []
    for k in [*row, -1]:
        if k >= 0:
            piece.append(k)
        else:
            yield piece
            piece = []


def _header(data: bytes) -> tuple[str, list[_Element], int]:
    """Byte order, elements, and where the rows begin."""
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise ValueError("it has no PLY header")
    start = data.find(b"\n", end) + 1 or len(data)
    order, elements = None, []
    for line in data[:end].decode("latin-1").splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2]), {}))
            elif words[:1] == ["property"]:
                kinds = words[2:4] if words[1] == "list" else words[1:2]
                elements[-1].types[words[-1]] = tuple(_TYPES[kind] for kind in kinds)
        except (KeyError, IndexError, ValueError):
            raise ValueError(f"its header has the line {line!r:.60}") from None
        if elements and elements[-1].n < 0:
            raise ValueError(f"its header promises {elements[-1].n} rows of {elements[-1].name!r}")
    if order is None:
        raise ValueError("its header has no line 'format'")
    return order, elements, start


def _ascii_rows(data: bytes, elements: list[_Element]) -> Iterator[tuple[str, Columns]]:
    words = iter(data.split())
    for element in elements:
        columns: dict[str, list] = {name: [] for name in element.types}
        for row in range(element.n):
            try:
                for name, types in element.types.items():
                    value = float(next(words))
                    columns[name].append(
                        value if len(types) == 1 else [int(next(words)) for _ in range(int(value))]
                    )
            except StopIteration:
                raise ValueError(f"it ends in row {row + 1} of {element.n} of {element.name!r}") from None
        yield element.name, columns  # type: ignore[misc]


def _binary_rows(data: bytes, start: int, order: str, elements: list[_Element]) -> Iterator[tuple[str, Columns]]:
    for element in elements:
        lists = [name for name, types in element.types.items() if len(types) == 2]
        if not element.n or not element.types:
            yield element.name, {name: [] for name in element.types}
            continue
        lengths = _first_lengths(data, start, order, element)
        row = _row_type(order, element, lengths)
        columns: Columns = {}
        rows = None
        if start + row.itemsize * element.n <= len(data):
            rows = np.frombuffer(data, row, element.n, start)
            if any((rows[f"{name} length"] != lengths[name]).any() for name in lists):
                rows = None
        if rows is not None:
            for name in element.types:
                columns[name] = rows[name].tolist() if name in lists else rows[name].astype(np.float64)
            start += row.itemsize * element.n
        else:
            columns, start = _row_by_row(data, start, order, element)
        yield element.name, columns


def _row_type(order: str, element: _Element, lengths: dict[str, int]) -> np.dtype:
    fields: list[tuple] = []
    for name, types in element.types.items():
        if len(types) == 2:
            fields.append((f"{name} length", order + types[0]))
        shape = (lengths[name],) if len(types) == 2 else ()
        fields.append((name, order + types[-1], shape))
    return np.dtype(fields)


def _first_lengths(data: bytes, start: int, order: str, element: _Element) -> dict[str, int]:
    """Lengths of the lists of an element's first row."""
    lengths = {}
    for name, types in element.types.items():
        if len(types) == 2:
            n = int(np.frombuffer(data, order + types[0], 1, start)[0])
            start += np.dtype(types[0]).itemsize
            if n < 0 or start + n * np.dtype(types[1]).itemsize > len(data):
                raise ValueError(f"a list of {element.name!r} promises {n} items, which the file does not hold")
            lengths[name] = n
            start += n * np.dtype(types[1]).itemsize
        else:
            start += np.dtype(types[0]).itemsize
    return lengths


def _row_by_row(data: bytes, start: int, order: str, element: _Element) -> tuple[Columns, int]:
    columns: dict[str, list] = {name: [] for name in element.types}
    for _ in range(element.n):
        lengths = _first_lengths(data, start, order, element)
        row = _row_type(order, element, lengths)
        values = np.frombuffer(data, row, 1, start)[0]
        for name in element.types:
            columns[name].append(values[name].tolist())
        start += row.itemsize
    return columns, start  # type: ignore[return-value]
