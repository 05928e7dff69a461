"""Foreground crops of many depth images behind one another in one flat array: what the feature kernels read."""

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.frames import Hints, Pinhole

NOTHING = np.uint16(65535)
"""Depth of a pixel where nothing is, and of every read outside the crop [mm] (a large constant, as Shotton et al.
2011, section 3.2). Sensors of people do not see as far."""


class Crops(NamedTuple):
    """Crops with a border of one pixel of NOTHING, so that a read clamped to the crop is a read outside.

    Attributes:
        pixels: (n_pixels,) uint16 [mm], row-major crop after crop; NOTHING where nothing is.
        start: (n_frames,) int64, where a frame's crop starts in `pixels`.
        width: (n_frames,) int32, columns with the border.
        height: (n_frames,) int32, rows with the border.
        origin: (n_frames, 2) int32, (column, row) in the image of the crop's pixel (0, 0), border counted.
        intrinsics: (n_frames, 4) float32, (fx, fy, cx, cy) of the image [px].
        classes: (n_pixels,) uint8, `Hints.classes` as `pixels` has the depth, 0 in the border; empty without.
        facts: (n_frames, n_facts) int16, `Hints.facts`; empty without.
    """

    pixels: NDArray[np.uint16]
    start: NDArray[np.int64]
    width: NDArray[np.int32]
    height: NDArray[np.int32]
    origin: NDArray[np.int32]
    intrinsics: NDArray[np.float32]
    classes: NDArray[np.uint8] = np.zeros(0, np.uint8)
    facts: NDArray[np.int16] = np.zeros((0, 0), np.int16)


class CropWriter:
    """Collects crops one by one in a file, so that the frames need not fit into memory.

    Use it as a context manager; `finish` gives the crops, in memory if they are small, else mapped from
    the file.
    """

    def __init__(self, max_bytes_in_memory: int, folder: Path | None = None) -> None:
        self._max_bytes = max_bytes_in_memory
        self._file = tempfile.TemporaryFile(dir=folder, prefix="undergrowth-crops-")  # noqa: SIM115 closed by __exit__
        self._sizes: list[tuple[int, int]] = []
        self._origins: list[tuple[int, int]] = []
        self._intrinsics: list[tuple[float, float, float, float]] = []
        self._classes: list[NDArray[np.uint8]] = []
        self._facts: list[NDArray[np.int16]] = []

    def __enter__(self) -> "CropWriter":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, depth: NDArray[np.uint16], camera: Pinhole, hints: Hints | None = None) -> tuple[int, int]:
        """Adds an image's foreground.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Its intrinsics.
            hints: What trees are told beside it, of all images alike or of none; kept in memory.

        Returns:
            (column, row) in the image of the crop's pixel (0, 0).

        Raises:
            ValueError: Classes of another shape than the depth.
        """
        left, top, right, bottom = foreground_box(depth)
        crop = np.empty((bottom - top + 2, right - left + 2), np.uint16)
        cut_crop(depth, left, top, crop)
        self._file.write(crop.data)
        self._sizes.append((crop.shape[1], crop.shape[0]))
        self._origins.append((left - 1, top - 1))
        self._intrinsics.append((camera.fx, camera.fy, camera.cx, camera.cy))
        if hints is not None:
            self._facts.append(hints.facts)
            if hints.classes is not None and hints.classes.shape != depth.shape:
                shapes = f"{hints.classes.shape}, must be that of the depth, {depth.shape}"
                raise ValueError(f"hints have classes of shape {shapes}")
            if hints.classes is not None:
                self._classes.append(crop_classes(hints.classes, left - 1, top - 1, crop.shape))
        return left - 1, top - 1

    def finish(self) -> Crops:
        """All crops so far.

        Raises:
            ValueError: Hints of some of the images alone, or different ones.
        """
        sizes = np.array(self._sizes, np.int32).reshape(-1, 2)
        n_pixels = sizes.astype(np.int64).prod(axis=1)
        start = np.concatenate([np.zeros(1, np.int64), np.cumsum(n_pixels)])
        self._file.flush()
        self._file.seek(0)
        total = int(start[-1])
        if 2 * total <= self._max_bytes:
            pixels = np.fromfile(self._file, np.uint16, total)
        else:
            pixels = np.memmap(self._file, np.uint16, "r", shape=(total,)).view(np.ndarray)
        width, height = np.ascontiguousarray(sizes[:, 0]), np.ascontiguousarray(sizes[:, 1])
        origin = np.array(self._origins, np.int32).reshape(-1, 2)
        intrinsics = np.array(self._intrinsics, np.float32).reshape(-1, 4)
        return Crops(pixels, start[:-1], width, height, origin, intrinsics, *self._hints())

    def _hints(self) -> tuple[NDArray[np.uint8], NDArray[np.int16]]:
        """Classes and facts of all crops."""
        n, n_facts = len(self._sizes), {len(facts) for facts in self._facts}
        if len(self._classes) not in (0, n) or len(self._facts) not in (0, n) or len(n_facts) > 1:
            raise ValueError("hints must tell the same of all frames, or nothing of any")
        classes = np.concatenate(self._classes) if self._classes else np.zeros(0, np.uint8)
        return classes, np.stack(self._facts) if self._facts else np.zeros((0, 0), np.int16)


