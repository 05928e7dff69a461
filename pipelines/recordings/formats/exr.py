"""OpenEXR: the channel of depth, among others or alone."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError, check_size
from pipelines.recordings.formats.whole import check_pixels

DEPTH_CHANNELS = ("z", "depth", "y", "v")
"""What a channel of depth is called, the surest first; it may follow the name of a layer and a dot."""


def read_exr(path: Path) -> NDArray:
    """(height, width) floats, or integers of 32 bits, as stored.

    Raises:
        ForeignFileError: The file is damaged, something else, holds several samples a pixel, or no depth.
    """
    import OpenEXR

    with OpenEXR.File(str(path), header_only=True) as file:
        header = file.header()
        left_top, right_bottom = header["dataWindow"]
        n_channels, kind = len(header["channels"]), header["type"]
    width, height = (int(b) - int(a) + 1 for a, b in zip(left_top, right_bottom, strict=True))
    check_pixels(path, width, height)
    check_size(path, 4 * width * height * n_channels, f"its {n_channels} channels of {width}x{height} pixels")
    if kind in (OpenEXR.deepscanline, OpenEXR.deeptile):
        raise ForeignFileError(f"{path} is a deep image, which has several depths a pixel; flatten it")
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels() if len(file.parts) else {}
        image = None if not channels else np.array(channels[depth_channel(path, channels)].pixels)
    # A file that was cut short opens without a word, and lacks its channels.
    if image is None or image.shape != (height, width):
        raise ForeignFileError(f"{path} is damaged: its pixels cannot be read")
    return image


def depth_channel(path: Path, names: Iterable[str]) -> str:
    """Which channel holds depth: by its name, or the only one.

    Raises:
        ForeignFileError: None does, or several may.
    """
    listed = list(names)
    for end in (lambda name: name, lambda name: name.rpartition(".")[2]):
        for wanted in DEPTH_CHANNELS:
            found = [name for name in listed if end(name).lower() == wanted]
            if len(found) == 1:
                return found[0]
    if len(listed) == 1:
        return listed[0]
    raise ForeignFileError(
        f"{path} has the channels {', '.join(sorted(listed))}; one must be called {', '.join(DEPTH_CHANNELS)}"
    )
