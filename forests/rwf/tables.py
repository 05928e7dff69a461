"""All experts' trees in 16-bit numbers, and as the walk reads them: what is read one after the other lies side by side.

A walk waits for memory: the trees of nine joints do not fit into a processor's cache. So a node takes 16 bytes, a leaf
of four clusters 32, the children of a node lie side by side, and those of the larger of them follow at once.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import DTypeLike, NDArray

from forests.rwf.model import Experts, ExpertTree, PackedTree
from forests.tree import bits_of, narrow_thresholds, shape_of

NARROW_M, NARROW_POWER = 0.1, 3
"""A cluster of spread s votes with weight share * (c / (c + s)) ** power: the denser, the more [m]."""
PACKED_DTYPE = np.dtype(
    [
        ("u", np.int16, (2,)),
        ("v", np.int16, (2,)),
        ("threshold", np.int16),
        ("unused", np.int16),
        ("next", np.int32),
    ]
)
"""One node. u, v: probe offsets in units; `next` is the number of its left child, the right one follows it; of a leaf,
-1 minus its row in the table of votes."""
WEIGHT_ONE = 32767
_MOST = 32767
_LINE_BYTES = 64
"""Of a processor's cache."""


class WalkTables(NamedTuple):
    """All experts' trees behind one another.

    Attributes:
        nodes: (n_nodes,) of PACKED_DTYPE.
        root: (n_joints, n_trees) int32, node numbers.
        probe_m: Unit of the probes' offsets [m].
        vote: (n_leaves, n_clusters, 4) int16, offsets x, y, z to the joint and their weight, WEIGHT_ONE = 1, falling;
            a weight of 0 where there is no further cluster.
        offset_m: Unit of the offsets [m].
    """

    nodes: NDArray
    root: NDArray[np.int32]
    probe_m: np.float32
    vote: NDArray[np.int16]
    offset_m: np.float32


def pack_experts(grown: tuple[tuple[ExpertTree, ...], ...]) -> Experts:
    """Rounds the numbers of all trees, and weighs their clusters.

    Offsets of probes are rounded to 1/32767 of the longest, of clusters likewise, weights to 1/32767.

    Args:
        grown: The trees of each joint, alike in number; nodes breadth first.
    """
    flat = [tree for trees in grown for tree in trees]
    probe_m = _unit(max(max(np.abs(tree.nodes[name]).max() for name in ("u", "v")) for tree in flat))
    offset_m = _unit(max(np.abs(tree.offset).max() for tree in flat))
    trees = tuple(tuple(_packed(tree, probe_m, offset_m) for tree in own) for own in grown)
    return Experts(trees, probe_m, offset_m, flat[0].offset.shape[1])


def _packed(tree: ExpertTree, probe_m: np.float32, offset_m: np.float32) -> PackedTree:
    inner = tree.nodes[tree.nodes["leaf"] < 0]
    vote = np.empty((*tree.share.shape, 4), np.int16)
    vote[:, :, :3], vote[:, :, 3] = np.rint(tree.offset / offset_m), _weights(tree)
    is_there = vote[:, :, 3] > 0
    is_last = np.zeros(is_there.sum(), np.bool_)
    is_last[np.cumsum(is_there.sum(axis=1)) - 1] = True
    return PackedTree(
        bits_of(tree.nodes),
        np.rint(np.concatenate([inner["u"], inner["v"]], axis=1) / probe_m).astype(np.int16),
        narrow_thresholds(inner["threshold"]),
        vote[is_there],
        np.packbits(is_last),
    )


