"""Recorded depth out of files: PNG, .npy, raw integers, organised point clouds."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.recordings.depthfile import read_depth
from pipelines.recordings.layout import Format, Layout
from pipelines.recordings.pcd import read_cloud_depth

DepthImage = NDArray[np.uint16]
MAX_MM = 65535


def read_image(path: Path, layout: Layout) -> DepthImage:
    """(height, width) uint16 depth [mm] of a file that holds one image, 0 = nothing.

    Raises:
        UserError: The file is missing, damaged, of another format or size.
    """
    image = READERS[layout.format](path, layout)
    if image.shape != (layout.height, layout.width):
        size, given = f"{layout.width}x{layout.height}", "x".join(map(str, image.shape[::-1]))
        raise UserError(f"{path} has {given} pixels, but the layout says {size}")
    return image


def millimetres(metres: NDArray[np.floating]) -> DepthImage:
    """Depth in metres as stored; what is no number, not before the camera, or beyond 65 m is nothing."""
    mm = np.rint(np.nan_to_num(metres.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0) * 1000.0)
    return np.where((mm > 0) & (mm <= MAX_MM), mm, 0).astype(np.uint16)


def _scaled(image: NDArray[np.uint16], layout: Layout) -> DepthImage:
    if layout.mm_per_unit == 1.0:
        return image
    return millimetres(image * (layout.mm_per_unit / 1000.0))


def _plain(path: Path, layout: Layout) -> DepthImage:
    return _scaled(read_depth(path), layout)


def _npy(path: Path, layout: Layout) -> DepthImage:
    """Integers in the layout's unit, or floats in metres."""
    try:
        # Mapped, so that a header cannot ask for more memory than the file has bytes.
        image = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, OSError, EOFError):
        raise UserError(f"{path} is damaged, or does not hold a plain array") from None
    if image.dtype.kind == "f" and image.ndim == 2:
        return millimetres(image)
    return _plain(path, layout)


def _raw(path: Path, layout: Layout) -> DepthImage:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    n_bytes = 2 * layout.width * layout.height
    if len(data) != n_bytes:
        raise UserError(
            f"{path} has {len(data)} bytes; {layout.width}x{layout.height} pixels of 16 bits have {n_bytes}"
        )
    order = ">u2" if layout.big_endian else "<u2"
    return _scaled(np.frombuffer(data, order).astype(np.uint16).reshape(layout.height, layout.width), layout)


def _pcd(path: Path, layout: Layout) -> DepthImage:
    return millimetres(read_cloud_depth(path))


READERS: dict[str, Callable[[Path, Layout], DepthImage]] = {"png": _plain, "npy": _npy, "raw": _raw, "pcd": _pcd}
"""By format, for files of one image."""

SUFFIXES: dict[str, Format] = {
    ".png": "png", ".npy": "npy", ".raw": "raw", ".bin": "raw", ".pcd": "pcd", ".h5": "itop", ".hdf5": "itop",
}  # fmt: skip
"""What a file is taken for where no layout says it."""
