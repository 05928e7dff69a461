"""Files and images that are judged by their sizes before memory is taken."""

import stat
from pathlib import Path

from pipelines.foreign import ForeignFileError, check_size

BYTES_PER_PIXEL = 16
"""What a pixel takes on its way from the file to its depth: the image as stored, as a real number, and regions."""


def read_whole(path: Path) -> bytes:
    """A file's contents.

    Raises:
        ForeignFileError: It is no regular file, or too large.
        OSError: It cannot be read.
    """
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise ForeignFileError(f"{path} is not a file")
    check_size(path, status.st_size, "its contents")
    return path.read_bytes()


def check_pixels(path: Path, width: int, height: int) -> None:
    """Refuses an image without pixels, or with more than memory should be taken for.

    Raises:
        ForeignFileError: Either.
    """
    if width < 1 or height < 1:
        raise ForeignFileError(f"{path} is damaged: its image has {width}x{height} pixels")
    check_size(path, width * height * BYTES_PER_PIXEL, f"its image of {width}x{height} pixels")
