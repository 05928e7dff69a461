"""PNG and TIFF: integers of 16 bits, and in TIFF also floats and wider integers."""

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError
from pipelines.recordings.formats.whole import check_pixels, read_whole

_PNG = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}
"""Of PNG's kinds of colour."""
_MOST_INFLATED = 1032
"""PNG's compression makes at most so many bytes of one."""
_TIFF = {b"II*\0": "<", b"MM\0*": ">", b"II+\0": "<", b"MM\0+": ">"}
"""How a TIFF begins, and the order of its bytes; + is BigTIFF."""
_WIDTH, _HEIGHT = 256, 257
_INTEGERS = {1: "B", 3: "H", 4: "I", 16: "Q"}
"""Types of TIFF's entries that hold whole numbers, as `struct` calls them."""


def read_png(path: Path) -> NDArray:
    """(height, width) uint16, as stored.

    Raises:
        ForeignFileError: The file is damaged, something else, or has several channels or fewer bits.
    """
    data = read_whole(path)
    if not data.startswith(_PNG):
        raise ForeignFileError(f"{path} is not a PNG file")
    _check_chunks(path, data)
    width, height, bits, colours = struct.unpack(">IIBB", data[16:26])
    check_pixels(path, width, height)
    _check_pixel(path, _CHANNELS.get(colours, 1), bits)
    if height * (2 * width + 1) > _MOST_INFLATED * len(data):
        raise ForeignFileError(f"{path} is damaged: its {len(data)} bytes cannot hold {width}x{height} pixels")
    return _decoded(path, data)


def read_tiff(path: Path) -> NDArray:
    """(height, width) integers of at least 16 bits or floats, as stored: the file's first image.

    Raises:
        ForeignFileError: The file is damaged, something else, or has several channels or fewer bits.
    """
    data = read_whole(path)
    if data[:4] not in _TIFF:
        raise ForeignFileError(f"{path} is not a TIFF file")
    check_pixels(path, *_tiff_size(path, data))
    return _decoded(path, data)


def _check_chunks(path: Path, data: bytes) -> None:
    """Makes sure that a PNG has its parts as they were written; decoders take memory for whatever lengths they say."""
    place, name = len(_PNG), b""
    while name != b"IEND":
        if len(data) < place + 12:
            raise ForeignFileError(f"{path} is damaged: the PNG is incomplete")
        (length,) = struct.unpack_from(">I", data, place)
        end = place + 8 + length
        if len(data) < end + 4:
            raise ForeignFileError(f"{path} is damaged: the PNG is incomplete")
        if place == len(_PNG) and (data[place + 4 : place + 8], length) != (b"IHDR", 13):
            raise ForeignFileError(f"{path} is damaged: the PNG does not begin with its header")
        name = data[place + 4 : place + 8]
        if zlib.crc32(data[place + 4 : end]) != struct.unpack_from(">I", data, end)[0]:
            raise ForeignFileError(f"{path} is damaged: a part of the PNG has another checksum than it says")
        place = end + 4


def _decoded(path: Path, data: bytes) -> NDArray:
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    finally:
        cv2.utils.logging.setLogLevel(level)
    if image is None:
        raise ForeignFileError(f"{path} is damaged: it cannot be decoded")
    _check_pixel(path, 1 if image.ndim == 2 else image.shape[2], 8 * image.itemsize)
    return np.asarray(image)


def _check_pixel(path: Path, n_channels: int, n_bits: int) -> None:
    if n_channels != 1:
        raise ForeignFileError(f"{path} has {n_channels} channels, must have one: depth")
    if n_bits < 16:
        raise ForeignFileError(f"{path} has {n_bits} bits a pixel, must have at least 16: depth")


def _tiff_size(path: Path, data: bytes) -> tuple[int, int]:
    """Width and height of a TIFF's first image, by its directory."""
    order, is_big = _TIFF[data[:4]], data[2:3] == b"+" or data[3:4] == b"+"
    try:
        (start,) = struct.unpack_from(order + ("Q" if is_big else "I"), data, 8 if is_big else 4)
        (n_entries,) = struct.unpack_from(order + ("Q" if is_big else "H"), data, start)
        first, length, value = (start + 8, 20, 12) if is_big else (start + 2, 12, 8)
        sizes: dict[int, int] = {}
        for place in range(first, first + length * min(n_entries, 4096), length):
            tag, kind = struct.unpack_from(order + "HH", data, place)
            if tag in (_WIDTH, _HEIGHT):
                (sizes[tag],) = struct.unpack_from(order + _INTEGERS[kind], data, place + value)
        return sizes[_WIDTH], sizes[_HEIGHT]
    except (struct.error, KeyError):
        raise ForeignFileError(f"{path} is damaged: its TIFF directory cannot be read") from None
