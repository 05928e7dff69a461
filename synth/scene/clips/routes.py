"""Ways through the free floor of a room: shortest paths on a grid, pulled straight where nothing is in the way."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.scene.room.occupancy import CELL, Occupancy

STEP = 2
"""Paths go over cells of so many of the floor's cells."""


class Router:
    """Finds ways for something of a width.

    Args:
        floor: What is taken.
        radius: Half of the width that the way must have, beyond what `floor` leaves [m].
    """

    def __init__(self, floor: Occupancy, radius: float) -> None:
        wide = floor.copy()
        taken = np.argwhere(floor.is_taken)
        centres = (taken + 0.5 - 0.5 * np.array(floor.is_taken.shape)) * CELL
        wide.take(centres, radius)
        edge = int(np.ceil(radius / CELL))
        for k in (0, 1):
            rows = np.moveaxis(wide.is_taken, k, 0)
            rows[:edge] = True
            rows[len(rows) - edge :] = True
        self.floor = wide

    def is_free(self, place: NDArray[np.float64]) -> bool:
        """Whether a (2,) place is on a way [m]."""
        return self.floor.is_free(np.asarray(place, np.float64)[None])

    def draw_free(self, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """(n, 2) places on ways [m]; (0, 2) if there are none."""
        return self.floor.draw_free(n, rng)

    def path(self, start: NDArray[np.float64], goal: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """(m, 2) corners of a way [m], its ends included; None if there is none."""
        if not self.is_free(goal):
            return None
        if self.is_straight(start, goal):
            return np.stack([start, goal])
        is_taken = self.floor.is_taken
        coarse = is_taken[: len(is_taken) // STEP * STEP, : is_taken.shape[1] // STEP * STEP]
        coarse = np.asarray(coarse.reshape(len(coarse) // STEP, STEP, -1, STEP).any(axis=(1, 3)))
        begin, end = self._coarse(start, coarse), self._coarse(goal, coarse)
        if begin is None or end is None:
            return None
        cells = np.empty((coarse.size, 2), np.int64)
        n = _shortest(coarse, *begin, *end, cells)
        if n == 0:
            return None
        half = 0.5 * np.array(is_taken.shape)
        places = ((cells[:n][::-1] + 0.5) * STEP - half) * CELL
        return self._pulled(np.concatenate([start[None], places, goal[None]]))

    def is_straight(self, start: NDArray[np.float64], goal: NDArray[np.float64]) -> bool:
        """Whether the straight way is free."""
        n = 2 + int(np.hypot(*(goal - start)) / (0.5 * CELL))
        return self.floor.is_free(start + np.linspace(0.0, 1.0, n)[:, None] * (goal - start))

    def _coarse(self, place: NDArray[np.float64], coarse: NDArray[np.bool_]) -> tuple[int, int] | None:
        """The free coarse cell nearest to a free place, within three cells."""
        x, y = (self.floor.cells_of(place[None])[0] // STEP).tolist()
        best, least = None, 10.0
        for a in range(max(x - 3, 0), min(x + 4, len(coarse))):
            for b in range(max(y - 3, 0), min(y + 4, coarse.shape[1])):
                far = np.hypot(a - x, b - y)
                if not coarse[a, b] and far < least:
                    best, least = (a, b), far
        return best

    def _pulled(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Leaves out places between which the way is straight."""
        kept = [0]
        while kept[-1] < len(places) - 1:
            k = len(places) - 1
            while k > kept[-1] + 1 and not self.is_straight(places[kept[-1]], places[k]):
                k = kept[-1] + (k - kept[-1]) // 2 if k - kept[-1] > 8 else k - 1
            kept.append(k)
        return places[kept]


@njit(cache=True, nogil=True)
def _push(cost: NDArray[np.float64], cell: NDArray[np.int64], n: int, new_cost: float, new_cell: int) -> None:
    """Puts an entry into a heap of n entries, least cost first."""
    i = n
    while i > 0 and cost[(i - 1) // 2] > new_cost:
        cost[i], cell[i] = cost[(i - 1) // 2], cell[(i - 1) // 2]
        i = (i - 1) // 2
    cost[i], cell[i] = new_cost, new_cell


@njit(cache=True, nogil=True)
def _pop(cost: NDArray[np.float64], cell: NDArray[np.int64], n: int) -> int:
    """Takes the cell of the least cost out of a heap of n entries."""
    first = cell[0]
    last_cost, last_cell = cost[n - 1], cell[n - 1]
    i = 0
    while 2 * i + 1 < n - 1:
        child = 2 * i + 1
        if child + 1 < n - 1 and cost[child + 1] < cost[child]:
            child += 1
        if cost[child] >= last_cost:
            break
        cost[i], cell[i] = cost[child], cell[child]
        i = child
    cost[i], cell[i] = last_cost, last_cell
    return first


@njit(cache=True, nogil=True)
def _spread(
    is_taken: NDArray[np.bool_],
    start: int,
    goal_x: int,
    goal_y: int,
    far: NDArray[np.float64],
    came: NDArray[np.int64],
) -> None:
    """Goes out from a cell by A* (Hart, Nilsson & Raphael 1968) until the goal is reached.

    Args:
        is_taken: (n_x, n_y) bool.
        start: Number of the cell x n_y + y.
        goal_x: Goal.
        goal_y: Goal.
        far: (n_x, n_y) ways from the start, inf where none is known; changed.
        came: (n_x n_y,) number of the cell before each, -1 where there is none; changed.
    """
    n_x, n_y = is_taken.shape
    cost, cell = np.empty(8 * came.size + 1), np.empty(8 * came.size + 1, np.int64)
    is_done = np.zeros(came.size, np.bool_)
    far[start // n_y, start % n_y] = 0.0
    _push(cost, cell, 0, 0.0, start)
    n = 1
    while n > 0:
        here = _pop(cost, cell, n)
        n -= 1
        if is_done[here]:
            continue
        is_done[here] = True
        a, b = here // n_y, here % n_y
        if a == goal_x and b == goal_y:
            return
        for k in range(9):
            c, d = a + k // 3 - 1, b + k % 3 - 1
            if k == 4 or not (0 <= c < n_x and 0 <= d < n_y) or is_taken[c, d] or is_taken[a, d] or is_taken[c, b]:
                continue
            way = far[a, b] + np.hypot(c - a, d - b)
            if way < far[c, d]:
                far[c, d], came[c * n_y + d] = way, here
                _push(cost, cell, n, way + np.hypot(goal_x - c, goal_y - d), c * n_y + d)
                n += 1


@njit(cache=True, nogil=True)
def _shortest(
    is_taken: NDArray[np.bool_], x: int, y: int, goal_x: int, goal_y: int, cells: NDArray[np.int64]
) -> int:
    """Shortest way over free cells.

    Args:
        is_taken: (n_x, n_y) bool.
        x: Start.
        y: Start.
        goal_x: Goal.
        goal_y: Goal.
        cells: (n_x n_y, 2) int64, receives the way from the goal back to the start.

    Returns:
        How many cells the way has; 0 if there is none.
    """
    n_y = is_taken.shape[1]
    far, came = np.full(is_taken.shape, np.inf), np.full(is_taken.size, -1, np.int64)
    _spread(is_taken, x * n_y + y, goal_x, goal_y, far, came)
    if far[goal_x, goal_y] == np.inf:
        return 0
    count, cell = 0, goal_x * n_y + goal_y
    while cell >= 0:
        cells[count, 0], cells[count, 1] = cell // n_y, cell % n_y
        count += 1
        cell = came[cell]
    return count
