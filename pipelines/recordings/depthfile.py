"""Depth images from single files: 16-bit PNG or .npy, integer millimetres, 0 = nothing."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.frames import check_depth
from pipelines.errors import UserError

_PNG, _NPY = b"\x89PNG\r\n\x1a\n", b"\x93NUMPY"


def read_depth(path: Path) -> NDArray[np.uint16]:
    """(height, width) uint16 [mm] out of a file.

    Raises:
        UserError: No such file, another format, damaged, or no depth image of integer millimetres.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise UserError(f"there is no file {path}") from None
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    if data.startswith(_PNG):
        return _png(path, data)
    if data.startswith(_NPY):
        return _npy(path)
    raise UserError(f"{path} is neither a PNG nor a .npy file")


def _png(path: Path, data: bytes) -> NDArray[np.uint16]:
    if b"IEND" not in data[-64:]:
        raise UserError(f"{path} is damaged: the PNG is incomplete")
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None:
        raise UserError(f"{path} is damaged: it cannot be decoded")
    if image.ndim != 2:
        raise UserError(f"{path} has {image.shape[2]} channels, must have one: depth in millimetres")
    if image.dtype != np.uint16:
        raise UserError(f"{path} has {8 * image.itemsize} bits a pixel, must have 16: depth in millimetres")
    return np.asarray(image, np.uint16)


def _npy(path: Path) -> NDArray[np.uint16]:
    try:
        # Mapped, so that a header cannot ask for more memory than the file has bytes.
        mapped = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, OSError, EOFError):
        raise UserError(f"{path} is damaged, or does not hold a plain array") from None
    try:
        return np.array(check_depth(mapped))
    except ValueError as error:
        raise UserError(f"{path}: {error}") from None
