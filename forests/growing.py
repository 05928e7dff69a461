"""Growing a tree from sampled pixels: contract; see the functions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.crops import Crops
from forests.samples import Samples


@dataclass(frozen=True)
class GrowthConfig:
    """How a tree is grown.

    Attributes:
        max_depth: Decisions on the longest way down.
        n_candidates: Features drawn per node.
        n_thresholds: Thresholds tried per feature.
        max_samples_per_split: Samples of a node that candidates are judged on; a larger node is judged on so many,
            drawn by hash.
        min_samples_leaf: Fewest samples of a child.
        max_offset_m: Longest offset of a probe [m].
    """

    max_depth: int = 20
    n_candidates: int = 2000
    n_thresholds: int = 32
    max_samples_per_split: int = 5000
    min_samples_leaf: int = 5
    max_offset_m: float = 0.6


class GrownTree(NamedTuple):
    """A tree and where its training samples ended.

    Attributes:
        nodes: (n_nodes,) of NODE_DTYPE, breadth first.
        leaf_start: (n_leaves + 1,) int64: the samples of leaf l are order[leaf_start[l]:leaf_start[l + 1]].
        order: (n_samples,) int64 or int32, a permutation of the samples, in image order within a leaf.
    """

    nodes: NDArray
    leaf_start: NDArray[np.int64]
    order: NDArray[np.int32]


def grow_class_tree(
    crops: Crops, samples: Samples, classes: NDArray[np.uint8], n_classes: int, config: GrowthConfig,
    seed: int, tree: int, n_threads: int, on_samples: Callable[[int], object] = lambda n: None,
) -> GrownTree:  # fmt: skip
    """Grows one tree by information gain on Shannon entropy (equations 2-4).

    The result depends on (seed, tree) and the data alone, not on n_threads.
    `on_samples(n)` is called, from the calling thread, as n further samples have reached their leaf.
    """
    raise NotImplementedError


def grow_direction_tree(
    crops: Crops, samples: Samples, directions: NDArray[np.int16], config: GrowthConfig,
    seed: int, tree: int, n_threads: int, on_samples: Callable[[int], object] = lambda n: None,
) -> GrownTree:  # fmt: skip
    """Grows one tree by the fall of the variance of unit directions, (n, 3) int16 of DIRECTION_ONE a unit."""
    raise NotImplementedError


DIRECTION_ONE = 16384
