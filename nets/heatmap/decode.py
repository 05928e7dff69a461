"""From heat maps to places: the neighbourhoods that hold most heat, and where in them it lies."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from nets.heatmap.config import HeatCost

N_PEAKS = 3
NEAR = 1
"""A peak's neighbourhood reaches so many cells to each side: about as far as a joint may be off."""
REACH = 2
"""Cells that are so near are asked where exactly the heat lies."""
WIDTH = 0.9
"""By weights that fall along a bell of this width [cells]."""
N_STEPS = 3
"""And so often from where they say."""


class Peaks(NamedTuple):
    """Peaks of the maps of n_joints joints.

    Attributes:
        place: (n_joints, N_PEAKS, 3) float32: row and column [cells], depth [m]; NaN if there are no more.
        heat: (n_joints, N_PEAKS) float32, falling: the share of the heat in the neighbourhood, 0 if there are no more.
        spread: (n_joints,) float32, standard deviation of the heat about the first peak along a row or column [cells].
    """

    place: NDArray[np.float32]
    heat: NDArray[np.float32]
    spread: NDArray[np.float32]


def shares_of(heat: NDArray[np.float32], kind: HeatCost) -> NDArray[np.float32]:
    """(n_joints, rows, columns) float32 of sum 1: how the heat of each map is spread; even where there is none."""
    values = heat.astype(np.float64)
    highest = values.max(axis=(1, 2), keepdims=True)
    values = np.maximum(values, 1e-9) if kind == "mse" else np.exp(values - highest)
    return (values / values.sum(axis=(1, 2), keepdims=True)).astype(np.float32)


def find_peaks(share: NDArray[np.float32], depth: NDArray[np.float32]) -> Peaks:
    """Finds the peaks of maps.

    Args:
        share: (n_joints, rows, columns) float32, see `shares_of`.
        depth: (n_joints, rows, columns) float32 [m].
    """
    n_joints, n_rows, n_columns = share.shape
    place = np.full((n_joints, N_PEAKS, 3), np.nan, np.float32)
    heat = np.zeros((n_joints, N_PEAKS), np.float32)
    fill_peaks(np.ascontiguousarray(share), np.ascontiguousarray(depth), place, heat)
    of_row, of_column = share.sum(axis=2), share.sum(axis=1)
    along_rows = (of_row * (np.arange(n_rows) - place[:, 0, :1]) ** 2).sum(axis=1)
    along_columns = (of_column * (np.arange(n_columns) - place[:, 0, 1:2]) ** 2).sum(axis=1)
    return Peaks(place, heat, np.sqrt((along_rows + along_columns) / 2.0).astype(np.float32))


@njit(cache=True, nogil=True)
def fill_peaks(share, depth, place, heat):  # type: ignore[no-untyped-def]
    """Kernel of `find_peaks`: the neighbourhood with most heat that was not counted, and the middle of its heat."""
    n_joints, n_rows, n_columns = share.shape
    for joint in range(n_joints):
        left = share[joint].copy()
        for peak in range(place.shape[1]):
            best, best_row, best_column = 0.0, -1, -1
            for r in range(n_rows):
                for c in range(n_columns):
                    total = 0.0
                    for y in range(max(0, r - NEAR), min(n_rows, r + NEAR + 1)):
                        for x in range(max(0, c - NEAR), min(n_columns, c + NEAR + 1)):
                            total += left[y, x]
                    if total > best and left[r, c] > 0.0:
                        best, best_row, best_column = total, r, c
            if best_row < 0:
                break
            at_row, at_column, far = float(best_row), float(best_column), 0.0
            for _ in range(N_STEPS):
                total, row, column, far = 0.0, 0.0, 0.0, 0.0
                for r in range(max(0, best_row - REACH), min(n_rows, best_row + REACH + 1)):
                    for c in range(max(0, best_column - REACH), min(n_columns, best_column + REACH + 1)):
                        square = (r - at_row) ** 2 + (c - at_column) ** 2
                        weight = left[r, c] * np.exp(-0.5 * square / WIDTH**2)
                        total += weight
                        row += weight * r
                        column += weight * c
                        far += weight * depth[joint, r, c]
                at_row, at_column, far = row / total, column / total, far / total
            place[joint, peak, 0] = at_row
            place[joint, peak, 1] = at_column
            place[joint, peak, 2] = far
            heat[joint, peak] = best
            left[
                max(0, best_row - NEAR) : best_row + NEAR + 1, max(0, best_column - NEAR) : best_column + NEAR + 1
            ] = 0
