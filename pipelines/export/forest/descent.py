"""Part of a forest's graph: pixels go down all trees, level by level, as `forests.oarf.descend.descend` has it."""

import numpy as np
from numpy.typing import NDArray

from forests.features import FEATURE_LIMIT_MM
from forests.oarf.descend import FlatTrees
from nets.values import Value, constant
from pipelines.export.forest.pixels import Foreground, Voters


def leaves_of(trees: FlatTrees, foreground: Foreground, voters: Voters, focal: Value) -> Value:
    """(n_trees, n) int32: the leaves that voters reach, numbered through all trees.

    Args:
        trees: Trees that ask for depth alone.
        foreground: The image.
        voters: Pixels in it.
        focal: (2,) float32, fx and fy [px].
    """
    graph, nodes = foreground.image.graph, trees.nodes
    both = np.stack([[nodes["uy"], nodes["ux"]], [nodes["vy"], nodes["vx"]]]).transpose(2, 0, 1)
    offsets, threshold, left = (constant(graph, of) for of in (both, nodes["threshold"], nodes["left"]))
    rows_columns = focal.at(np.array([1, 0]))
    # The arithmetic is that of `descend`, in float32 and in the crop, so that roundings are the same.
    pixel = (voters.pixels + 1 - foreground.origin).cast(np.float32) + 0.5
    scale = (rows_columns * 1000.0) / voters.depth_mm.cast(np.float32).with_axis(1)
    pixel, scale = pixel.with_axis(1), scale.with_axis(1)
    farthest = foreground.size.cast(np.float32) - 0.5

    n_voters = (voters.depth_mm * 0).with_axis(0)
    at = constant(graph, trees.roots[:, None]) + n_voters
    for _ in range(n_levels(trees)):
        place = (pixel + scale * offsets.at(at)).most(0.5).least(farthest).cast(np.int64)
        read = foreground.image.at_each(place + foreground.origin)
        difference = read.pick(0, 2) - read.pick(1, 2)
        difference = difference.most(-FEATURE_LIMIT_MM).least(FEATURE_LIMIT_MM)
        at = left.at(at) + (difference > threshold.at(at)).cast(np.int32)
    return constant(graph, np.ascontiguousarray(nodes["leaf"])).at(at)


def n_levels(trees: FlatTrees) -> int:
    """Decisions on the longest way from a root to a leaf."""
    n, at = 0, inner(trees, trees.roots)
    while len(at):
        left = trees.nodes["left"][at]
        n, at = n + 1, inner(trees, np.concatenate([left, left + 1]))
    return n


def inner(trees: FlatTrees, at: NDArray[np.int32]) -> NDArray[np.int32]:
    """Those of some nodes that are no leaves."""
    return at[trees.nodes["leaf"][at] < 0]
