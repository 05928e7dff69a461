"""A trained tree: one flat structured array, breadth first; checked, as a model file holds it, and kept."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.features import FEATURE_LIMIT_MM
from forests.modelfile import take_array

TreeT = TypeVar("TreeT")

NODE_DTYPE = np.dtype(
    [
        ("u", np.float32, (2,)),
        ("v", np.float32, (2,)),
        ("threshold", np.int32),
        ("left", np.int32),
        ("leaf", np.int32),
    ],
    align=True,
)
"""One node. u, v: probe offsets (x, y) [m], scaled to pixels by f / depth. A pixel goes to `left + 1` if
depth(q + u) - depth(q + v) > threshold [mm], else to `left`. A leaf has `left` = its own number, zero offsets,
so that descending on stays in it, and `leaf` = its row in the leaf tables; inner nodes have leaf = -1."""

LEAF_THRESHOLD = np.int32(2**31 - 1)
LONGEST_PROBE_M = 100.0


class TreeStore(Protocol[TreeT]):
    """Keeps finished trees, so that interrupted training goes on after the last of them."""

    def load(self, tree: int) -> TreeT | None:
        """A tree that was finished before, or None."""
        ...

    def save(self, tree: int, grown: TreeT) -> None:
        """Keeps a finished tree."""
        ...


def check_tree(nodes: NDArray, n_leaves: int) -> None:
    """Makes sure that no descent leaves the array or goes on for ever, whatever file the nodes came from.

    Args:
        nodes: (n_nodes,) of NODE_DTYPE.
        n_leaves: Rows of the leaf tables.

    Raises:
        ValueError: Children that do not follow their parent or have several, a leaf's number out of range,
            offsets that are not finite.
    """
    if nodes.dtype != NODE_DTYPE or nodes.ndim != 1 or len(nodes) == 0:
        raise ValueError(f"nodes are {nodes.dtype} {nodes.shape}, must be a filled vector of tree nodes")
    fault = _fault_of(nodes["left"], nodes["leaf"], nodes["threshold"], n_leaves)
    if fault != 0:
        raise ValueError(
            {
                1: "a leaf leads elsewhere",
                2: "a node's children do not follow it",
                3: "every node but the first must be the child of one other",
                4: f"leaves must be numbered 0..{n_leaves - 1}, each once",
            }[fault]
        )
    if not (np.isfinite(nodes["u"]).all() and np.isfinite(nodes["v"]).all()):
        raise ValueError("a node's offsets are not finite")


@njit(cache=True, nogil=True)
def _fault_of(left: np.ndarray, leaf: np.ndarray, threshold: np.ndarray, n_leaves: int) -> int:
    """What is wrong with a tree's nodes, by the number of the message in `check_tree`; 0 = nothing."""
    n = len(left)
    parents, seen = np.zeros(n, np.int32), np.zeros(n_leaves, np.int32)
    n_met = 0
    for i in range(n):
        if leaf[i] >= 0 and (left[i] != i or threshold[i] != LEAF_THRESHOLD):
            return 1
    for i in range(n):
        if leaf[i] < 0 and (left[i] <= i or np.int64(left[i]) + 1 >= n):
            return 2
    for i in range(n):
        if leaf[i] < 0:
            parents[left[i]] += 1
            parents[left[i] + 1] += 1
        elif leaf[i] < n_leaves:
            seen[leaf[i]] += 1
            n_met += 1
        else:
            return 4
    for i in range(1, n):
        if parents[i] != 1:
            return 3
    if n_met != n_leaves or (n_leaves > 0 and seen.min() != 1):
        return 4
    return 0


def tree_depth(nodes: NDArray) -> int:
    """Number of decisions on the longest way down: 0 for a single leaf."""
    level = np.zeros(len(nodes), np.int32)
    for number in np.flatnonzero(nodes["leaf"] < 0):
        left = nodes["left"][number]
        level[left] = level[left + 1] = level[number] + 1
    return int(level.max())


def pack_nodes(nodes: NDArray) -> dict[str, np.ndarray]:
    """Arrays of nodes by name."""
    return {
        "offsets": np.concatenate([nodes["u"], nodes["v"]], axis=1),
        "threshold": nodes["threshold"],
        "left": nodes["left"],
        "leaf": nodes["leaf"],
    }


def pack_inner_nodes(nodes: NDArray) -> dict[str, np.ndarray]:
    """Arrays of nodes by name, without what follows from their order: less than half as large.

    Raises:
        ValueError: Nodes that are not breadth first, or leaves that are not numbered in their order.
    """
    inner = nodes[nodes["leaf"] < 0]
    return {
        "is_leaf": bits_of(nodes),
        "probe": np.concatenate([inner["u"], inner["v"]], axis=1),
        "threshold": narrow_thresholds(inner["threshold"]),
    }


def narrow_thresholds(threshold: NDArray[np.int32]) -> NDArray[np.int16]:
    """Thresholds that decide alike [mm]: no feature is beyond FEATURE_LIMIT_MM."""
    return np.clip(threshold, -FEATURE_LIMIT_MM - 1, FEATURE_LIMIT_MM).astype(np.int16)


