"""Pictures as files: encoded here alone, and written whole or not at all."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from storage.atomic import write_atomically

Kind = Literal["png", "jpeg"]


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
    write_atomically(path, encoded(image))
