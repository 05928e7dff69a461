"""Which pixels vote, and the votes that their leaves cast (Rafi et al. 2015, section 3.1 and 3.2)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.crops import NOTHING
from forests.oarf.packed import FACING_ONE, WEIGHT_ONE, PackedLeaves, check_leaves

AHEAD = 32
"""Pixels whose entries are read ahead of their use, so that the misses of many are waited for at once."""
ENTRIES_PER_LINE = 6
LEAST_AGREEMENT = 0.05
"""A vote learned from people who faced another way keeps this share of its weight."""


class VoteTable(NamedTuple):
    """The leaf votes of all trees, leaf after leaf, without the missing ones and those that are too long.

    A stream is what is collected together: joint * n_layers + layer.

    Attributes:
        start: (n_leaves + 1,) int64: the entries of leaf l are entries[start[l]:start[l + 1]].
        entries: (n_entries, 5) int16: offset x, y, z [mm], weight (WEIGHT_ONE = 1), stream.
        facing: (n_entries, 2) int8: cosine and sine of headings (FACING_ONE = 1); (0, 2) = not learned.
        n_streams: Number of streams.
        n_layers: Layers of the leaf tables.
        most_per_leaf: Most entries of one stream in a leaf.
    """

    start: NDArray[np.int64]
    entries: NDArray[np.int16]
    facing: NDArray[np.int8]
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


def vote_table(leaves: Sequence[PackedLeaves], max_offset_m: NDArray[np.float32]) -> VoteTable:
    """Puts the leaf tables of all trees behind one another.

    Args:
        leaves: One a tree.
        max_offset_m: (n_joints,) lambda_j: longer votes are dropped [m].

    Raises:
        ValueError: A table that is damaged.
    """
    _, n_layers, n_joints, n_leaf_votes = leaves[0].shape
    for table in leaves:
        check_leaves(table)
    start = np.zeros(sum(table.n_leaves for table in leaves) + 1, np.int64)
    entries = np.empty((sum(len(table.weight) for table in leaves), 5), np.int16)
    has_facing = all(len(table.facing) for table in leaves)
    facing = np.empty((len(entries) if has_facing else 0, 2), np.int8)
    limits = np.asarray(max_offset_m, np.float32)
    leaf = 0
    for table in leaves:
        own = start[leaf : leaf + table.n_leaves + 1]
        _fill_entries(
            table.has_vote, table.vote, table.weight, table.facing, n_layers, n_leaf_votes, limits, own, entries, facing
        )  # fmt: skip
        leaf += table.n_leaves
    return VoteTable(start, entries[: start[-1]], facing[: start[-1]], n_joints * n_layers, n_layers, n_leaf_votes)


@njit(cache=True, nogil=True)
def _fill_entries(
    bits: np.ndarray, vote: np.ndarray, weight: np.ndarray, faced: np.ndarray, n_layers: int, n_leaf_votes: int,
    limits: np.ndarray, start: np.ndarray, entries: np.ndarray, facing: np.ndarray,
) -> None:  # fmt: skip
    """Appends the votes of one tree's leaves that are short enough.

    Args:
        bits: Of the packed table, (n_leaves, n_layers, n_joints, n_leaf_votes) bits.
        vote: (n_set, 3) int16 [mm].
        weight: (n_set,) int16.
        faced: (n_set, 2) int8; not read where `facing` is empty.
        n_layers: Layers of the table.
        n_leaf_votes: Votes of a joint in a leaf and layer, at most.
        limits: (n_joints,) float32, lambda_j [m].
        start: (n_leaves + 1,) int64 to fill but for the first, which says where to begin.
        entries: Of the vote table.
        facing: Of the vote table.
    """
    place, k, n = 0, 0, start[0]
    for leaf in range(len(start) - 1):
        for layer in range(n_layers):
            for joint in range(len(limits)):
                for _ in range(n_leaf_votes):
                    is_set = bits[place >> 3] & (0x80 >> (place & 7))
                    place += 1
                    if not is_set:
                        continue
                    x, y, z = vote[k, 0], vote[k, 1], vote[k, 2]
                    fx, fy, fz = (
                        np.float32(x) / np.float32(1e3),
                        np.float32(y) / np.float32(1e3),
                        np.float32(z) / np.float32(1e3),
                    )
                    if weight[k] > 0 and np.sqrt(fx * fx + fy * fy + fz * fz) <= limits[joint]:
                        entries[n, 0], entries[n, 1], entries[n, 2] = x, y, z
                        entries[n, 3], entries[n, 4] = weight[k], joint * n_layers + layer
                        if len(facing) > 0:
                            facing[n, 0], facing[n, 1] = faced[k, 0], faced[k, 1]
                        n += 1
                    k += 1
        start[leaf + 1] = n


def shortened(table: VoteTable, max_offset_m: float) -> VoteTable:
    """A vote table without the votes that are longer than `max_offset_m`, whatever the joint."""
    mm = table.entries[:, :3].astype(np.float32)
    is_kept = np.sqrt(np.einsum("ij,ij->i", mm, mm)) <= 1000.0 * max_offset_m
    n_kept = np.zeros(len(is_kept) + 1, np.int64)
    np.cumsum(is_kept, out=n_kept[1:])
    facing = table.facing[is_kept] if len(table.facing) else table.facing
    return table._replace(start=n_kept[table.start], entries=table.entries[is_kept], facing=facing)


def cast(
    table: VoteTable,
    leaves: NDArray[np.int32],
    points: NDArray[np.float32],
    facing: NDArray[np.float32] | None = None,
) -> Votes:
    """The votes of pixels that have reached their leaves.

    Args:
        table: Votes of the leaves.
        leaves: (n_trees, n) int32, numbered through all trees.
        points: (n, 3) float32, the pixels in the camera frame [m].
        facing: (2,) float32, cosine and sine of the person's heading; None or zeros = not known.
    """
    is_told = facing is not None and bool(np.any(facing)) and len(table.facing) > 0
    toward = facing if facing is not None and is_told else np.empty(0, np.float32)
    votes = np.empty((table.n_streams, leaves.size * table.most_per_leaf, 4), np.float32)
    count = np.zeros(table.n_streams, np.int64)
    cast_votes(leaves, points, table.start, table.entries, table.facing, toward, votes, count)
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
    leaves: np.ndarray, points: np.ndarray, start: np.ndarray, entries: np.ndarray, facing: np.ndarray,
    toward: np.ndarray, votes: np.ndarray, count: np.ndarray,
) -> int:  # fmt: skip
    """Lets every pixel cast its leaves' votes: x = q + V with weight w * D(q)^2.

    Where the person's heading h is known, the weight is that of the vote given the heading (a conditional regression
    forest, Sun, Kohli and Shotton 2012): times 1 + 2 m . (cos h, sin h), the density of headings with the mean m
    up to its first harmonic, over that of a uniform one, but not below LEAST_AGREEMENT.

    Args:
        leaves: (n_trees, n) int32, numbered through all trees.
        points: (n, 3) float32, the pixels in the camera frame [m].
        start: Of the vote table.
        entries: Of the vote table.
        facing: Of the vote table.
        toward: (2,) float32, cosine and sine of the heading; empty = not known.
        votes: (n_streams, capacity, 4) float32 to fill.
        count: (n_streams,) int64, zeros on entry.

    Returns:
        Nothing of meaning: what reading ahead has summed up.
    """
    metres, unit = np.float32(1e-3), np.float32(1.0 / WEIGHT_ONE)
    one, least = np.float32(1.0), np.float32(LEAST_AGREEMENT)
    is_told = len(toward) > 0
    cos, sin = np.float32(0.0), np.float32(0.0)
    if is_told:
        cos, sin = toward[0] * np.float32(2.0 / FACING_ONE), toward[1] * np.float32(2.0 / FACING_ONE)
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
                weight = area * np.float32(entries[e, 3])
                if is_told:
                    weight *= max(one + cos * np.float32(facing[e, 0]) + sin * np.float32(facing[e, 1]), least)
                votes[stream, k, 3] = weight
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
