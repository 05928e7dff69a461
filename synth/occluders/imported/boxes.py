"""Fills a mesh with boxes: its voxels, holes inside filled, put together greedily and drawn in to the surface."""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes

from synth.occluders.imported.shape import Triangles, sampled
from synth.occluders.model import BOX, Solids

CELLS = (0.008, 0.01, 0.0125, 0.016, 0.02, 0.025, 0.03)
"""Edge lengths of voxels that are tried until few enough boxes come out [m]."""
MAX_BOXES = 400
MIN_THICKNESS = 0.006
"""A sheet without thickness gets this one: to both sides if upright, downwards if level [m]."""


def fill_with_boxes(mesh: Triangles) -> NDArray[np.float64]:
    """(n, 6) lower and upper corners of boxes that cover a mesh's surface and what it encloses [m].

    No box sticks out by more than a voxel, and not at all where the surface is flat and parallel to an axis.

    Args:
        mesh: In metres, its own frame.
    """
    boxes = np.empty((0, 6))
    for cell in CELLS:
        boxes = _boxes(sampled(mesh, 0.5 * cell), cell)
        if len(boxes) <= MAX_BOXES:
            break
    middle = 0.5 * (boxes[:, :2] + boxes[:, 3:5])
    half = np.maximum(0.5 * (boxes[:, 3:5] - boxes[:, :2]), 0.5 * MIN_THICKNESS)
    low = np.minimum(boxes[:, 2], boxes[:, 5] - MIN_THICKNESS)
    return np.column_stack([middle - half, low, middle + half, boxes[:, 5]])


def solids_of(boxes: NDArray[np.float64]) -> Solids:
    """Boxes (n, 6) as solids."""
    T = np.tile(np.eye(4), (len(boxes), 1, 1))
    T[:, :3, 3] = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    return Solids(np.full(len(boxes), BOX, dtype=np.uint8), T, 0.5 * (boxes[:, 3:] - boxes[:, :3]))


def _boxes(points: NDArray[np.float64], cell: float) -> NDArray[np.float64]:
    origin = points.min(axis=0) - 0.25 * cell
    cells = np.floor((points - origin) / cell).astype(np.int64)
    shape = cells.max(axis=0) + 1
    low, high = np.full((*shape, 3), np.inf), np.full((*shape, 3), -np.inf)
    _stretch(points, cells, low, high)
    is_full = binary_fill_holes(np.isfinite(low[..., 0]))
    ranges = _merged(is_full)
    return _drawn_in(ranges, low, high, origin, cell)


@njit(cache=True, nogil=True)
def _stretch(points, cells, low, high):  # type: ignore[no-untyped-def]
    """Bounds of the points in each cell."""
    for p in range(len(points)):
        i, j, k = cells[p, 0], cells[p, 1], cells[p, 2]
        for axis in range(3):
            low[i, j, k, axis] = min(low[i, j, k, axis], points[p, axis])
            high[i, j, k, axis] = max(high[i, j, k, axis], points[p, axis])


@njit(cache=True, nogil=True)
def _is_all(is_full, box):  # type: ignore[no-untyped-def]
    for i in range(box[0], box[3]):
        for j in range(box[1], box[4]):
            for k in range(box[2], box[5]):
                if not is_full[i, j, k]:
                    return False
    return True


@njit(cache=True, nogil=True)
def _grown(is_full, box, axis):  # type: ignore[no-untyped-def]
    """Grows a box of full cells along an axis, both ways, while the next layer is full."""
    slab = np.empty(6, np.int64)
    while box[axis] > 0:
        slab[:] = box
        slab[axis], slab[axis + 3] = box[axis] - 1, box[axis]
        if not _is_all(is_full, slab):
            break
        box[axis] -= 1
    while box[axis + 3] < is_full.shape[axis]:
        slab[:] = box
        slab[axis], slab[axis + 3] = box[axis + 3], box[axis + 3] + 1
        if not _is_all(is_full, slab):
            break
        box[axis + 3] += 1


@njit(cache=True, nogil=True)
def _merged(is_full):  # type: ignore[no-untyped-def]
    """(n, 6) first and end indices of boxes that cover the full cells, the largest of six ways to grow each."""
    orders = np.array([[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]])
    is_covered = np.zeros(is_full.shape, np.bool_)
    out = np.empty((64, 6), np.int64)
    n = 0
    box = np.empty(6, np.int64)
    for i in range(is_full.shape[0]):
        for j in range(is_full.shape[1]):
            for k in range(is_full.shape[2]):
                if not is_full[i, j, k] or is_covered[i, j, k]:
                    continue
                if n == len(out):
                    more = np.empty((2 * n, 6), np.int64)
                    more[:n] = out
                    out = more
                largest = 0
                for order in orders:
                    box[:] = np.array([i, j, k, i + 1, j + 1, k + 1])
                    for axis in order:
                        _grown(is_full, box, axis)
                    volume = (box[3] - box[0]) * (box[4] - box[1]) * (box[5] - box[2])
                    if volume > largest:
                        largest = volume
                        out[n] = box
                b = out[n]
                is_covered[b[0] : b[3], b[1] : b[4], b[2] : b[5]] = True
                n += 1
    return out[:n]


def _drawn_in(
    ranges: NDArray[np.int64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    origin: NDArray[np.float64],
    cell: float,
) -> NDArray[np.float64]:
    """Boxes in metres; a side ends where the points of its outermost layer of cells do, if there are any."""
    out = np.empty((len(ranges), 6))
    for row, box in enumerate(ranges):
        for axis in range(3):
            cells = (slice(box[0], box[3]), slice(box[1], box[4]), slice(box[2], box[5]), axis)
            first = low[cells].take(0, axis=axis).min()
            last = high[cells].take(-1, axis=axis).max()
            out[row, axis] = first if np.isfinite(first) else origin[axis] + box[axis] * cell
            out[row, axis + 3] = last if np.isfinite(last) else origin[axis] + box[axis + 3] * cell
    return out
