"""From nodes in the order of their growth to a tree."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.growing.subtree import GrownNodes
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE


class GrownTree(NamedTuple):
    """A tree and where its training samples ended.

    Attributes:
        nodes: (n_nodes,) of NODE_DTYPE, breadth first.
        leaf_start: (n_leaves + 1,) int64: the samples of leaf l are order[leaf_start[l]:leaf_start[l + 1]].
        order: (n_samples,) int32, a permutation of the samples, in image order within a leaf.
        hints: (n_nodes,) int16, what each node asks (`forests.features`), or empty: all ask for depth.
    """

    nodes: NDArray
    leaf_start: NDArray[np.int64]
    order: NDArray[np.int32]
    hints: NDArray[np.int16] = np.zeros(0, np.int16)


def numbered(grown: GrownNodes, order: NDArray[np.int32]) -> GrownTree:
    """Numbers nodes breadth first, and leaves and their samples in order of the nodes.

    Args:
        grown: All nodes of a tree, in any order.
        order: (n_samples,) int32, what their begin and end refer to.
    """
    by_number = np.argsort(grown.number)
    number = grown.number[by_number]
    is_split = grown.is_split[by_number]
    nodes = np.zeros(len(number), NODE_DTYPE)
    nodes["u"], nodes["v"] = grown.feature[by_number, :2], grown.feature[by_number, 2:]
    nodes["threshold"] = np.where(is_split, grown.threshold[by_number], LEAF_THRESHOLD)
    nodes["left"] = np.where(is_split, np.searchsorted(number, 2 * number), np.arange(len(number)))
    nodes["leaf"] = np.where(is_split, -1, np.cumsum(~is_split) - 1)
    begin, end = grown.begin[by_number][~is_split], grown.end[by_number][~is_split]
    leaf_start = np.concatenate([np.zeros(1, np.int64), np.cumsum(end - begin)])
    hints = grown.hint[by_number] if grown.hint.any() else np.zeros(0, np.int16)
    return GrownTree(nodes, leaf_start, _by_leaf(order, begin, leaf_start), hints)


@njit(cache=True, nogil=True)
def _by_leaf(order: np.ndarray, begin: np.ndarray, leaf_start: np.ndarray) -> np.ndarray:
    sorted_order = np.empty_like(order)
    for leaf in range(len(begin)):
        n = leaf_start[leaf + 1] - leaf_start[leaf]
        sorted_order[leaf_start[leaf] : leaf_start[leaf + 1]] = order[begin[leaf] : begin[leaf] + n]
    return sorted_order
