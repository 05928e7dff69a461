"""Finds level surfaces of an upright mesh in the map of its highest points, seen from above."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import label

CELL = 0.01
"""Edge length of the map's cells [m]."""


@dataclass(frozen=True)
class Level:
    """A level surface.

    Attributes:
        centre: (3,) [m].
        size: Along x and y [m].
        shape: "rectangle", the largest in it, or "ellipse", if it is one.
        middle: (2,) centroid of the whole surface, of which the rectangle may be a part [m].
    """

    centre: NDArray[np.float64]
    size: tuple[float, float]
    shape: str
    middle: NDArray[np.float64]


def find_level(points: NDArray[np.float64], heights: tuple[float, float], tolerance: float) -> Level | None:
    """The largest surface that is level within a tolerance and has nothing above it.

    Args:
        points: (n, 3) all over the mesh, less than `CELL` apart [m].
        heights: Where it may be [m].
        tolerance: Largest difference of its heights [m].

    Returns:
        It, at the height that nine tenths of it do not pass; None if there is none.
    """
    origin = points[:, :2].min(axis=0)
    top = _top_map(points, origin)
    is_there = (top >= heights[0]) & (top <= heights[1])
    if not is_there.any():
        return None
    values = np.sort(top[is_there])
    n_within = np.searchsorted(values, values + tolerance, side="right") - np.arange(len(values))
    lowest = values[int(n_within.argmax())]
    parts, _ = label(is_there & (top >= lowest) & (top <= lowest + tolerance))
    is_level = parts == 1 + int(np.bincount(parts.ravel())[1:].argmax())
    cells = np.argwhere(is_level)
    first, size = cells.min(axis=0), np.ptp(cells, axis=0) + 1
    shape = "ellipse" if _is_ellipse(is_level, first, size) else "rectangle"
    if shape == "rectangle":
        i, j, i_end, j_end = _largest_rectangle(is_level)
        first, size = np.array([i, j]), np.array([i_end - i, j_end - j])
    z = float(np.quantile(top[is_level], 0.9))
    x, y = origin + CELL * (first + 0.5 * size)
    width = np.maximum(size - 1, 1) * CELL
    middle = origin + CELL * (cells.mean(axis=0) + 0.5)
    return Level(np.array([x, y, z]), (float(width[0]), float(width[1])), shape, middle)


def _top_map(points: NDArray[np.float64], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """Height of the highest point in each cell, -inf where there is none."""
    cells = np.floor((points[:, :2] - origin) / CELL).astype(np.int64)
    top = np.full(cells.max(axis=0) + 1, -np.inf)
    np.maximum.at(top, (cells[:, 0], cells[:, 1]), points[:, 2])
    return top


def _is_ellipse(is_level: NDArray[np.bool_], first: NDArray[np.int64], size: NDArray[np.int64]) -> bool:
    """Whether the cells fill the ellipse in their bounding box and nothing else, but for a rim of a cell."""
    if size.min() < 12:
        return False
    part = is_level[first[0] : first[0] + size[0], first[1] : first[1] + size[1]]
    x, y = ((np.arange(n) + 0.5 - 0.5 * n) / (0.5 * n) for n in size)
    rho = np.hypot(x[:, None], y[None, :])
    rim = 2.0 / size.min()
    return bool(part[rho < 1.0 - rim].mean() > 0.97 and part[rho > 1.0 + rim].mean() < 0.03)


@njit(cache=True, nogil=True)
def _largest_rectangle(is_in):  # type: ignore[no-untyped-def]
    """First and end indices (i, j, i_end, j_end) of the largest rectangle of true cells."""
    n, m = is_in.shape
    height = np.zeros(m, np.int64)
    best = (0, 0, 0, 0)
    area = 0
    for i in range(n):
        for j in range(m):
            height[j] = height[j] + 1 if is_in[i, j] else 0
        for j in range(m):
            lowest = height[j]
            for end in range(j + 1, m + 1):
                lowest = min(lowest, height[end - 1])
                if lowest == 0:
                    break
                if lowest * (end - j) > area:
                    area = lowest * (end - j)
                    best = (i + 1 - lowest, j, i + 1, end)
    return best
