"""Cross-section profiles: radius tables about the bones, and the coordinates that tie a skin to them.

A segment is a star-shaped piece of the body about an axis: a polyline along the bones (radius by station and
angle), or for the head a centre (radius by polar angle and azimuth). The skin is a fixed set of points in such
coordinates; another person's skin has the same coordinates over another radius table and another skeleton.
Only the left half (y >= 0) is described, the right one is its image.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

POINT_NAMES: tuple[str, ...] = (
    "trunk_low", "trunk_hip", "trunk_lumbar", "trunk_thorax", "trunk_shoulder", "trunk_top",
    "neck", "head", "inner", "shoulder", "deltoid", "elbow", "wrist", "knuckle",
    "thumb_0", "thumb_1", "thumb_2", "thumb_3",
    "index_0", "index_1", "index_2", "index_3",
    "middle_0", "middle_1", "middle_2", "middle_3",
    "ring_0", "ring_1", "ring_2", "ring_3",
    "little_0", "little_1", "little_2", "little_3",
    "hip", "knee", "ankle", "heel", "ball", "toe",
    "elbow_past", "elbow_before", "hip_before", "knee_past", "knee_before", "ankle_past", "wrist_before", "hem",
)  # fmt: skip
"""Points of the bind pose that the axes run through (left side)."""
POINT_IDX: dict[str, int] = {name: i for i, name in enumerate(POINT_NAMES)}
FINGERS: tuple[str, ...] = ("thumb", "index", "middle", "ring", "little")


@dataclass(frozen=True)
class Segment:
    """One star-shaped piece.

    Attributes:
        name: Its name.
        points: Names of the points of its axis; one for a sphere.
        counts: Intervals between stations along each bone of the axis; polar intervals for a sphere.
        n_angles: Samples around the axis: over the whole turn, or over the left half with both ends.
        is_half: Whether it is symmetric about y = 0 and only its left half is stored.
        toward: What angle 0 looks at: "x" (forward), or two point names from the first to the second.
    """

    name: str
    points: tuple[str, ...]
    counts: tuple[int, ...]
    n_angles: int
    is_half: bool = False
    toward: tuple[str, ...] = ("x",)


SEGMENTS: tuple[Segment, ...] = (
    Segment("trunk", POINT_NAMES[:6], (6, 7, 12, 18, 8), 37, is_half=True),
    Segment("head", ("head",), (48,), 41, is_half=True),
    Segment("neck", ("neck", "head"), (12,), 17, is_half=True),
    Segment("clavicle", ("inner", "shoulder", "deltoid"), (8, 4), 24),
    Segment("upper_arm", ("shoulder", "elbow", "elbow_past"), (18, 3), 24, toward=("elbow", "wrist")),
    Segment("forearm", ("elbow_before", "elbow", "wrist"), (3, 18), 24, toward=("elbow", "shoulder")),
    Segment("palm", ("wrist_before", "wrist", "knuckle"), (2, 10), 24, toward=("little_0", "index_0")),
    *(
        Segment(f, tuple(f"{f}_{k}" for k in range(4)), (4, 4, 4), 12, toward=("little_0", "index_0"))
        for f in FINGERS
    ),
    Segment("thigh", ("hip_before", "hip", "knee", "knee_past"), (6, 24, 3), 32),
    Segment("shank", ("knee_before", "knee", "ankle", "ankle_past"), (3, 24, 2), 24),
    Segment("foot", ("heel", "toe"), (24,), 32),
    Segment("skirt", ("hem", "trunk_hip", "trunk_lumbar"), (12, 6), 25, is_half=True),
)
SEGMENT_IDX: dict[str, int] = {segment.name: i for i, segment in enumerate(SEGMENTS)}
N_SEGMENTS = len(SEGMENTS)
N_BONES_MAX = max(len(s.counts) for s in SEGMENTS)


class Layout(NamedTuple):
    """The segments' shapes as arrays for the kernels.

    Attributes:
        start: (n_segments,) int64, first entry of each table in the flat array.
        n_stations: (n_segments,) int64 rows of each table.
        n_angles: (n_segments,) int64 columns.
        n_bones: (n_segments,) int64, 0 for a sphere.
        counts: (n_segments, n_bones_max) int64 intervals a bone.
        is_half: (n_segments,) bool.
    """

    start: NDArray[np.int64]
    n_stations: NDArray[np.int64]
    n_angles: NDArray[np.int64]
    n_bones: NDArray[np.int64]
    counts: NDArray[np.int64]
    is_half: NDArray[np.bool_]


class Axes(NamedTuple):
    """Where the axes are in one body's bind pose, root frame.

    Attributes:
        origin: (n_segments, n_bones_max, 3) start of each bone [m]; a sphere's centre.
        bone: (n_segments, n_bones_max, 3) from start to end [m].
        e1: (n_segments, n_bones_max, 3) unit vector of angle 0.
        e2: (n_segments, n_bones_max, 3) unit vector of angle 90 degrees.
    """

    origin: NDArray[np.float64]
    bone: NDArray[np.float64]
    e1: NDArray[np.float64]
    e2: NDArray[np.float64]


def _layout() -> Layout:
    counts = np.zeros((N_SEGMENTS, N_BONES_MAX), dtype=np.int64)
    for i, segment in enumerate(SEGMENTS):
        counts[i, : len(segment.counts)] = segment.counts
    n_stations = counts.sum(axis=1) + 1
    n_angles = np.array([s.n_angles for s in SEGMENTS], dtype=np.int64)
    size = n_stations * n_angles
    n_bones = np.array([len(s.points) - 1 for s in SEGMENTS], dtype=np.int64)
    is_half = np.array([s.is_half for s in SEGMENTS])
    return Layout(np.cumsum(size) - size, n_stations, n_angles, n_bones, counts, is_half)


LAYOUT = _layout()


def table_view(table: NDArray, name: str) -> NDArray:
    """One segment's (n_stations, n_angles) view of a flat table.

    Args:
        table: (table_size,) all segments.
        name: The segment.
    """
    i = SEGMENT_IDX[name]
    start, rows, columns = LAYOUT.start[i], LAYOUT.n_stations[i], LAYOUT.n_angles[i]
    return table[start : start + rows * columns].reshape(rows, columns)


def stations_of(name: str) -> NDArray[np.float64]:
    """(n_stations,) place of each station along the axis: bone number plus the fraction of that bone."""
    counts = SEGMENTS[SEGMENT_IDX[name]].counts
    return np.concatenate([b + np.arange(n) / n for b, n in enumerate(counts)] + [np.array([float(len(counts))])])


def angles_of(name: str) -> NDArray[np.float64]:
    """(n_angles,) angle of each column [rad]."""
    segment = SEGMENTS[SEGMENT_IDX[name]]
    if segment.is_half:
        return np.linspace(0.0, np.pi, segment.n_angles)
    return 2.0 * np.pi * np.arange(segment.n_angles) / segment.n_angles


def axes_through(points: NDArray[np.float64]) -> Axes:
    """Lays the axes through a body's points.

    Args:
        points: (n_points, 3) in the order of `POINT_NAMES` [m].
    """
    shape = (N_SEGMENTS, N_BONES_MAX, 3)
    axes = Axes(np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape))
    looks = np.tile((1.0, 0.0, 0.0), (N_SEGMENTS, N_BONES_MAX, 1))
    for i, segment in enumerate(SEGMENTS):
        at = points[[POINT_IDX[name] for name in segment.points]]
        if segment.toward != ("x",):
            looks[i] = points[POINT_IDX[segment.toward[1]]] - points[POINT_IDX[segment.toward[0]]]
        if len(at) == 1:
            axes.origin[i, 0], axes.bone[i, 0] = at[0], (0.0, 0.0, 1.0)
        else:
            axes.origin[i, : len(at) - 1], axes.bone[i, : len(at) - 1] = at[:-1], np.diff(at, axis=0)
    is_there = axes.bone.any(axis=2)
    along, look = axes.bone[is_there], looks[is_there]
    along /= np.linalg.norm(along, axis=1)[:, None]
    first = look - (look * along).sum(axis=1)[:, None] * along
    first /= np.linalg.norm(first, axis=1)[:, None]
    axes.e1[is_there], axes.e2[is_there] = first, np.cross(along, first)
    return axes


@njit(cache=True, nogil=True)
def radius_cell(layout: Layout, seg: int, station: float, angle: float) -> tuple[int, float, int, int, float]:
    """The cell of a segment's radii that a place lies in; stations beyond the ends count as the end's.

    Args:
        layout: `LAYOUT`.
        seg: Segment index.
        station: Station coordinate, 0..n_stations - 1.
        angle: [rad], -pi..2 pi.

    Returns:
        First row and the second one's weight, first column, second column and its weight.
    """
    n_s = layout.n_stations[seg]
    n_a = layout.n_angles[seg]
    s = min(max(station, 0.0), n_s - 1.0)
    i = min(int(s), n_s - 2)
    f = s - i
    if layout.is_half[seg]:
        a = min(abs(angle), np.pi) / np.pi * (n_a - 1)
        j = min(int(a), n_a - 2)
        k = j + 1
    else:
        a = (angle if angle >= 0.0 else angle + 2.0 * np.pi) / (2.0 * np.pi) * n_a
        j = int(a)
        a -= j - j % n_a
        j %= n_a
        k = (j + 1) % n_a
    return i, f, j, k, a - j


@njit(cache=True, nogil=True)
def radius_at(table: NDArray[np.float32], layout: Layout, seg: int, station: float, angle: float) -> float:
    """Bilinear look-up; stations beyond the ends take the end's radius.

    Args:
        table: (table_size,) [m].
        layout: `LAYOUT`.
        seg: Segment index.
        station: Station coordinate, 0..n_stations - 1.
        angle: [rad], -pi..2 pi.
    """
    i, f, j, k, g = radius_cell(layout, seg, station, angle)
    n_a = layout.n_angles[seg]
    row = layout.start[seg] + i * n_a
    low = (1.0 - g) * table[row + j] + g * table[row + k]
    high = (1.0 - g) * table[row + n_a + j] + g * table[row + n_a + k]
    return (1.0 - f) * low + f * high


@njit(cache=True, nogil=True)
def locate(
    axes: Axes, layout: Layout, seg: int, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Coordinates of a point about a segment's axis.

    Returns:
        Station coordinate (it runs past both ends), angle [rad], radius [m], and how far the point lies
        beyond the axis' ends [m] (0 between them and for a sphere).
    """
    if layout.n_bones[seg] == 0:
        dx = x - axes.origin[seg, 0, 0]
        dy = y - axes.origin[seg, 0, 1]
        dz = z - axes.origin[seg, 0, 2]
        r = np.sqrt(dx * dx + dy * dy + dz * dz)
        polar = np.arccos(min(max(dz / max(r, 1e-9), -1.0), 1.0))
        return polar / np.pi * (layout.n_stations[seg] - 1), np.arctan2(dy, dx), r, 0.0
    best = 1e30
    best_t = 0.0
    best_b = 0
    n = layout.n_bones[seg]
    for b in range(n):
        t = 0.0
        length2 = 0.0
        d2 = 0.0
        for c in range(3):
            p = (x, y, z)[c] - axes.origin[seg, b, c]
            t += p * axes.bone[seg, b, c]
            length2 += axes.bone[seg, b, c] ** 2
            d2 += p * p
        t /= length2
        clamped = min(max(t, 0.0), 1.0)
        dist2 = d2 - 2.0 * clamped * t * length2 + clamped * clamped * length2
        if dist2 < best - 1e-12:
            best, best_t, best_b = dist2, t, b
    t, b = best_t, best_b
    if not (b == 0 and t < 0.0) and not (b == n - 1 and t > 1.0):
        t = min(max(t, 0.0), 1.0)
    u = 0.0
    v = 0.0
    r2 = 0.0
    length2 = 0.0
    for c in range(3):
        p = (x, y, z)[c] - axes.origin[seg, b, c] - t * axes.bone[seg, b, c]
        u += p * axes.e1[seg, b, c]
        v += p * axes.e2[seg, b, c]
        r2 += p * p
        length2 += axes.bone[seg, b, c] ** 2
    station = t * layout.counts[seg, b]
    for k in range(b):
        station += layout.counts[seg, k]
    beyond = max(-t, t - 1.0, 0.0) * np.sqrt(length2)
    return station, np.arctan2(v, u), np.sqrt(r2), beyond
