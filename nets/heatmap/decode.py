"""From heat maps to places: the highest peaks, refined within their neighbourhoods."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from nets.heatmap.config import HeatCost

N_PEAKS = 3
REACH = 2
"""A peak's neighbourhood reaches so many cells to each side."""


class Peaks(NamedTuple):
    """Peaks of the maps of n_joints joints.

    Attributes:
        place: (n_joints, N_PEAKS, 3) float32: row and column [cells], depth [m]; NaN if there are no more.
        heat: (n_joints, N_PEAKS) float32, falling: the heat in the neighbourhood over that of the whole map, 0 if there
            are no more.
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
    order = np.argsort(-heat, axis=1, kind="stable")
    place, heat = np.take_along_axis(place, order[:, :, None], axis=1), np.take_along_axis(heat, order, axis=1)
    of_row, of_column = share.sum(axis=2), share.sum(axis=1)
    along_rows = (of_row * (np.arange(n_rows) - place[:, 0, :1]) ** 2).sum(axis=1)
    along_columns = (of_column * (np.arange(n_columns) - place[:, 0, 1:2]) ** 2).sum(axis=1)
    return Peaks(place, heat, np.sqrt((along_rows + along_columns) / 2.0).astype(np.float32))


@njit(cache=True, nogil=True)
def fill_peaks(share, depth, place, heat):  # type: ignore[no-untyped-def]
    """Kernel of `find_peaks`: the highest cell that is not near an earlier peak, and the mean about it."""
    n_joints, n_rows, n_columns = share.shape
    for joint in range(n_joints):
        is_taken = np.zeros((n_rows, n_columns), np.bool_)
        for peak in range(place.shape[1]):
            best, best_row, best_column = np.float32(0.0), -1, -1
            for r in range(n_rows):
                for c in range(n_columns):
                    if not is_taken[r, c] and share[joint, r, c] > best:
                        best, best_row, best_column = share[joint, r, c], r, c
            if best_row < 0:
                break
            total, row, column, far = 0.0, 0.0, 0.0, 0.0
            for r in range(max(0, best_row - REACH), min(n_rows, best_row + REACH + 1)):
                for c in range(max(0, best_column - REACH), min(n_columns, best_column + REACH + 1)):
                    if is_taken[r, c]:
                        continue
                    weight = share[joint, r, c]
                    total += weight
                    row += weight * r
                    column += weight * c
                    far += weight * depth[joint, r, c]
                    is_taken[r, c] = True
            place[joint, peak, 0] = row / total
            place[joint, peak, 1] = column / total
            place[joint, peak, 2] = far / total
            heat[joint, peak] = total
