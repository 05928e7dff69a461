"""Modes of a joint's votes: mean shift with a Gaussian kernel (Rafi et al. 2015, equation 6) on cells of votes.

The votes are summed up in cells of a fraction of the bandwidth, each of which acts as one vote at its centroid;
the result differs from that of the single votes by far less than the bandwidth (see docs/predicting.md).
"""

import numpy as np
from numba import njit

CELL = 0.5
"""Side of a cell, in bandwidths."""
BASIN = 2.0
"""Votes this near to a mode count for its spread and its share of occluder votes, in bandwidths."""
N_EXTRA_STARTS = 2
"""Starts beside one for each proposal."""
MAX_STEPS = 30
TOLERANCE = 0.01
"""A start has arrived when its last step was shorter than this, in bandwidths."""
MERGED = 0.5
"""Modes nearer than this are one, in bandwidths."""

_SUMS = {"reassoc", "contract", "nsz", "arcp"}
"""Float sums in any order, so that they vectorise; NaN and inf stay what they are."""


@njit(cache=True, nogil=True, inline="always")
def bell(t: np.float32) -> np.float32:
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
def find_peaks(
    votes: np.ndarray, count: np.ndarray, n_layers: int, bandwidth: np.ndarray, proposals: np.ndarray,
    density: np.ndarray, spread: np.ndarray, occluder_share: np.ndarray,
) -> None:  # fmt: skip
    """Finds the modes of all joints' votes.

    Args:
        votes: (n_joints * n_layers, capacity, 4) float32: x, y, z [m], weight.
        count: (n_joints * n_layers,) int64: the first so many of a stream are votes.
        n_layers: Streams of a joint; the second is cast by occluder modes.
        bandwidth: (n_joints,) float32, b_j [m].
        proposals: (n_joints, n_proposals, 3) float32 to fill, densest first [m]; NaN where missing.
        density: (n_joints, n_proposals) float32 to fill: sum of w exp(-|x - x_i|^2 / b_j^2); 0 where missing.
        spread: (n_joints,) float32 to fill: weighted standard deviation of the votes around the first mode [m].
        occluder_share: (n_joints,) float32 to fill: share of these votes' weight that occluder modes cast.
    """
    most = 0
    n_joints = len(bandwidth)
    for joint in range(n_joints):
        n = 0
        for stream in range(joint * n_layers, (joint + 1) * n_layers):
            n += count[stream]
        most = max(most, n)
    n_slots = 16
    while n_slots < 2 * most:
        n_slots *= 2
    table = np.full(n_slots, -1, np.int32)
    slots, keys = np.empty(most, np.int32), np.empty((most, 3), np.int32)
    sums = np.empty((most, 6), np.float64)
    for joint in range(n_joints):
        cell = bandwidth[joint] * CELL
        n = 0
        for layer in range(n_layers):
            stream = joint * n_layers + layer
            n = _bin_votes(votes[stream], count[stream], layer, cell, table, slots, keys, sums, n)
        for k in range(n):
            table[slots[k]] = -1
        spread[joint], occluder_share[joint] = _peaks_of_cells(
            sums[:n], bandwidth[joint], proposals[joint], density[joint]
        )


@njit(cache=True, nogil=True)
def _bin_votes(
    votes: np.ndarray, n_votes: int, layer: int, cell: float, table: np.ndarray, slots: np.ndarray,
    keys: np.ndarray, sums: np.ndarray, n: int,
) -> int:  # fmt: skip
    """Adds votes to cells, which a hash table with open addressing finds; returns the number of cells.

    A cell's sums: w, w x, w y, w z, w |x|^2, w of occluder modes.
    """
    mask = np.int64(len(table) - 1)
    per_metre = np.float32(1.0 / cell)
    for i in range(n_votes):
        x, y, z, w = votes[i, 0], votes[i, 1], votes[i, 2], votes[i, 3]
        a = np.int64(np.floor(x * per_metre))
        b = np.int64(np.floor(y * per_metre))
        c = np.int64(np.floor(z * per_metre))
        slot = (a * 73856093 ^ b * 19349663 ^ c * 83492791) & mask
        k = table[slot]
        while k >= 0 and not (keys[k, 0] == a and keys[k, 1] == b and keys[k, 2] == c):
            slot = (slot + 1) & mask
            k = table[slot]
        if k < 0:
            k = np.int32(n)
            table[slot] = k
            slots[k] = slot
            keys[k, 0], keys[k, 1], keys[k, 2] = a, b, c
            sums[k, :] = 0.0
            n += 1
        sums[k, 0] += w
        sums[k, 1] += w * x
        sums[k, 2] += w * y
        sums[k, 3] += w * z
        sums[k, 4] += w * (x * x + y * y + z * z)
        sums[k, 5] += w * layer
    return n


