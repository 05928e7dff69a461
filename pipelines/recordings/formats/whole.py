"""Files and images that are judged by their sizes before memory is taken."""

import stat
from pathlib import Path

from pipelines.foreign import ForeignFileError, check_size
from pipelines.recordings.layout import MAX_SIDE


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
    """Refuses an image without pixels, or with more than any camera has.

    Raises:
        ForeignFileError: Either.
    """
    if width < 1 or height < 1:
        raise ForeignFileError(f"{path} is damaged: its image has {width}x{height} pixels")
    if max(width, height) > MAX_SIDE:
        raise ForeignFileError(f"{path} has {width}x{height} pixels; at most {MAX_SIDE} a side are read")
