"""All experts' trees as the walk reads them: small, and what is read one after the other lies side by side.

A walk waits for memory: the trees of nine joints do not fit into a processor's cache. So a node takes 16 bytes, a leaf
of four clusters 32, the children of a node lie side by side, and those of the larger of them follow at once.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import DTypeLike, NDArray

from forests.features import FEATURE_LIMIT_MM
from forests.rwf.model import ExpertTree

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


def walk_tables(experts: tuple[tuple[ExpertTree, ...], ...]) -> WalkTables:
    """Puts all trees behind one another, rounds their numbers, and weighs their clusters.

    Offsets of probes are rounded to 1/32767 of the longest, of clusters likewise, weights to 1/32767.

    Args:
        experts: The trees of each joint, alike in number.
    """
    flat = [tree for trees in experts for tree in trees]
    probe_m = _unit(max(max(np.abs(tree.nodes[name]).max() for name in ("u", "v")) for tree in flat))
    offset_m = _unit(max(np.abs(tree.offset).max() for tree in flat))
    nodes = _aligned(sum(len(tree.nodes) + 1 for tree in flat), PACKED_DTYPE)
    n_clusters = flat[0].offset.shape[1]
    vote = _aligned(sum(len(tree.offset) for tree in flat) * n_clusters * 4, np.int16).reshape(-1, n_clusters, 4)
    root = np.empty(len(flat), np.int32)
    n_nodes, n_leaves = 0, 0
    for number, tree in enumerate(flat):
        root[number] = n_nodes
        own = nodes[n_nodes : n_nodes + len(tree.nodes) + 1]
        place = np.empty(len(tree.nodes), np.int32)
        _lay_out(tree.nodes["left"], tree.nodes["leaf"], place)
        for name in ("u", "v"):
            own[name][place] = np.rint(tree.nodes[name] / probe_m)
        own["threshold"][place] = np.clip(tree.nodes["threshold"], -FEATURE_LIMIT_MM - 1, FEATURE_LIMIT_MM)
        is_leaf = tree.nodes["leaf"] >= 0
        own["next"][place] = np.where(
            is_leaf, -1 - n_leaves - tree.nodes["leaf"], n_nodes + place[np.where(is_leaf, 0, tree.nodes["left"])]
        )
        votes = vote[n_leaves : n_leaves + len(tree.offset)]
        votes[:, :, :3] = np.rint(tree.offset / offset_m)
        votes[:, :, 3] = _weights(tree)
        n_nodes += len(own)
        n_leaves += len(votes)
    return WalkTables(nodes, root.reshape(len(experts), -1), probe_m, vote, offset_m)


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
def _lay_out(left: np.ndarray, leaf: np.ndarray, place: np.ndarray) -> None:
    """Where each node goes: the root first, a gap of one, then pairs of children, those of the larger child first.

    Args:
        left: (n_nodes,) int32, of NODE_DTYPE: children follow their parents.
        leaf: (n_nodes,) int32, likewise.
        place: (n_nodes,) int32 to fill, in 0..n_nodes.
    """
    n = len(left)
    size = np.ones(n, np.int32)
    for i in range(n - 1, -1, -1):
        if leaf[i] < 0:
            size[i] += size[left[i]] + size[left[i] + 1]
    waiting = np.empty(n, np.int32)
    waiting[0], n_waiting, at = 0, 1, 2
    place[0] = 0
    while n_waiting > 0:
        n_waiting -= 1
        node = waiting[n_waiting]
        if leaf[node] >= 0:
            continue
        first = left[node]
        place[first], place[first + 1] = at, at + 1
        at += 2
        is_first_larger = size[first] >= size[first + 1]
        waiting[n_waiting] = first + 1 if is_first_larger else first
        waiting[n_waiting + 1] = first if is_first_larger else first + 1
        n_waiting += 2
