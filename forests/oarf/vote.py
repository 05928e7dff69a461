"""Which pixels vote, and the votes that their leaves cast (Rafi et al. 2015, section 3.1 and 3.2)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.crops import NOTHING
from forests.oarf.model import LeafTable

WEIGHT_ONE = 32767
"""A leaf mode's weight of one in a vote table: int16 keeps an entry at ten bytes, and reading entries is what
voting waits for."""


AHEAD = 32
"""Pixels whose entries are read ahead of their use, so that the misses of many are waited for at once."""
ENTRIES_PER_LINE = 6


class VoteTable(NamedTuple):
    """The leaf modes of all trees that may vote, leaf after leaf, without the missing ones.

    A stream is what is collected together: joint * n_layers + layer.

    Attributes:
        start: (n_leaves + 1,) int64: the entries of leaf l are entries[start[l]:start[l + 1]].
        entries: (n_entries, 5) int16: offset x, y, z [mm], weight (WEIGHT_ONE = 1), stream.
        n_streams: Number of streams.
        n_layers: Layers of the leaf tables.
        most_per_leaf: Most entries of one stream in a leaf.
    """

    start: NDArray[np.int64]
    entries: NDArray[np.int16]
    n_streams: int
    n_layers: int
    most_per_leaf: int


class Votes(NamedTuple):
    """Votes for joints, by stream.

    Attributes:
        votes: (n_streams, capacity, 4) float32: x, y, z in the camera frame [m], weight.
        n_votes: (n_streams,) int64: the first so many of a stream are filled.
    """

    votes: NDArray[np.float32]
    n_votes: NDArray[np.int64]


def vote_table(leaves: Sequence[LeafTable], max_offset_m: NDArray[np.float32]) -> VoteTable:
    """Packs the leaf tables of all trees.

    Args:
        leaves: One a tree.
        max_offset_m: (n_joints,) lambda_j: longer modes are dropped [m].

    Raises:
        ValueError: Modes that are not finite or farther than 32 m, or weights outside 0..1.
    """
    _, n_layers, n_joints, n_modes, _ = leaves[0].mode.shape
    mode = np.concatenate([table.mode for table in leaves]).swapaxes(1, 2)
    weight = np.concatenate([table.weight for table in leaves]).swapaxes(1, 2)
    if not np.isfinite(mode).all() or np.abs(mode).max(initial=0.0) > 32.0:
        raise ValueError("leaf modes must be finite and within 32 m")
    if not (weight.min(initial=0.0) >= 0.0 and weight.max(initial=0.0) <= 1.0 + 1e-6):
        raise ValueError("weights of leaf modes must be in 0..1")
    units = np.rint(weight * WEIGHT_ONE).astype(np.int16)
    length = np.sqrt(np.square(mode).sum(axis=-1))
    is_kept = (units > 0) & (length <= max_offset_m[:, None, None])
    leaf, joint, layer, _ = np.nonzero(is_kept)
    entries = np.empty((len(leaf), 5), np.int16)
    entries[:, :3] = np.rint(mode[is_kept] * 1000.0)
    entries[:, 3] = units[is_kept]
    entries[:, 4] = joint * n_layers + layer
    start = np.zeros(len(mode) + 1, np.int64)
    np.cumsum(np.bincount(leaf, minlength=len(mode)), out=start[1:])
    return VoteTable(start, entries, n_joints * n_layers, n_layers, n_modes)


def shortened(table: VoteTable, max_offset_m: float) -> VoteTable:
    """A vote table without the modes that are longer than `max_offset_m`, whatever the joint."""
    mm = table.entries[:, :3].astype(np.float32)
    is_kept = np.sqrt(np.einsum("ij,ij->i", mm, mm)) <= 1000.0 * max_offset_m
    n_kept = np.zeros(len(is_kept) + 1, np.int64)
    np.cumsum(is_kept, out=n_kept[1:])
    return table._replace(start=n_kept[table.start], entries=table.entries[is_kept])


def cast(table: VoteTable, leaves: NDArray[np.int32], points: NDArray[np.float32]) -> Votes:
    """The votes of pixels that have reached their leaves.

    Args:
        table: Leaf modes that vote.
        leaves: (n_trees, n) int32, numbered through all trees.
        points: (n, 3) float32, the pixels in the camera frame [m].
    """
    votes = np.empty((table.n_streams, leaves.size * table.most_per_leaf, 4), np.float32)
    count = np.zeros(table.n_streams, np.int64)
    cast_votes(leaves, points, table.start, table.entries, votes, count)
    return Votes(votes, count)


@njit(cache=True, nogil=True)
def choose_voters(
    pixels: np.ndarray, width: int, left: int, top: int, right: int, bottom: int, n_wanted: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Spreads pixels evenly over the foreground in a box of a crop.

    Whole rows are left out between rows that are read, about as many as columns between pixels of a row; the
    pixels of the rows that are read, one row after the other, are taken at a constant stride.

    Args:
        pixels: (height * width,) uint16 crop [mm], NOTHING where nothing is.
        width: Columns of the crop.
        left: First column of the box.
        top: First row.
        right: Column after the last.
        bottom: Row after the last.
        n_wanted: Pixels to choose; all, if there are fewer.

    Returns:
        (n,) int32 columns, (n,) int32 rows, and how many foreground pixels each of them stands for.
    """
    n_foreground = _count(pixels, width, left, top, right, bottom, 1)
    step = max(1, int(np.sqrt(n_foreground / n_wanted)))
    first_row = top
    top += step // 2
    n_read = _count(pixels, width, left, top, right, bottom, step)
    if n_read < n_wanted and step > 1:  # something thin, which lies between the rows
        step, top = 1, first_row
        n_read = n_foreground
    n = min(n_wanted, n_read)
    columns, rows = np.empty(n, np.int32), np.empty(n, np.int32)
    k, passed, following = 0, 0, 0
    for row in range(top, bottom, step):
        for column in range(left, right):
            if pixels[row * width + column] != NOTHING:
                if passed == following and k < n:
                    columns[k], rows[k] = column, row
                    k += 1
                    following = k * n_read // n
                passed += 1
    return columns, rows, n_foreground / max(1, n)


