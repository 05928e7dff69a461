"""Modes of a joint's votes: mean shift with a Gaussian kernel (Rafi et al. 2015, equation 6) on cells of votes.

The votes are summed up in cells, each of which acts as one vote at its centroid. The modes of the cells are found
first; the densest is then settled by mean shift over the votes themselves (docs/predicting.md says what it costs).
"""

import numpy as np
from numba import njit

from forests.modes import quick_climb, quick_sums

CELL = 0.8
"""Side of a cell, in bandwidths."""
LIGHTEST = 0.05
"""Cells lighter than this share of the heaviest are left out."""
N_SETTLING_STEPS = 3
"""Steps of mean shift over the votes themselves, from the densest mode of the cells."""
NEAR = 3.0
"""Votes farther from this mode do not move it, in bandwidths: the kernel is below 1e-4 there."""
BASIN = 2.0
"""Votes this near to a mode count for its spread and its share of occluder votes, in bandwidths."""
N_EXTRA_STARTS = 2
"""Starts beside one for each proposal."""


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
    sums, near = np.empty((most, 4), np.float64), np.empty((4, most + 1), np.float32)
    for joint in range(n_joints):
        cell = bandwidth[joint] * CELL
        n = 0
        for layer in range(n_layers):
            stream = joint * n_layers + layer
            n = _bin_votes(votes[stream, : count[stream]], cell, table, slots, keys, sums, n)
        for k in range(n):
            table[slots[k]] = -1
        _peaks_of_cells(sums[:n], bandwidth[joint], proposals[joint], density[joint])
        n = 0
        for layer in range(n_layers):
            stream = joint * n_layers + layer
            n_before = n
            n = _keep_near(votes[stream, : count[stream]], bandwidth[joint], proposals[joint, 0], near, n)
        n_first = n if n_layers == 1 else n_before
        total, spread[joint], occluder_share[joint] = _settle(
            near[:, :n], n_first, bandwidth[joint], proposals[joint, 0]
        )
        if total > 0.0:
            density[joint] *= total / density[joint, 0]


@njit(cache=True, nogil=True)
def _bin_votes(
    votes: np.ndarray, cell: float, table: np.ndarray, slots: np.ndarray, keys: np.ndarray, sums: np.ndarray,
    n: int,
) -> int:  # fmt: skip
    """Adds votes to cells, which a hash table with open addressing finds; returns the number of cells.

    A cell's sums: w, w x, w y, w z.
    """
    mask = np.int64(len(table) - 1)
    per_metre = np.float32(1.0 / cell)
    for i in range(len(votes)):
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
    return n


@njit(cache=True, nogil=True)
def _peaks_of_cells(sums: np.ndarray, bandwidth: float, proposals: np.ndarray, density: np.ndarray) -> None:
    """Mean shift from the heaviest cells."""
    n_proposals = len(density)
    proposals[:] = np.nan
    density[:] = 0.0
    if len(sums) == 0:
        return
    origin = np.empty(3, np.float64)
    heaviest = int(np.argmax(sums[:, 0]))
    least = LIGHTEST * sums[heaviest, 0]
    n = 0
    for k in range(len(sums)):
        if sums[k, 0] >= least:
            sums[n] = sums[k]
            heaviest = n if k == heaviest else heaviest
            n += 1
    cells = np.empty((4, n), np.float32)
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
        n_modes = quick_climb(cells, start, modes, n_modes)
    order = np.argsort(-modes[:n_modes, 3])
    for rank in range(min(n_modes, n_proposals)):
        mode = modes[order[rank]]
        density[rank] = mode[3]
        for axis in range(3):
            proposals[rank, axis] = origin[axis] + bandwidth * mode[axis]


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
def _keep_near(votes: np.ndarray, bandwidth: float, place: np.ndarray, near: np.ndarray, n: int) -> int:
    """Appends the votes near a place (3,) [m] to `near` (4, capacity): offsets in bandwidths, weight."""
    x, y, z = place
    per_bandwidth, limit = np.float32(1.0 / bandwidth), np.float32(NEAR**2)
    for i in range(len(votes)):
        dx, dy, dz = (
            (votes[i, 0] - x) * per_bandwidth,
            (votes[i, 1] - y) * per_bandwidth,
            (votes[i, 2] - z) * per_bandwidth,
        )
        near[0, n], near[1, n], near[2, n], near[3, n] = dx, dy, dz, votes[i, 3]
        n += int(dx * dx + dy * dy + dz * dz <= limit)
    return n


@njit(cache=True, nogil=True)
def _settle(
    near: np.ndarray, n_first_layer: int, bandwidth: float, place: np.ndarray
) -> tuple[float, float, float]:
    """Mean shift over the votes near a mode of the cells, which moves.

    Args:
        near: (4, n) float32: offsets from the mode in bandwidths, weight.
        n_first_layer: The first so many are votes of body modes.
        bandwidth: b_j [m].
        place: (3,) float32, the mode [m].

    Returns:
        Density, spread [m] and share of occluder votes; 0 and NaN without votes.
    """
    if near.shape[1] == 0:
        return 0.0, np.nan, np.nan
    x, y, z = np.float32(0.0), np.float32(0.0), np.float32(0.0)
    total = 0.0
    for _ in range(N_SETTLING_STEPS):
        total, sx, sy, sz = quick_sums(near, x, y, z)
        x, y, z = np.float32(sx / total), np.float32(sy / total), np.float32(sz / total)
    place[0] += bandwidth * x
    place[1] += bandwidth * y
    place[2] += bandwidth * z
    weight, squares, of_occluders = 1e-30, 0.0, 0.0
    for i in range(near.shape[1]):
        square = (near[0, i] - x) ** 2 + (near[1, i] - y) ** 2 + (near[2, i] - z) ** 2
        if square <= BASIN * BASIN:
            weight += near[3, i]
            squares += near[3, i] * square
            of_occluders += near[3, i] if i >= n_first_layer else 0.0
    return total, bandwidth * np.sqrt(squares / weight), of_occluders / weight
