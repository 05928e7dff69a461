"""Recorded depth out of files of one image: as they store it, then in millimetres, if it can be depth."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError, reading
from pipelines.recordings.formats.arrays import read_npy, read_raw
from pipelines.recordings.formats.exr import read_exr
from pipelines.recordings.formats.pcd import read_cloud_depth
from pipelines.recordings.formats.pgm import read_pgm
from pipelines.recordings.formats.pictures import read_png, read_tiff
from pipelines.recordings.layout import Format, Layout
from pipelines.recordings.plausible import MAX_MM, judge_values, marked_as_nothing

DepthImage = NDArray[np.uint16]

READERS: dict[Format, tuple[str, Callable[[Path, Layout], NDArray]]] = {
    "png": ("a PNG file", lambda path, _: read_png(path)),
    "pgm": ("a PGM file", lambda path, _: read_pgm(path)),
    "tiff": ("a TIFF file", lambda path, _: read_tiff(path)),
    "exr": ("an OpenEXR file", lambda path, _: read_exr(path)),
    "npy": ("a .npy file", lambda path, _: read_npy(path)),
    "pcd": ("a PCD file", lambda path, _: read_cloud_depth(path)),
    "raw": (
        "a file of raw integers",
        lambda path, layout: read_raw(path, layout.width, layout.height, layout.big_endian),
    ),
}
"""By format, for files of one image: what they are called, and how they are read as stored."""

SUFFIXES: dict[str, Format] = {
    ".png": "png", ".npy": "npy", ".raw": "raw", ".bin": "raw", ".pcd": "pcd", ".h5": "itop", ".hdf5": "itop",
    ".pgm": "pgm", ".tif": "tiff", ".tiff": "tiff", ".exr": "exr",
}  # fmt: skip
"""What a file is taken for where no layout says it."""


def read_image(path: Path, layout: Layout) -> DepthImage:
    """(height, width) uint16 depth [mm] of a file that holds one image, 0 = nothing.

    Raises:
        UserError: The file is missing, damaged, of another format or size, or its values are no depths in the
            layout's unit.
    """
    values = read_values(path, layout)
    if values.shape != (layout.height, layout.width):
        size, given = f"{layout.width}x{layout.height}", "x".join(map(str, values.shape[::-1]))
        raise ForeignFileError(f"{path} has {given} pixels, but the layout says {size}")
    judge_values(str(path), values, layout)
    return in_millimetres(values, layout)


def read_values(path: Path, layout: Layout) -> NDArray:
    """(height, width) integers or floats of a file that holds one image, as they are stored.

    Raises:
        ForeignFileError: The file is missing, damaged, or of another format.
    """
    what, read = READERS[layout.format]
    with reading(path, what):
        values = read(path, layout)
    return values.byteswap() if layout.swap_bytes else values


def stored_unit(path: Path, layout: Layout) -> float:
    """The unit of what a file stores [mm]."""
    if layout.mm_per_unit is not None:
        return layout.mm_per_unit
    return 1000.0 if layout.format == "itop" else layout.unit_of(read_values(path, layout).dtype)


def in_millimetres(values: NDArray, layout: Layout) -> DepthImage:
    """Depth as a corpus has it; 0 where a value marks nothing, is not before the camera, or is beyond 65 m.

    Args:
        values: (height, width) integers or floats, as stored.
        layout: Their unit.
    """
    is_nothing = marked_as_nothing(values)
    unit = layout.unit_of(values.dtype)
    if values.dtype == np.uint16 and unit == 1.0:
        return np.where(is_nothing, 0, values).astype(np.uint16)
    with np.errstate(over="ignore", invalid="ignore"):
        mm = np.rint(np.where(is_nothing, 0.0, values.astype(np.float64)) * unit)
    return np.where((mm > 0) & (mm <= MAX_MM), mm, 0).astype(np.uint16)
