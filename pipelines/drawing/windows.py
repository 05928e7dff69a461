"""Windows: the part of an image that a picture shows, and how much larger."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.frames import Pinhole
from pipelines.drawing.palette import Picture
from synth.frame import Frame

_FARTHEST = 9999.0
"""Places farther outside are moved here, so that lines to them can be drawn [px]."""
_FRONT_M = 0.05
"""Points nearer than this, or behind the camera, are not drawn."""


@dataclass(frozen=True)
class Window:
    """A part of an image.

    Attributes:
        rows: Of the image.
        columns: Of the image.
        scale: Pixels of the picture to a pixel of the image.
    """

    rows: slice
    columns: slice
    scale: float

    @classmethod
    def fitted(cls, rows: slice, columns: slice, width: float, height: float = np.inf) -> "Window":
        """The window whose picture is as large as fits into a width and a height [px]."""
        scale = min(width / (columns.stop - columns.start), height / (rows.stop - rows.start))
        return cls(rows, columns, scale)

    def cut(self, image: Picture, is_smooth: bool = False) -> Picture:
        """The picture of an image.

        Args:
            image: (height, width, 3), of the whole image's size.
            is_smooth: Whether colours between those of neighbouring pixels may appear where it is enlarged.
        """
        part = image[self.rows, self.columns]
        size = (max(1, round(part.shape[1] * self.scale)), max(1, round(part.shape[0] * self.scale)))
        way = cv2.INTER_AREA if self.scale < 1 else cv2.INTER_LINEAR if is_smooth else cv2.INTER_NEAREST
        return np.asarray(cv2.resize(part, size, interpolation=way), dtype=np.uint8)

    def places(self, xyz: NDArray[np.floating], camera: Pinhole) -> NDArray[np.float64]:
        """Where points lie in the picture.

        Args:
            xyz: (n, 3) camera frame [m]; NaN = nowhere.
            camera: The image's.

        Returns:
            (n, 2) float64 (x, y) [px]; NaN where a point is nowhere, or not in front of the camera.
        """
        points = np.asarray(xyz, dtype=np.float64)
        x, y, z = np.where(points[:, 2:] > _FRONT_M, points, np.nan).T
        u = camera.fx * x / z + camera.cx + 0.5 - self.columns.start
        v = camera.fy * y / z + camera.cy + 0.5 - self.rows.start
        return np.clip(self.scale * np.stack([u, v], axis=1), -_FARTHEST, _FARTHEST)


def person_window(frame: Frame, zoom: float, width: int) -> Window:
    """The window around the whole body, of the image's proportions and inside it.

    Args:
        frame: The frame.
        zoom: Size over that of the body's box; 0 for the whole image.
        width: Of the picture [px].
    """
    rows, columns = _person_spans(frame, zoom)
    return Window.fitted(rows, columns, width)


def _person_spans(frame: Frame, zoom: float) -> tuple[slice, slice]:
    height, width = frame.depth.shape
    rows, columns = (np.flatnonzero((frame.body_part > 0).any(axis=axis)) for axis in (1, 0))
    if zoom <= 0 or not len(rows):
        return slice(0, height), slice(0, width)
    box = np.array([rows[-1] - rows[0] + 1, columns[-1] - columns[0] + 1])
    share = min(1.0, max(0.25, zoom * float((box / (height, width)).max())))
    size = np.array([round(share * height), round(share * width)])
    middle = np.array([rows[0] + rows[-1], columns[0] + columns[-1]]) // 2
    top, left = np.clip(middle - size // 2, 0, np.array([height, width]) - size)
    return slice(int(top), int(top + size[0])), slice(int(left), int(left + size[1]))


def foreground_window(
    depth: NDArray[np.uint16], width: float, height: float = np.inf, steepest: float = np.inf
) -> Window:
    """The window around all that a depth image shows; the whole image if it shows nothing.

    Args:
        depth: (height, width) [mm], 0 = nothing.
        width: Of the picture, at most [px].
        height: Of the picture, at most [px].
        steepest: Height over width of the window, at most, where the image's border allows it.
    """
    n_rows, n_columns = depth.shape
    rows, columns = (np.flatnonzero((depth > 0).any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return Window.fitted(slice(0, n_rows), slice(0, n_columns), width, height)
    margin = 2 + max(rows[-1] - rows[0], columns[-1] - columns[0]) // 16
    top, bottom = max(0, int(rows[0] - margin)), min(n_rows, int(rows[-1] + 1 + margin))
    left, right = int(columns[0] - margin), int(columns[-1] + 1 + margin)
    wider = max(0, round((bottom - top) / steepest) - (right - left))
    left, right = left - wider // 2, right + (wider + 1) // 2
    return Window.fitted(slice(top, bottom), slice(max(0, left), min(n_columns, right)), width, height)