def crop_classes(classes: NDArray[np.uint8], left: int, top: int, size: tuple[int, ...]) -> NDArray[np.uint8]:
    """(height * width,) uint8: the part of `Hints.classes` under a crop with a border, where it is 0.

    Args:
        classes: Of an image.
        left: Column in the image of the crop's first column.
        top: Row in the image of the crop's first row.
        size: (height, width) of the crop.
    """
    height, width = size
    crop = np.zeros((height, width), np.uint8)
    crop[1:-1, 1:-1] = classes[top + 1 : top + height - 1, left + 1 : left + width - 1]
    return crop.reshape(-1)


def crop_image(depth: NDArray[np.uint16], camera: Pinhole) -> Crops:
    """One image's foreground as crops of one frame.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Its intrinsics.
    """
    left, top, right, bottom = foreground_box(depth)
    crop = np.empty((bottom - top + 2, right - left + 2), np.uint16)
    cut_crop(depth, left, top, crop)
    return Crops(
        crop.reshape(-1),
        np.zeros(1, np.int64),
        np.array([crop.shape[1]], np.int32),
        np.array([crop.shape[0]], np.int32),
        np.array([[left - 1, top - 1]], np.int32),
        np.array([[camera.fx, camera.fy, camera.cx, camera.cy]], np.float32),
    )


@njit(cache=True, nogil=True)
def foreground_box(depth: np.ndarray) -> tuple[int, int, int, int]:
    """(left, top, right, bottom) around all pixels that are not 0, right and bottom excluded; zeros if none."""
    height, width = depth.shape
    top, bottom, left, right = height, 0, width, 0
    for y in range(height):
        row = depth[y]
        first = 0
        while first < width and row[first] == 0:
            first += 1
        if first == width:
            continue
        last = width
        while row[last - 1] == 0:
            last -= 1
        top = min(top, y)
        bottom = y + 1
        left = min(left, first)
        right = max(right, last)
    if bottom == 0:
        return 0, 0, 0, 0
    return left, top, right, bottom


@njit(cache=True, nogil=True)
def cut_crop(depth: np.ndarray, left: int, top: int, crop: np.ndarray) -> None:
    """Copies the image from (left, top) on inside the border of `crop`; empty pixels become NOTHING."""
    height, width = crop.shape
    crop[0, :] = NOTHING
    crop[height - 1, :] = NOTHING
    for y in range(1, height - 1):
        crop[y, 0] = NOTHING
        crop[y, width - 1] = NOTHING
        for x in range(1, width - 1):
            value = depth[top + y - 1, left + x - 1]
            crop[y, x] = value if value != 0 else NOTHING
