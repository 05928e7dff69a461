"""Pixels go down all trees of a forest, many in lockstep."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.features import difference, pixels_per_metre, probe
from forests.tree import check_tree

PACKED_NODE = np.dtype(
    [
        ("ux", np.float32),
        ("uy", np.float32),
        ("vx", np.float32),
        ("vy", np.float32),
        ("threshold", np.int32),
        ("left", np.int32),
        ("leaf", np.int32),
        ("unused", np.int32),
    ]
)
"""As `forests.tree.NODE_DTYPE` numbered through all trees, in 32 bytes: two to a cache line."""

GROUP = 128
"""Pixels that go down together: the misses of one are waited for while the others are at work."""


class FlatTrees(NamedTuple):
    """All trees of a forest behind one another.

    Attributes:
        nodes: (n_nodes,) of PACKED_NODE.
        roots: (n_trees,) int32, numbers of the roots.
        leaf_start: (n_trees + 1,) int32: the leaves of tree t are numbered from leaf_start[t] on.
    """

    nodes: NDArray
    roots: NDArray[np.int32]
    leaf_start: NDArray[np.int32]


def flatten(trees: Sequence[NDArray], n_leaves: Sequence[int]) -> FlatTrees:
    """Puts trees behind one another.

    Args:
        trees: Nodes of each, (n_nodes,) of NODE_DTYPE.
        n_leaves: Leaves of each.

    Raises:
        ValueError: No tree, or one that a descent would not end in.
    """
    if not trees:
        raise ValueError("a forest needs at least one tree")
    for nodes, n in zip(trees, n_leaves, strict=True):
        check_tree(nodes, n)
    roots = _starts([len(nodes) for nodes in trees])
    leaf_start = _starts(n_leaves)
    flat = np.zeros(roots[-1], PACKED_NODE)
    for nodes, root, leaf in zip(trees, roots, leaf_start, strict=False):
        packed = flat[root : root + len(nodes)]
        packed["ux"], packed["uy"] = nodes["u"].T
        packed["vx"], packed["vy"] = nodes["v"].T
        packed["threshold"] = nodes["threshold"]
        packed["left"] = nodes["left"] + root
        packed["leaf"] = np.where(nodes["leaf"] >= 0, nodes["leaf"] + leaf, -1)
    return FlatTrees(flat, roots[:-1], leaf_start)


def _starts(counts: Sequence[int]) -> NDArray[np.int32]:
    return np.concatenate([np.zeros(1, np.int32), np.cumsum(counts, dtype=np.int32)])


@njit(cache=True, nogil=True)
def descend(
    pixels: np.ndarray, width: int, height: int, columns: np.ndarray, rows: np.ndarray,
    fx: float, fy: float, nodes: np.ndarray, roots: np.ndarray, leaves: np.ndarray,
) -> None:  # fmt: skip
    """Finds the leaves of many pixels of one image.

    A pixel that has reached its leaf leaves the group, so that a level costs what is still on its way.

    Args:
        pixels: (height * width,) uint16 crop with a border [mm].
        width: Columns of the crop.
        height: Rows of the crop.
        columns: (n,) int32 in the crop, of pixels with depth.
        rows: (n,) int32 in the crop.
        fx: Focal length [px], float32.
        fy: Focal length [px], float32.
        nodes: (n_nodes,) of PACKED_NODE.
        roots: (n_trees,) int32.
        leaves: (n_trees, n) int32 to fill: leaves, numbered through all trees.
    """
    n = len(columns)
    half = np.float32(0.5)
    x, y = np.empty(GROUP, np.float32), np.empty(GROUP, np.float32)
    fx_z, fy_z = np.empty(GROUP, np.float32), np.empty(GROUP, np.float32)
    at, going = np.empty(GROUP, np.int32), np.empty(GROUP, np.int32)
    for first in range(0, n, GROUP):
        n_group = min(GROUP, n - first)
        for i in range(n_group):
            column, row = columns[first + i], rows[first + i]
            z_mm = pixels[row * width + column]
            x[i], y[i] = np.float32(column) + half, np.float32(row) + half
            fx_z[i], fy_z[i] = pixels_per_metre(fx, z_mm), pixels_per_metre(fy, z_mm)
        for tree in range(len(roots)):
            n_going = n_group
            for i in range(n_group):
                at[i], going[i] = roots[tree], i
            while n_going > 0:
                n_left = 0
                for k in range(n_going):
                    i = going[k]
                    node = nodes[at[i]]
                    one = probe(pixels, 0, width, height, x[i], y[i], fx_z[i], fy_z[i], node.ux, node.uy)
                    two = probe(pixels, 0, width, height, x[i], y[i], fx_z[i], fy_z[i], node.vx, node.vy)
                    goes_right = difference(one, two) > node.threshold
                    at[i] = node.left + np.int32(goes_right)
                    going[n_left] = i
                    n_left += int(node.leaf < 0)
                n_going = n_left
            for i in range(n_group):
                leaves[tree, first + i] = nodes[at[i]].leaf