@njit(cache=True, nogil=True)
def _peaks_of_cells(
    sums: np.ndarray, bandwidth: float, proposals: np.ndarray, density: np.ndarray
) -> tuple[float, float]:
    """Mean shift from the heaviest cells; returns the first mode's spread [m] and share of occluder votes."""
    n = len(sums)
    n_proposals = len(density)
    proposals[:] = np.nan
    density[:] = 0.0
    if n == 0:
        return np.nan, np.nan
    cells = np.empty((4, n), np.float32)
    origin = np.empty(3, np.float64)
    heaviest = np.argmax(sums[:, 0])
    for axis in range(3):
        origin[axis] = sums[heaviest, 1 + axis] / sums[heaviest, 0]
    per_bandwidth = 1.0 / bandwidth
    for k in range(n):
        cells[3, k] = sums[k, 0]
        for axis in range(3):
            cells[axis, k] = (sums[k, 1 + axis] / sums[k, 0] - origin[axis]) * per_bandwidth
    n_starts = n_proposals + N_EXTRA_STARTS
    modes, n_modes = np.empty((n_starts, 4), np.float64), 0
    is_free = np.ones(n, np.bool_)
    for _ in range(n_starts):
        start = _heaviest_free(cells, is_free)
        if start < 0:
            break
        n_modes = _climb(cells, start, modes, n_modes)
    order = np.argsort(-modes[:n_modes, 3])
    for rank in range(min(n_modes, n_proposals)):
        mode = modes[order[rank]]
        density[rank] = mode[3]
        for axis in range(3):
            proposals[rank, axis] = origin[axis] + bandwidth * mode[axis]
    return _basin(cells, sums, modes[order[0]], origin, bandwidth)


@njit(cache=True, nogil=True)
def _heaviest_free(cells: np.ndarray, is_free: np.ndarray) -> int:
    """The heaviest cell that no earlier start has covered, -1 if none; covers what is within a bandwidth of it."""
    best, most = -1, np.float32(0.0)
    for k in range(len(is_free)):
        if is_free[k] and cells[3, k] > most:
            best, most = k, cells[3, k]
    if best >= 0:
        for k in range(len(is_free)):
            dx, dy, dz = cells[0, k] - cells[0, best], cells[1, k] - cells[1, best], cells[2, k] - cells[2, best]
            if dx * dx + dy * dy + dz * dz <= 1.0:
                is_free[k] = False
    return best


@njit(cache=True, nogil=True)
def _climb(cells: np.ndarray, start: int, modes: np.ndarray, n_modes: int) -> int:
    """Climbs from a cell's centroid; adds the mode unless it is known. Lengths in bandwidths."""
    x, y, z = cells[0, start], cells[1, start], cells[2, start]
    weight = 0.0
    for _ in range(MAX_STEPS):
        weight, sx, sy, sz = _weighted_sums(cells, x, y, z)
        nx, ny, nz = np.float32(sx / weight), np.float32(sy / weight), np.float32(sz / weight)
        step = (nx - x) ** 2 + (ny - y) ** 2 + (nz - z) ** 2
        x, y, z = nx, ny, nz
        for k in range(n_modes):
            if (x - modes[k, 0]) ** 2 + (y - modes[k, 1]) ** 2 + (z - modes[k, 2]) ** 2 < MERGED**2:
                return n_modes
        if step < TOLERANCE**2:
            break
    modes[n_modes, 0], modes[n_modes, 1], modes[n_modes, 2], modes[n_modes, 3] = x, y, z, weight
    return n_modes + 1


@njit(cache=True, nogil=True, fastmath=_SUMS)
def _weighted_sums(cells: np.ndarray, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Sums of w k, w k x, w k y, w k z over the cells, k = exp(-|x - x_i|^2)."""
    total, sx, sy, sz = 0.0, 0.0, 0.0, 0.0
    cx, cy, cz, cw = cells[0], cells[1], cells[2], cells[3]
    for k in range(cells.shape[1]):
        dx, dy, dz = cx[k] - x, cy[k] - y, cz[k] - z
        w = cw[k] * bell(dx * dx + dy * dy + dz * dz)
        total += w
        sx += w * cx[k]
        sy += w * cy[k]
        sz += w * cz[k]
    return total, sx, sy, sz


@njit(cache=True, nogil=True)
def _basin(
    cells: np.ndarray, sums: np.ndarray, mode: np.ndarray, origin: np.ndarray, bandwidth: float
) -> tuple[float, float]:
    """Spread [m] and share of occluder votes of the cells around a mode."""
    x, y, z = origin[0] + bandwidth * mode[0], origin[1] + bandwidth * mode[1], origin[2] + bandwidth * mode[2]
    weight, squares, of_occluders = 0.0, 0.0, 0.0
    for k in range(len(sums)):
        dx, dy, dz = cells[0, k] - mode[0], cells[1, k] - mode[1], cells[2, k] - mode[2]
        if dx * dx + dy * dy + dz * dz <= BASIN * BASIN:
            weight += sums[k, 0]
            cross = sums[k, 1] * x + sums[k, 2] * y + sums[k, 3] * z
            squares += sums[k, 4] - 2.0 * cross + sums[k, 0] * (x * x + y * y + z * z)
            of_occluders += sums[k, 5]
    if weight == 0.0:
        return 0.0, 0.0
    return np.sqrt(max(squares, 0.0) / weight), of_occluders / weight