def walk_tables(experts: Experts) -> WalkTables:
    """Puts all trees behind one another; they must be sound."""
    flat = [tree for trees in experts.trees for tree in trees]
    nodes = _aligned(sum(2 * len(tree.threshold) + 2 for tree in flat), PACKED_DTYPE)
    n_leaves, n_clusters = sum(len(tree.threshold) + 1 for tree in flat), experts.n_clusters
    vote = _aligned(n_leaves * n_clusters * 4, np.int16).reshape(n_leaves, n_clusters, 4)
    root = np.empty(len(flat), np.int32)
    first, leaf = 0, 0
    for number, tree in enumerate(flat):
        root[number] = first
        n_inner = len(tree.threshold)
        is_last = np.unpackbits(tree.is_last, count=len(tree.vote))
        _lay_out(*shape_of(tree.is_leaf, n_inner), tree.probe, tree.threshold, first, leaf, nodes)
        _fill_votes(tree.vote, is_last, vote[leaf : leaf + n_inner + 1])
        first += 2 * n_inner + 2
        leaf += n_inner + 1
    return WalkTables(nodes, root.reshape(len(experts.trees), -1), experts.probe_m, vote, experts.offset_m)


def _weights(tree: ExpertTree) -> NDArray[np.float64]:
    """(n_leaves, n_clusters), in 1 / WEIGHT_ONE: a cluster that is there has one or more."""
    weight = tree.share * (NARROW_M / (NARROW_M + tree.spread)) ** NARROW_POWER
    return np.where(tree.share > 0, np.maximum(np.rint(weight * WEIGHT_ONE), 1), 0)


def _unit(longest: float) -> np.float32:
    return np.float32(max(float(longest), 1e-6) / _MOST)


def _aligned(n: int, dtype: DTypeLike) -> NDArray:
    """(n,) zeros that start where a line of the cache does."""
    size = n * np.dtype(dtype).itemsize
    room = np.zeros(size + _LINE_BYTES, np.uint8)
    first = -room.ctypes.data % _LINE_BYTES
    return room[first : first + size].view(dtype)


@njit(cache=True, nogil=True)
def _fill_votes(vote: np.ndarray, is_last: np.ndarray, table: np.ndarray) -> None:
    """Puts the votes of a tree where its leaves' rows are, (n_leaves, n_clusters, 4) int16 of zeros on entry."""
    leaf, cluster = 0, 0
    for k in range(len(vote)):
        table[leaf, cluster] = vote[k]
        leaf, cluster = (leaf + 1, 0) if is_last[k] else (leaf, cluster + 1)


@njit(cache=True, nogil=True)
def _lay_out(
    is_leaf: np.ndarray, left: np.ndarray, probe: np.ndarray, threshold: np.ndarray, first: int, row: int,
    nodes: np.ndarray,
) -> None:  # fmt: skip
    """Writes a tree's nodes: the root first, a gap of one, then pairs of children, those of the larger child first.

    Args:
        is_leaf: (n_nodes,) uint8, see `forests.tree.Shape`.
        left: (n_nodes,) int32, likewise.
        probe: (n_inner, 4) int16, of the nodes that are no leaves.
        threshold: (n_inner,) int16, likewise.
        first: Where the root goes.
        row: Of the tree's first leaf in the table of votes.
        nodes: Of PACKED_DTYPE, to fill.
    """
    n = len(left)
    size = np.ones(n, np.int32)
    for i in range(n - 1, -1, -1):
        if not is_leaf[i]:
            size[i] += size[left[i]] + size[left[i] + 1]
    place = np.empty(n, np.int32)
    waiting = np.empty(n, np.int32)
    waiting[0], n_waiting, at = 0, 1, first + 2
    place[0] = first
    while n_waiting > 0:
        n_waiting -= 1
        node = waiting[n_waiting]
        if is_leaf[node]:
            continue
        child = left[node]
        nodes[place[node]].next = at
        place[child], place[child + 1] = at, at + 1
        at += 2
        is_first_larger = size[child] >= size[child + 1]
        waiting[n_waiting] = child + 1 if is_first_larger else child
        waiting[n_waiting + 1] = child if is_first_larger else child + 1
        n_waiting += 2
    inner = 0
    for i in range(n):
        node = nodes[place[i]]
        if is_leaf[i]:
            node.next = -1 - row - (i - inner)
            continue
        node.u[0], node.u[1] = probe[inner, 0], probe[inner, 1]
        node.v[0], node.v[1] = probe[inner, 2], probe[inner, 3]
        node.threshold = threshold[inner]
        inner += 1
