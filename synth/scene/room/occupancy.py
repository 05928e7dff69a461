"""Which parts of a floor are taken: a grid of cells, so that what stands on free cells cannot touch anything."""

from typing import Self

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.geometry import extent

CELL = 0.05
"""Side of a cell [m]."""


class Occupancy:
    """Cells of a rectangle of floor around the origin.

    Args:
        length: Of the rectangle along x [m].
        width: Along y [m].

    Attributes:
        is_taken: (n_x, n_y) bool.
    """

    def __init__(self, length: float, width: float) -> None:
        self.length = length
        self.width = width
        self.is_taken: NDArray[np.bool_] = np.zeros((int(length / CELL), int(width / CELL)), np.bool_)

    def copy(self) -> Self:
        """A grid that may be changed while this one stays."""
        other = type(self)(self.length, self.width)
        other.is_taken = self.is_taken.copy()
        return other

    def cells_of(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """(n, 2) cells of points (n, 2) [m]; they may lie outside the grid."""
        half = 0.5 * CELL * np.array(self.is_taken.shape)
        return np.floor((points + half) / CELL).astype(np.int64)

    def take(self, points: NDArray[np.float64], radius: float) -> None:
        """Takes every cell within a radius of points (n, 2) [m]."""
        is_there = np.zeros(self.is_taken.shape, np.bool_)
        _spread(self.cells_of(points), int(np.ceil(radius / CELL)), (radius / CELL) ** 2, is_there, self.is_taken)

    def is_free(self, points: NDArray[np.float64]) -> bool:
        """Whether points (n, 2) [m] lie inside the rectangle, on free cells."""
        half = 0.5 * CELL * np.array(self.is_taken.shape)
        return bool(_are_free(np.asarray(points, dtype=np.float64), half, CELL, self.is_taken))

    def draw_free(self, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """(n, 2) free places, all free cells being equally likely [m]; (0, 2) if there are none."""
        free = np.flatnonzero(~self.is_taken)
        if not len(free):
            return np.empty((0, 2))
        cells = np.stack(np.unravel_index(free[rng.integers(len(free), size=n)], self.is_taken.shape), axis=1)
        return (cells + rng.random((n, 2)) - 0.5 * np.array(self.is_taken.shape)) * CELL


def footprint(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) one place [m] for each piece of floor, half a cell wide, that points (m, 3) stand over."""
    step = 0.5 * CELL
    least, most = extent(points)
    low = np.floor(least[:2] / step).astype(np.int64)
    high = np.floor(most[:2] / step).astype(np.int64)
    is_there = np.zeros(high - low + 1, np.bool_)
    _stand_over(points, step, low, is_there)
    return (np.argwhere(is_there) + low + 0.5) * step


@njit(cache=True, nogil=True)
def _are_free(
    points: NDArray[np.float64], half: NDArray[np.float64], cell: float, is_taken: NDArray[np.bool_]
) -> bool:
    """Whether all points (n, 2) [m] lie on free cells of a grid around the origin, half so long and wide [m]."""
    for i in range(points.shape[0]):
        x = int(np.floor((points[i, 0] + half[0]) / cell))
        y = int(np.floor((points[i, 1] + half[1]) / cell))
        if not (0 <= x < is_taken.shape[0] and 0 <= y < is_taken.shape[1]) or is_taken[x, y]:
            return False
    return True


@njit(cache=True, nogil=True)
def _stand_over(
    points: NDArray[np.float64], step: float, low: NDArray[np.int64], is_there: NDArray[np.bool_]
) -> None:
    """Marks the cells, counted from `low`, that points (n, 3) stand over."""
    for i in range(points.shape[0]):
        x = int(np.floor(points[i, 0] / step)) - low[0]
        y = int(np.floor(points[i, 1] / step)) - low[1]
        is_there[x, y] = True


@njit(cache=True, nogil=True)
def _spread(
    cells: NDArray[np.int64],
    reach: int,
    square: float,
    is_there: NDArray[np.bool_],
    is_taken: NDArray[np.bool_],
) -> None:
    """Takes all cells near some cells.

    Args:
        cells: (n, 2) int64, inside the grid or not.
        reach: Cells to go in every direction.
        square: Greatest square of a distance [cells].
        is_there: (n_x, n_y) bool zeros: cells inside that have been gone through.
        is_taken: (n_x, n_y) bool, changed.
    """
    n_x, n_y = is_taken.shape
    for i in range(cells.shape[0]):
        x, y = cells[i, 0], cells[i, 1]
        if 0 <= x < n_x and 0 <= y < n_y:
            if is_there[x, y]:
                continue
            is_there[x, y] = True
        for a in range(max(x - reach, 0), min(x + reach, n_x - 1) + 1):
            for b in range(max(y - reach, 0), min(y + reach, n_y - 1) + 1):
                if (a - x) * (a - x) + (b - y) * (b - y) <= square:
                    is_taken[a, b] = True
