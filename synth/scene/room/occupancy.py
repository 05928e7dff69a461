"""Which parts of a floor are taken: a grid of cells, so that what stands on free cells cannot touch anything."""

from typing import Self

import numpy as np
from numpy.typing import NDArray

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
        cells = np.unique(self.cells_of(points), axis=0)
        reach = int(np.ceil(radius / CELL))
        i, j = np.mgrid[-reach : reach + 1, -reach : reach + 1]
        is_near = np.hypot(i, j) * CELL <= radius
        spread = (cells[:, None] + np.stack([i[is_near], j[is_near]], axis=1)).reshape(-1, 2)
        inside = spread[self._is_inside(spread)]
        self.is_taken[inside[:, 0], inside[:, 1]] = True

    def is_free(self, points: NDArray[np.float64]) -> bool:
        """Whether points (n, 2) [m] lie inside the rectangle, on free cells."""
        cells = self.cells_of(points)
        if not self._is_inside(cells).all():
            return False
        return not self.is_taken[cells[:, 0], cells[:, 1]].any()

    def draw_free(self, rng: np.random.Generator) -> NDArray[np.float64] | None:
        """(2,) a free place, all cells being equally likely [m]; None if there is none."""
        free = np.flatnonzero(~self.is_taken)
        if not len(free):
            return None
        cell = np.array(np.unravel_index(int(free[int(rng.integers(len(free)))]), self.is_taken.shape))
        return (cell + rng.random(2) - 0.5 * np.array(self.is_taken.shape)) * CELL

    def _is_inside(self, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
        return np.asarray(((cells >= 0) & (cells < np.array(self.is_taken.shape))).all(axis=1))


def footprint(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) one point for each cell that points (m, 3) stand over."""
    cells = np.floor(points[:, :2] / (0.5 * CELL)).astype(np.int64)
    keys = (cells[:, 0] << 32) + (cells[:, 1] & 0xFFFFFFFF)
    return points[np.unique(keys, return_index=True)[1], :2]
