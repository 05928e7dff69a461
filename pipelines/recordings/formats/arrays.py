"""Plain arrays: NumPy's files, and bare 16-bit integers."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError
from pipelines.recordings.formats.whole import check_pixels, read_whole

_NPY = b"\x93NUMPY"


def read_npy(path: Path) -> NDArray:
    """(height, width) integers or floats, as stored; axes of length 1 before or after are dropped.

    Raises:
        ForeignFileError: The file is damaged, something else, or no image of real numbers.
    """
    with path.open("rb") as file:
        if file.read(len(_NPY)) != _NPY:
            raise ForeignFileError(f"{path} is not a .npy file")
    try:
        # Mapped, so that a header cannot ask for more memory than the file has bytes.
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception:  # the header is a Python literal, whose parser raises anything
        raise ForeignFileError(f"{path} is damaged, or does not hold a plain array") from None
    shape = tuple(n for n in array.shape if n != 1) if array.ndim == 3 else array.shape
    if len(shape) != 2 or array.dtype.kind not in "iuf":
        raise ForeignFileError(
            f"{path} holds {array.dtype} of shape {array.shape}, must hold integers or floats of shape (height, width)"
        )
    check_pixels(path, shape[1], shape[0])
    return np.array(array.reshape(shape))


def read_raw(path: Path, width: int, height: int, big_endian: bool) -> NDArray[np.uint16]:
    """(height, width) uint16, as stored.

    Raises:
        ForeignFileError: The file has another number of bytes.
    """
    check_pixels(path, width, height)
    n_bytes, there = 2 * width * height, path.stat().st_size
    if there != n_bytes:
        raise ForeignFileError(f"{path} has {there} bytes; {width}x{height} pixels of 16 bits have {n_bytes}")
    values = np.frombuffer(read_whole(path), ">u2" if big_endian else "<u2").astype(np.uint16)
    return values.reshape(height, width)
