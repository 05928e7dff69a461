"""A tree's nodes as a model file holds them."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from forests.modelfile import take_array
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE, check_tree

LONGEST_PROBE_M = 100.0


def pack_nodes(nodes: NDArray) -> dict[str, np.ndarray]:
    """Arrays of nodes by name."""
    return {
        "offsets": np.concatenate([nodes["u"], nodes["v"]], axis=1),
        "threshold": nodes["threshold"],
        "left": nodes["left"],
        "leaf": nodes["leaf"],
    }


def unpack_nodes(arrays: Mapping[str, np.ndarray]) -> NDArray:
    """Undoes `pack_nodes`; checked so that no descent leaves the array.

    Returns:
        (n_nodes,) of NODE_DTYPE.

    Raises:
        ValueError: Anything missing, of another shape, or out of its range.
    """
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
