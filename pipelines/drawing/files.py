"""Pictures as files: encoded here alone, and written whole or not at all."""

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.targets import PNG_MARK
from storage.atomic import write_atomically

Kind = Literal["png", "jpeg"]
_AFTER_HEADER = 33
"""Where a PNG's first chunk, its header, ends."""


def encoded(image: NDArray, kind: Kind = "png", options: Sequence[int] = ()) -> bytes:
    """The bytes of an image's file.

    Args:
        image: (height, width) or (height, width, 3) BGR, uint8, or uint16 for "png".
        kind: "png" keeps every pixel; "jpeg" is smaller where an image has many colours.
        options: Of OpenCV's encoder, alternately names and values.

    Raises:
        UserError: An image that this kind of file cannot hold.
    """
    try:
        is_done, data = cv2.imencode(f".{kind}", np.ascontiguousarray(image), list(options))
    except cv2.error:
        is_done = False
    if not is_done:
        raise UserError(f"a {image.dtype} image of shape {image.shape} cannot be written as {kind.upper()}")
    return data.tobytes()


def write_picture(path: Path, image: NDArray) -> None:
    """Writes an image as a PNG file.

    Args:
        path: The file; its folder must be there.
        image: (height, width) or (height, width, 3) BGR, uint8 or uint16.

    Raises:
        OSError: The file cannot be written; names the path.
    """
    write_atomically(path, _marked(encoded(image)))


def _marked(png: bytes) -> bytes:
    """A PNG file with a text after its header that says who wrote it, by which it is known before it is replaced."""
    body = b"tEXt" + PNG_MARK
    chunk = struct.pack(">I", len(PNG_MARK)) + body + struct.pack(">I", zlib.crc32(body))
    return png[:_AFTER_HEADER] + chunk + png[_AFTER_HEADER:]
