"""Pixels go down all trees of a forest, many in lockstep."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import int32, njit
from numpy.typing import NDArray

from forests.features import difference, pixels_per_metre
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
        ("hint", np.int32),
    ]
)
"""As `forests.tree.NODE_DTYPE` numbered through all trees, in 32 bytes: two to a cache line. hint: what a node asks
(`forests.features`); 0 in all nodes but of forests that are told more than depth."""

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


def flatten(
    trees: Sequence[NDArray], n_leaves: Sequence[int], hints: Sequence[NDArray[np.int16] | None] = ()
) -> FlatTrees:
    """Puts trees behind one another.

    Args:
        trees: Nodes of each, (n_nodes,) of NODE_DTYPE.
        n_leaves: Leaves of each.
        hints: What the nodes of each ask, (n_nodes,), where not all ask for depth.

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
    for asked, root in zip(hints, roots, strict=False):
        if asked is not None:
            flat["hint"][root : root + len(asked)] = asked
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
    right, bottom = np.float32(width) - half, np.float32(height) - half
    pixel = np.empty((4, GROUP), np.float32)  # x, y plus one half, fx / z, fy / z
    here, offset = np.empty((4, GROUP), np.float32), np.empty((4, GROUP), np.float32)
    at, going = np.empty(GROUP, np.int32), np.empty(GROUP, np.int32)
    one, two = np.empty(GROUP, np.int32), np.empty(GROUP, np.int32)
    for first in range(0, n, GROUP):
        n_group = min(GROUP, n - first)
        for i in range(n_group):
            column, row = columns[first + i], rows[first + i]
            z_mm = pixels[row * width + column]
            pixel[0, i], pixel[1, i] = np.float32(column) + half, np.float32(row) + half
            pixel[2, i], pixel[3, i] = pixels_per_metre(fx, z_mm), pixels_per_metre(fy, z_mm)
        for tree in range(len(roots)):
            n_going = n_group
            for i in range(n_group):
                at[i], going[i] = roots[tree], i
            while n_going > 0:
                for k in range(n_going):
                    i = going[k]
                    node = nodes[at[i]]
                    offset[0, k], offset[1, k], offset[2, k], offset[3, k] = node.ux, node.uy, node.vx, node.vy
                    for row in range(4):
                        here[row, k] = pixel[row, i]
                _places(here, offset[0], offset[1], right, bottom, int32(width), one[:n_going])
                _places(here, offset[2], offset[3], right, bottom, int32(width), two[:n_going])
                n_left = 0
                for k in range(n_going):
                    i = going[k]
                    node = nodes[at[i]]
                    goes_right = difference(pixels[one[k]], pixels[two[k]]) > node.threshold
                    at[i] = node.left + int32(goes_right)
                    going[n_left] = i
                    n_left += int(node.leaf < 0)
                n_going = n_left
            for i in range(n_group):
                leaves[tree, first + i] = nodes[at[i]].leaf


@njit(cache=True, nogil=True)
def _places(
    here: np.ndarray, dx: np.ndarray, dy: np.ndarray, right: float, bottom: float, width: int, out: np.ndarray
) -> None:
    """Where probes read, with the arithmetic of `forests.features.probe`; an offset a pixel. Vectorises."""
    half = np.float32(0.5)
    for k in range(len(out)):
        column = min(max(here[0, k] + here[2, k] * dx[k], half), right)
        row = min(max(here[1, k] + here[3, k] * dy[k], half), bottom)
        out[k] = int32(row) * width + int32(column)
