"""A trained tree: one flat structured array, breadth first, and the descent of one pixel."""

import numpy as np
from numpy.typing import NDArray

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
    numbers = np.arange(len(nodes))
    is_leaf = nodes["leaf"] >= 0
    if (
        not (nodes["left"][is_leaf] == numbers[is_leaf]).all()
        or (nodes["threshold"][is_leaf] != LEAF_THRESHOLD).any()
    ):
        raise ValueError("a leaf leads elsewhere")
    inner = nodes["left"][~is_leaf].astype(np.int64)
    if (inner <= numbers[~is_leaf]).any() or (inner + 1 >= len(nodes)).any():
        raise ValueError("a node's children do not follow it")
    if not np.array_equal(np.sort(np.concatenate([inner, inner + 1])), numbers[1:]):
        raise ValueError("every node but the first must be the child of one other")
    if not np.array_equal(np.sort(nodes["leaf"][is_leaf]), np.arange(n_leaves)):
        raise ValueError(f"leaves must be numbered 0..{n_leaves - 1}, each once")
    if not (np.isfinite(nodes["u"]).all() and np.isfinite(nodes["v"]).all()):
        raise ValueError("a node's offsets are not finite")


def tree_depth(nodes: NDArray) -> int:
    """Number of decisions on the longest way down: 0 for a single leaf."""
    level = np.zeros(len(nodes), np.int32)
    for number in np.flatnonzero(nodes["leaf"] < 0):
        left = nodes["left"][number]
        level[left] = level[left + 1] = level[number] + 1
    return int(level.max())
