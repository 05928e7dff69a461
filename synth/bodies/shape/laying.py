"""Lays a skin over a body's axes and radii; what does not depend on the body is worked out once a skin."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.shape.segments import LAYOUT, Axes, Layout, radius_cell


class Laying(NamedTuple):
    """Where the points of a skin lie about the segments that hold them: an entry for each segment of each point.

    Attributes:
        start: (n + 1,) int64 first entry of each point.
        segment: (n_entries,) int64.
        bone: (n_entries,) int64 bone of the segment's axis; 0 for a sphere, which has none.
        share: (n_entries,) float64 how much of the point the segment holds; those of a point sum to 1.
        cell: (n_entries, 4) int64 places in the radius table: two columns of a row, then of the next row.
        blend: (n_entries, 2) float64 weight of the second row and of the second column.
        factor: (n_entries,) float64 radius over the table's.
        place: (n_entries, 4) float64 along the bone from 0 to 1, cosine and sine of the angle, 0; for a sphere sine
            and cosine of the polar angle stand first and last.
        is_sphere: (n_entries,) bool.
    """

    start: NDArray[np.int64]
    segment: NDArray[np.int64]
    bone: NDArray[np.int64]
    share: NDArray[np.float64]
    cell: NDArray[np.int64]
    blend: NDArray[np.float64]
    factor: NDArray[np.float64]
    place: NDArray[np.float64]
    is_sphere: NDArray[np.bool_]


def laying_of(segment: NDArray[np.int64], share: NDArray[np.float64], coords: NDArray[np.float64]) -> Laying:
    """Works out a skin's entries.

    Args:
        segment: (n, k) segments that hold each point, -1 for none.
        share: (n, k) how much each holds; rows sum to 1.
        coords: (n, k, 3) station, angle, radius over the table's.
    """
    is_held = segment >= 0
    start = np.concatenate([[0], np.cumsum(is_held.sum(axis=1))]).astype(np.int64)
    n = int(start[-1])
    out = Laying(
        start,
        segment[is_held],
        np.zeros(n, np.int64),
        share[is_held],
        np.zeros((n, 4), np.int64),
        np.zeros((n, 2)),
        coords[is_held][:, 2].copy(),
        np.zeros((n, 4)),
        np.zeros(n, np.bool_),
    )
    _fill(np.ascontiguousarray(coords[is_held]), LAYOUT, out)
    return out


@njit(cache=True, nogil=True)
def _fill(coords: NDArray[np.float64], layout: Layout, out: Laying) -> None:
    for e in range(coords.shape[0]):
        seg = out.segment[e]
        station, angle = coords[e, 0], coords[e, 1]
        i, f, j, k, g = radius_cell(layout, seg, station, angle)
        n_a = layout.n_angles[seg]
        row = layout.start[seg] + i * n_a
        out.cell[e] = (row + j, row + k, row + n_a + j, row + n_a + k)
        out.blend[e] = (f, g)
        out.place[e, 1], out.place[e, 2] = np.cos(angle), np.sin(angle)
        if layout.n_bones[seg] == 0:
            polar = station / (layout.n_stations[seg] - 1) * np.pi
            out.is_sphere[e] = True
            out.place[e, 0], out.place[e, 3] = np.sin(polar), np.cos(polar)
            continue
        b = 0
        while b < layout.n_bones[seg] - 1 and station > layout.counts[seg, b]:
            station -= layout.counts[seg, b]
            b += 1
        out.bone[e] = b
        out.place[e, 0] = station / layout.counts[seg, b]


@njit(cache=True, nogil=True)
def lay_skin(axes: Axes, laying: Laying, table: NDArray[np.float32], out: NDArray[np.float64]) -> None:
    """Puts the skin's points where a body's axes and radii say.

    Args:
        axes: The body's axes.
        laying: The skin's entries.
        table: (table_size,) the body's radii [m].
        out: (n, 3) overwritten, root frame [m].
    """
    for v in range(out.shape[0]):
        x, y, z = 0.0, 0.0, 0.0
        for e in range(laying.start[v], laying.start[v + 1]):
            seg, b, share = laying.segment[e], laying.bone[e], laying.share[e]
            f, g = laying.blend[e, 0], laying.blend[e, 1]
            low = (1.0 - g) * table[laying.cell[e, 0]] + g * table[laying.cell[e, 1]]
            high = (1.0 - g) * table[laying.cell[e, 2]] + g * table[laying.cell[e, 3]]
            r = laying.factor[e] * ((1.0 - f) * low + f * high)
            t, c, s = laying.place[e, 0], laying.place[e, 1], laying.place[e, 2]
            origin = axes.origin[seg, b]
            if laying.is_sphere[e]:
                flat = r * t
                x += share * (origin[0] + flat * c)
                y += share * (origin[1] + flat * s)
                z += share * (origin[2] + r * laying.place[e, 3])
                continue
            bone, e1, e2 = axes.bone[seg, b], axes.e1[seg, b], axes.e2[seg, b]
            x += share * (origin[0] + t * bone[0] + r * (c * e1[0] + s * e2[0]))
            y += share * (origin[1] + t * bone[1] + r * (c * e1[1] + s * e2[1]))
            z += share * (origin[2] + t * bone[2] + r * (c * e1[2] + s * e2[2]))
        out[v, 0], out[v, 1], out[v, 2] = x, y, z
