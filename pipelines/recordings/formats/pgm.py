"""Portable grey maps of 16 bits: binary (P5, the higher byte first) and text (P2)."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError
from pipelines.recordings.formats.whole import check_pixels, read_whole

_NUMBER = rb"(?:\s|#[^\n]*\n)+(\d{1,9})"
_HEADER = re.compile(rb"(P[25])" + 3 * _NUMBER + rb"\s")
_COMMENT = re.compile(rb"#[^\n]*")


def read_pgm(path: Path) -> NDArray[np.uint16]:
    """(height, width) uint16, as stored.

    Raises:
        ForeignFileError: The file is damaged, something else, or has 8 bits a pixel.
    """
    data = read_whole(path)
    header = _HEADER.match(data)
    if header is None:
        raise ForeignFileError(f"{path} is not a PGM file of the kinds P5 and P2")
    width, height, largest = (int(header[k]) for k in (2, 3, 4))
    check_pixels(path, width, height)
    if not 255 < largest < 65536:
        raise ForeignFileError(
            f"{path} has values up to {largest}, must have 16 bits: its largest value in 256..65535"
        )
    n, body = width * height, data[header.end() :]
    if header[1] == b"P5":
        if len(body) < 2 * n:
            raise ForeignFileError(f"{path} is damaged: it has {len(body)} bytes of pixels, must have {2 * n}")
        values = np.frombuffer(body, ">u2", n).astype(np.uint16)
    else:
        words = _COMMENT.sub(b"", body).split(maxsplit=n)[:n] if len(body) >= 2 * n - 1 else []
        if len(words) < n:
            raise ForeignFileError(f"{path} is damaged: it has fewer than its {width}x{height} numbers")
        values = np.array([int(word) for word in words]).astype(np.uint16, casting="unsafe")
    return np.asarray(values.reshape(height, width))
