"""The implicit body that the template is polygonised from: a union of the segments, negative inside."""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from synth.bodies.shape.segments import Axes, Layout, locate, radius_at


@njit(cache=True, parallel=True)
def segment_distances(
    points: NDArray[np.float64],
    axes: Axes,
    layout: Layout,
    table: NDArray[np.float32],
    has_seams: NDArray[np.bool_],
    out: NDArray[np.float32],
) -> None:
    """How far points lie outside each segment along its radius; beyond an axis' end, outside its cap.

    Args:
        points: (n, 3) [m].
        axes: The body's axes.
        layout: `LAYOUT`.
        table: (table_size,) radii [m].
        has_seams: (n_segments,) whether the axis' ends lie inside other segments.
        out: (n, n_segments) overwritten [m].
    """
    for v in prange(points.shape[0]):
        for seg in range(out.shape[1]):
            station, angle, r, beyond = locate(axes, layout, seg, points[v, 0], points[v, 1], points[v, 2])
            limit = radius_at(table, layout, seg, station, angle)
            # Where a segment ends inside another it gives way, so that no edge shows.
            last = layout.n_stations[seg] - 1.0
            from_end = min(station, last - station) if has_seams[seg] else last
            give = max(1.0 - from_end / 5.0, 0.0)
            limit -= 0.010 * give * give
            out[v, seg] = max(r - limit, beyond) if beyond > 0.0 else r - limit


def union(distances: NDArray[np.float32], width: float) -> NDArray[np.float32]:
    """Smooth minimum over the segments: the two nearest are blended over `width` (quadratic, Quilez 2013).

    Args:
        distances: (n, n_segments) [m].
        width: Blend width [m].
    """
    two = np.partition(distances, 1, axis=1)[:, :2]
    h = np.maximum(width - (two[:, 1] - two[:, 0]), 0.0) / width
    return two[:, 0] - 0.25 * width * h * h
