"""Mean shift with a Gaussian kernel on weighted points in space (Rafi et al. 2015, equations 5 and 6).

In two precisions. `find_modes` climbs in float64 with a kernel good to one millionth: what is learned once. The
`quick_` kernels climb in float32 with a kernel good to 0.2 %, lengths in bandwidths: what every image waits for.
With the exact ones an answer would take 1.4 times as long.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

MERGED = 0.5
"""What comes this near to a mode ends in it, in bandwidths: two points need 1.4 to have a mode each."""
TOLERANCE = 0.002
"""A step shorter than this arrives, in bandwidths."""
MAX_STEPS = 100
STRIDE = 1.5
"""Steps are so many times as long as to the mean: a quarter fewer are needed. Below 2 each still climbs, since the
mean is the top of a paraboloid, the same in all directions, that lies below the density and touches it."""

QUICK_MAX_STEPS = 30
QUICK_TOLERANCE = 0.01

_FLOOR = 32.0
"""Kernels are not below exp(-32): denormals cost ten times."""
_C0, _C1, _C2, _C3, _C4, _C5, _C6 = (
    0.9999999842436148,
    -0.9999984538078150,
    0.4999750912397937,
    -0.1665151670406369,
    0.0412233176717994,
    -0.0076543251018433,
    0.0008490078726027,
)
"""exp(-s) for s in [0, 1] at Chebyshev nodes, to 2e-8."""
_SUMS_IN_ANY_ORDER = {"reassoc", "contract", "nsz"}
"""So that sums vectorise: their last bits depend on the processor, never on the threads."""
_QUICK_SUMS = {"reassoc", "contract", "nsz", "arcp"}
"""Likewise; NaN and inf stay what they are."""


class WeightedPoints(NamedTuple):
    """Points in space.

    Attributes:
        x: (n,) float64 [m].
        y: (n,) float64 [m].
        z: (n,) float64 [m].
        weight: (n,) float64, at least 0.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    z: NDArray[np.float64]
    weight: NDArray[np.float64]


@njit(cache=True, nogil=True, inline="always")
def bell(squared: float) -> float:
    """exp(-32 squared) for squared in [0, 1], to one millionth of itself; it vectorises, unlike a call of exp."""
    s = squared
    e = _C0 + s * (_C1 + s * (_C2 + s * (_C3 + s * (_C4 + s * (_C5 + s * _C6)))))
    e *= e
    e *= e
    e *= e
    e *= e
    return e * e


@njit(cache=True, nogil=True, fastmath=_SUMS_IN_ANY_ORDER)
def shift(
    points: WeightedPoints, x: float, y: float, z: float, bandwidth: float
) -> tuple[float, float, float, float]:
    """One step of mean shift.

    Args:
        points: (n,) points.
        x: Where [m].
        y: Where [m].
        z: Where [m].
        bandwidth: b [m].

    Returns:
        (dx, dy, dz) to the mean of the points weighted with w exp(-|p - (x, y, z)|^2 / b^2) [m], and the sum of
        these weights; the step is 0 where the sum is.
    """
    px, py, pz, weight = points.x, points.y, points.z, points.weight
    scale = 1.0 / (_FLOOR * bandwidth * bandwidth)
    sum_x, sum_y, sum_z, density = 0.0, 0.0, 0.0, 0.0
    for i in range(len(px)):
        dx, dy, dz = px[i] - x, py[i] - y, pz[i] - z
        w = weight[i] * bell(min((dx * dx + dy * dy + dz * dz) * scale, 1.0))
        sum_x += w * dx
        sum_y += w * dy
        sum_z += w * dz
        density += w
    if density == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    return sum_x / density, sum_y / density, sum_z / density, density


@njit(cache=True, nogil=True)
def find_modes(points: WeightedPoints, bandwidth: float, n_starts: int, found: np.ndarray) -> int:
    """Finds the modes of the points' density, and how much weight ends in each.

    The points are cut into `n_starts` equal stretches, and the first of a stretch that weighs anything climbs for
    all of them. With as many starts as points, every point climbs for itself: this is the exact mean shift.

    Args:
        points: (n,) points; neighbours in the array should be alike.
        bandwidth: b [m].
        n_starts: Points that climb, at most.
        found: (min(n, n_starts) or more, 5) float64 to fill: x, y, z [m], the weight that ended there, and the
            density sum w exp(-|p - x|^2 / b^2) there.

    Returns:
        Number of modes found, in the order of the starts; their weights add up to that of all points.
    """
    n = len(points.x)
    n_climbs = min(n, n_starts)
    n_found = 0
    for k in range(n_climbs):
        begin, end = k * n // n_climbs, (k + 1) * n // n_climbs
        start, weight = -1, 0.0
        for i in range(begin, end):
            if start < 0 and points.weight[i] > 0.0:
                start = i
            weight += points.weight[i]
        if start < 0:
            continue
        mode = _climb(points, start, bandwidth, found, n_found)
        if mode == n_found:
            n_found += 1
        found[mode, 3] += weight
    return n_found