def _unpack_inner_nodes(arrays: Mapping[str, np.ndarray]) -> NDArray:
    threshold = take_array(arrays, "threshold", np.int16, (None,))
    probe = take_array(arrays, "probe", np.float32, (len(threshold), 4))
    is_leaf, left = shape_of(take_array(arrays, "is_leaf", np.uint8, (None,)), len(threshold))
    if not (np.abs(probe) <= LONGEST_PROBE_M).all():
        raise ValueError(f"offsets of probes must be within {LONGEST_PROBE_M} m")
    nodes = np.zeros(len(left), NODE_DTYPE)
    nodes["left"], nodes["leaf"] = left, -1
    nodes["threshold"] = LEAF_THRESHOLD
    inner, leaves = np.flatnonzero(is_leaf == 0), np.flatnonzero(is_leaf)
    nodes["u"][inner], nodes["v"][inner] = probe[:, :2], probe[:, 2:]
    nodes["threshold"][inner] = threshold
    nodes["leaf"][leaves] = np.arange(len(leaves))
    return nodes


def unpack_nodes(arrays: Mapping[str, np.ndarray]) -> NDArray:
    """Undoes `pack_nodes` and `pack_inner_nodes`; checked so that no descent leaves the array.

    Returns:
        (n_nodes,) of NODE_DTYPE.

    Raises:
        ValueError: Anything missing, of another shape, or out of its range.
    """
    if "left" not in arrays:
        return _unpack_inner_nodes(arrays)
    left = take_array(arrays, "left", np.int32, (None,))
    n = len(left)
    offsets = take_array(arrays, "offsets", np.float32, (n, 4))
    nodes = np.zeros(n, NODE_DTYPE)
    nodes["u"], nodes["v"] = offsets[:, :2], offsets[:, 2:]
    nodes["left"] = left
    nodes["threshold"] = take_array(arrays, "threshold", np.int32, (n,))
    nodes["leaf"] = take_array(arrays, "leaf", np.int32, (n,))
    if (nodes["leaf"] < -1).any() or (nodes["threshold"][nodes["leaf"] < 0] == LEAF_THRESHOLD).any():
        raise ValueError("a node is neither a leaf nor a decision")
    check_tree(nodes, int((nodes["leaf"] >= 0).sum()))
    if np.abs(offsets).max(initial=0.0) > LONGEST_PROBE_M:
        raise ValueError(f"offsets of probes must be within {LONGEST_PROBE_M} m")
    return nodes


class Shape(NamedTuple):
    """Which nodes of a tree are whose children.

    Attributes:
        is_leaf: (n_nodes,) uint8, 1 = leaf; nodes breadth first, leaves numbered in this order.
        left: (n_nodes,) int32: the children of inner node k of those in order are 2k + 1 and 2k + 2; a leaf names
            itself.
    """

    is_leaf: NDArray[np.uint8]
    left: NDArray[np.int32]


def shape_of(bits: NDArray[np.uint8], n_inner: int) -> Shape:
    """The shape of a tree whose nodes are told breadth first; any bits make a tree or are refused.

    Args:
        bits: (ceil(n_nodes / 8),) uint8, which of the n_nodes = 2 * n_inner + 1 nodes are leaves, the
            highest bit first.
        n_inner: Nodes that are none.

    Raises:
        ValueError: Bits that are no tree.
    """
    n_nodes = 2 * n_inner + 1
    is_leaf = np.unpackbits(bits)
    if len(bits) != -(-n_nodes // 8) or is_leaf[n_nodes:].any():
        raise ValueError(f"the bits of {n_nodes} nodes are {len(bits)} bytes, or set beyond them")
    is_leaf = is_leaf[:n_nodes]
    numbers = np.arange(n_nodes, dtype=np.int32)
    left = 2 * np.cumsum(1 - is_leaf, dtype=np.int32) - 1
    if int(is_leaf.sum()) != n_inner + 1 or (left <= numbers)[is_leaf == 0].any():
        raise ValueError("a node's children do not follow it: the bits of the leaves are no tree")
    return Shape(is_leaf, np.where(is_leaf, numbers, left))


def bits_of(nodes: NDArray) -> NDArray[np.uint8]:
    """Undoes `shape_of`: (ceil(n_nodes / 8),) uint8 of the (n_nodes,) nodes of NODE_DTYPE of a tree.

    Raises:
        ValueError: Nodes that are not breadth first, or leaves that are not numbered in their order.
    """
    is_leaf = nodes["leaf"] >= 0
    bits = np.packbits(is_leaf)
    is_ordered = np.array_equal(nodes["leaf"][is_leaf], np.arange(is_leaf.sum()))
    if not is_ordered or not np.array_equal(shape_of(bits, len(nodes) // 2).left, nodes["left"]):
        raise ValueError("the nodes of a tree must come breadth first, its leaves numbered in their order")
    return bits