@njit(cache=True, nogil=True)
def _count(pixels: np.ndarray, width: int, left: int, top: int, right: int, bottom: int, step: int) -> int:
    n = 0
    for row in range(top, bottom, step):
        for value in pixels[row * width + left : row * width + right]:
            n += value != NOTHING
    return n


@njit(cache=True, nogil=True)
def cast_votes(
    leaves: np.ndarray, points: np.ndarray, start: np.ndarray, entries: np.ndarray, votes: np.ndarray,
    count: np.ndarray,
) -> int:  # fmt: skip
    """Lets every pixel cast its leaves' modes: x = q + V with weight w * D(q)^2.

    Args:
        leaves: (n_trees, n) int32, numbered through all trees.
        points: (n, 3) float32, the pixels in the camera frame [m].
        start: Of the vote table.
        entries: Of the vote table.
        votes: (n_streams, capacity, 4) float32 to fill.
        count: (n_streams,) int64, zeros on entry.

    Returns:
        Nothing of meaning: what reading ahead has summed up.
    """
    metres, unit = np.float32(1e-3), np.float32(1.0 / WEIGHT_ONE)
    touched = 0
    for i in range(len(points)):
        if i % AHEAD == 0:
            touched += _touch(leaves[:, i : i + AHEAD], start, entries)
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        area = z * z * unit
        for tree in range(len(leaves)):
            leaf = leaves[tree, i]
            for e in range(start[leaf], start[leaf + 1]):
                stream = entries[e, 4]
                k = count[stream]
                votes[stream, k, 0] = x + metres * np.float32(entries[e, 0])
                votes[stream, k, 1] = y + metres * np.float32(entries[e, 1])
                votes[stream, k, 2] = z + metres * np.float32(entries[e, 2])
                votes[stream, k, 3] = area * np.float32(entries[e, 3])
                count[stream] = k + 1
    return touched


@njit(cache=True, nogil=True)
def _touch(leaves: np.ndarray, start: np.ndarray, entries: np.ndarray) -> int:
    """Reads one number of every cache line of these leaves' entries; the sum keeps it from being left out."""
    total = 0
    for tree in range(leaves.shape[0]):
        for i in range(leaves.shape[1]):
            leaf = leaves[tree, i]
            for e in range(start[leaf], start[leaf + 1], ENTRIES_PER_LINE):
                total += entries[e, 0]
    return total
