"""Reads the arrays of a glTF file: interleaved, normalised integers, and sparse ones too."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError, check_size

_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_BYTES_PER_VALUE = 32
"""Memory that a value takes while a mesh is made of it."""


class Accessors:
    """The arrays of a document.

    Args:
        path: Of the file, for errors.
        tree: Its JSON.
        buffer: The bytes of a buffer by its number.
    """

    def __init__(self, path: Path, tree: dict[str, Any], buffer: Callable[[int], bytes]) -> None:
        self._path, self._tree, self._buffer = path, tree, buffer

    def read(self, k: int) -> NDArray[np.float64]:
        """(n,) or (n, width) values of an accessor; normalised integers are within 0..1 or -1..1.

        Raises:
            ValueError: It is damaged.
            ForeignFileError: It promises more than there is memory for, or is compressed.
        """
        accessor = self._tree["accessors"][_natural(k, "accessor")]
        kind = np.dtype(_COMPONENTS[accessor["componentType"]])
        width, n = _WIDTHS[accessor["type"]], _natural(accessor["count"], "count")
        check_size(self._path, _BYTES_PER_VALUE * n * width, f"what is made of the {n} rows of accessor {k}")
        if "bufferView" in accessor:
            offset = _natural(accessor.get("byteOffset", 0), "byteOffset")
            values = self._rows(accessor["bufferView"], offset, kind, n, width).copy()
        else:
            values = np.zeros((n, width), kind)
        if "sparse" in accessor:
            self._replace(values, accessor["sparse"], kind, width)
        out = values.astype(np.float64)
        if accessor.get("normalized", False) and kind.kind in "iu":
            out = np.maximum(out / np.iinfo(kind).max, -1.0)
        return out[:, 0] if width == 1 else out

    def view(self, k: int) -> bytes:
        """The bytes of a buffer view.

        Raises:
            ValueError: It is damaged.
            ForeignFileError: It is compressed.
        """
        view = self._tree["bufferViews"][_natural(k, "bufferView")]
        for name in view.get("extensions", {}):
            if "meshopt" in name:
                raise ForeignFileError(
                    f"{self._path} is meshopt-compressed, which is not read: write it again uncompressed"
                )
        data = self._buffer(view["buffer"])
        first, n = _natural(view.get("byteOffset", 0), "byteOffset"), _natural(view["byteLength"], "byteLength")
        if first + n > len(data):
            raise ValueError(f"view {k} ends at byte {first + n} of a buffer of {len(data)}")
        return data[first : first + n]

    def _rows(self, view: int, offset: int, kind: np.dtype, n: int, width: int) -> NDArray[Any]:
        data = self.view(view)
        stride = _natural(self._tree["bufferViews"][view].get("byteStride", 0), "byteStride")
        size = kind.itemsize * width
        stride = stride or size
        if stride < size:
            raise ValueError(f"a stride of {stride} bytes is less than a value's {size}")
        if n and offset + stride * (n - 1) + size > len(data):
            raise ValueError(f"{n} values do not fit into the {len(data)} bytes of view {view}")
        return np.ndarray((n, width), kind, data, offset, (stride, kind.itemsize))

    def _replace(self, values: NDArray[Any], sparse: dict[str, Any], kind: np.dtype, width: int) -> None:
        n, at = _natural(sparse["count"], "count"), sparse["indices"]
        where = self._rows(
            at["bufferView"], _natural(at.get("byteOffset", 0), "byteOffset"),
            np.dtype(_COMPONENTS[at["componentType"]]), n, 1,
        )[:, 0].astype(np.int64)  # fmt: skip
        if n and not (where.min() >= 0 and where.max() < len(values)):
            raise ValueError("a sparse accessor replaces values that are not there")
        new = sparse["values"]
        offset = _natural(new.get("byteOffset", 0), "byteOffset")
        values[where] = self._rows(new["bufferView"], offset, kind, n, width)


def _natural(value: Any, what: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ValueError(f"{what} is {value!r:.40}, must be a whole number from 0")
    return value