@njit(cache=True, nogil=True)
def _climb(points: WeightedPoints, start: int, bandwidth: float, found: np.ndarray, n_found: int) -> int:
    """Climbs from a point; returns the mode where it ends, `n_found` if it wrote a new one."""
    x, y, z, density = points.x[start], points.y[start], points.z[start], 0.0
    for _ in range(MAX_STEPS):
        mode = _mode_near(x, y, z, bandwidth, found, n_found)
        if mode >= 0:
            return mode
        dx, dy, dz, density = shift(points, x, y, z, bandwidth)
        x += STRIDE * dx
        y += STRIDE * dy
        z += STRIDE * dz
        if dx * dx + dy * dy + dz * dz < (TOLERANCE * bandwidth) ** 2:
            break
    mode = _mode_near(x, y, z, bandwidth, found, n_found)
    if mode >= 0:
        return mode
    found[n_found, 0], found[n_found, 1], found[n_found, 2] = x, y, z
    found[n_found, 3], found[n_found, 4] = 0.0, density
    return n_found


@njit(cache=True, nogil=True)
def _mode_near(x: float, y: float, z: float, bandwidth: float, found: np.ndarray, n_found: int) -> int:
    """The nearest mode within reach, or -1."""
    nearest, least = -1, (MERGED * bandwidth) ** 2
    for mode in range(n_found):
        dx, dy, dz = found[mode, 0] - x, found[mode, 1] - y, found[mode, 2] - z
        squared = dx * dx + dy * dy + dz * dz
        if squared < least:
            nearest, least = mode, squared
    return nearest


@njit(cache=True, nogil=True)
def keep_heaviest(found: np.ndarray, n_found: int, mode: np.ndarray, weight: np.ndarray) -> None:
    """Writes the modes in which most weight ended, heaviest first; of two that weigh the same, the denser first.

    Args:
        found: (n_found or more, 5) float64, of `find_modes`; the weights of those kept are lost.
        n_found: Modes.
        mode: (n_modes, 3) float32 to fill; rows beyond the last mode are left.
        weight: (n_modes,) float32 to fill, likewise.
    """
    for kept in range(min(n_found, len(weight))):
        best = 0
        for k in range(1, n_found):
            is_heavier = found[k, 3] > found[best, 3]
            if is_heavier or (found[k, 3] == found[best, 3] and found[k, 4] > found[best, 4]):
                best = k
        for axis in range(3):
            mode[kept, axis] = found[best, axis]
        weight[kept] = found[best, 3]
        found[best, 3] = -1.0


@njit(cache=True, nogil=True, inline="always")
def quick_bell(t: np.float32) -> np.float32:
    """exp(-t) for t >= 0 to 0.2 % up to t = 8, never below 1e-7: denormals cost ten times, and a call forty."""
    s = np.float32(1.0 / 256.0) * min(t, np.float32(16.0))
    p = np.float32(1.0) - s + np.float32(0.5) * s * s
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    p *= p
    return p * p


@njit(cache=True, nogil=True)
def quick_climb(cells: np.ndarray, start: int, modes: np.ndarray, n_modes: int) -> int:
    """Climbs from a point to a mode of the points' density.

    Args:
        cells: (4, n) float32: x, y, z in bandwidths, weight.
        start: Number of the point.
        modes: (more than n_modes, 4) float64: x, y, z, density; a new mode is added.
        n_modes: Modes that are known.

    Returns:
        Number of modes, one more than before unless it ends near one that is known.
    """
    x, y, z = cells[0, start], cells[1, start], cells[2, start]
    weight = np.float32(0.0)
    for _ in range(QUICK_MAX_STEPS):
        weight, sx, sy, sz = quick_sums(cells, x, y, z)
        nx, ny, nz = sx / weight, sy / weight, sz / weight
        step = (nx - x) ** 2 + (ny - y) ** 2 + (nz - z) ** 2
        x, y, z = nx, ny, nz
        for k in range(n_modes):
            if (x - modes[k, 0]) ** 2 + (y - modes[k, 1]) ** 2 + (z - modes[k, 2]) ** 2 < MERGED**2:
                return n_modes
        if step < QUICK_TOLERANCE**2:
            break
    modes[n_modes, 0], modes[n_modes, 1], modes[n_modes, 2], modes[n_modes, 3] = x, y, z, weight
    return n_modes + 1


@njit(cache=True, nogil=True, fastmath=_QUICK_SUMS)
def quick_sums(
    cells: np.ndarray, x: float, y: float, z: float
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Sums of w k, w k x, w k y, w k z over the cells, k = exp(-|x - x_i|^2), float32."""
    total, sx, sy, sz = np.float32(0.0), np.float32(0.0), np.float32(0.0), np.float32(0.0)
    cx, cy, cz, cw = cells[0], cells[1], cells[2], cells[3]
    for k in range(cells.shape[1]):
        dx, dy, dz = cx[k] - x, cy[k] - y, cz[k] - z
        w = cw[k] * quick_bell(dx * dx + dy * dy + dz * dz)
        total += w
        sx += w * cx[k]
        sy += w * cy[k]
        sz += w * cz[k]
    return total, sx, sy, sz
