"""The best split of one node: all candidates on a few samples, then the finalists on many."""

from typing import NamedTuple

import numpy as np
from numba import int32, njit
from numpy.typing import NDArray

from forests.crops import Crops
from forests.features import draw_feature
from forests.growing.buffers import NodeSamples, Target, empty_buffers, first, gather_node
from forests.growing.candidates import bin_threshold, bin_values, candidate_values, inner_range
from forests.growing.gain import direction_gain, entropy_gain
from forests.samples import Samples


class Rules(NamedTuple):
    """`GrowthConfig` and what names the tree, for kernels."""

    seed: int
    tree: int
    max_depth: int
    n_candidates: int
    n_thresholds: int
    max_samples: int
    n_racing_samples: int
    n_finalists: int
    min_samples_leaf: int
    max_offset: float


class Scratch(NamedTuple):
    """Memory of one thread.

    Attributes:
        buffers: The node's samples.
        feature: (4,) float32.
        places: (max_samples,) int32.
        values: (max_samples,) int32.
        counts: (bins * classes,) int32.
        sums: (bins * 4,) int64.
        left: (256,) int32, by class alive.
        total: (256,) int32, by class alive.
        column_of: (256,) int32, class -> class alive.
        gains: (n_candidates,) float64.
        n_log_n: (max_samples + 1,) float64.
    """

    buffers: NodeSamples
    feature: NDArray[np.float32]
    places: NDArray[np.int32]
    values: NDArray[np.int32]
    counts: NDArray[np.int32]
    sums: NDArray[np.int64]
    left: NDArray[np.int32]
    total: NDArray[np.int32]
    column_of: NDArray[np.int32]
    gains: NDArray[np.float64]
    n_log_n: NDArray[np.float64]


@njit(cache=True, nogil=True)
def make_scratch(rules: Rules, n_classes: int, n: int) -> Scratch:
    """Memory for splitting nodes of up to n samples."""
    m = min(n, max(rules.max_samples, rules.n_racing_samples))
    n_bins = rules.n_thresholds + 1
    numbers = np.arange(m + 1).astype(np.float64)
    numbers[0] = 1.0
    n_log_n = numbers * np.log(numbers)
    return Scratch(
        empty_buffers(m, 0 if n_classes else m),
        np.empty(4, np.float32),
        np.empty(m, np.int32),
        np.empty(m, np.int32),
        np.empty(n_bins * n_classes, np.int32),
        np.empty(n_bins * 4, np.int64),
        np.empty(256, np.int32),
        np.empty(256, np.int32),
        np.empty(256, np.int32),
        np.empty(rules.n_candidates, np.float64),
        n_log_n,
    )


@njit(cache=True, nogil=True)
def best_split(
    crops: Crops, samples: Samples, target: Target, members: np.ndarray, node: int, rules: Rules, scratch: Scratch
) -> tuple[bool, int]:
    """The best split of a node; its offsets are left in `scratch.feature`.

    Args:
        crops: Images.
        samples: Pixels.
        target: What they are.
        members: (n,) int32, the node's samples.
        node: The node's number in the full binary tree.
        rules: How.
        scratch: Memory.

    Returns:
        (a split was found, threshold [mm]).
    """
    n_columns = _count_columns(target, members, scratch.column_of)
    if target.n_classes and n_columns == 1:
        return False, 0
    gains = scratch.gains
    n_racing = min(len(members), rules.n_racing_samples)
    m = min(len(members), rules.max_samples)
    least = -np.inf
    if n_racing < m and rules.n_finalists < rules.n_candidates:
        race = _gathered(crops, samples, target, members, n_racing, node, rules, scratch)
        for candidate in range(rules.n_candidates):
            draw_feature(rules.seed, rules.tree, node, candidate, rules.max_offset, scratch.feature)
            gains[candidate] = _judge(
                crops.pixels, race, target, n_columns, _n_inner(n_racing, rules), 1, scratch
            )[0]
        least = np.partition(gains, rules.n_candidates - rules.n_finalists)[rules.n_candidates - rules.n_finalists]
    final = _gathered(crops, samples, target, members, m, node, rules, scratch)
    n_inner = _n_inner(m, rules)
    best, winner, n_judged = 0.0, -1, 0
    best_bin, best_low, best_high = 0, int32(0), int32(0)
    for candidate in range(rules.n_candidates):
        if least > -np.inf and (gains[candidate] < least or n_judged == rules.n_finalists):
            continue
        n_judged += 1
        draw_feature(rules.seed, rules.tree, node, candidate, rules.max_offset, scratch.feature)
        gain, last_bin, low, high = _judge(
            crops.pixels, final, target, n_columns, n_inner, rules.min_samples_leaf, scratch
        )
        if gain > best:
            best, winner = gain, candidate
            best_bin, best_low, best_high = last_bin, low, high
    if winner < 0 or best <= 1e-9 * m:
        return False, 0
    draw_feature(rules.seed, rules.tree, node, winner, rules.max_offset, scratch.feature)
    return True, bin_threshold(best_bin, best_low, best_high, n_inner)


@njit(cache=True, nogil=True, inline="always")
def _n_inner(m: int, rules: Rules) -> int:
    """Bins between the extreme ones: no more than every few samples need."""
    return max(min(rules.n_thresholds - 1, m // 8), 2)


@njit(cache=True, nogil=True)
def _count_columns(target: Target, members: np.ndarray, column_of: np.ndarray) -> int:
    """Numbers the classes alive in a node."""
    if not target.n_classes:
        return 4
    column_of[: target.n_classes] = -1
    for s in members:
        column_of[target.classes[s]] = 0
    n_columns = 0
    for c in range(target.n_classes):
        if column_of[c] == 0:
            column_of[c] = n_columns
            n_columns += 1
    return n_columns


@njit(cache=True, nogil=True)
def _gathered(
    crops: Crops, samples: Samples, target: Target, members: np.ndarray, m: int, node: int, rules: Rules,
    scratch: Scratch,
) -> NodeSamples:  # fmt: skip
    """Some of the node's samples, and `scratch.total` of them."""
    buffers = scratch.buffers
    gather_node(crops, samples, target, members, m, rules.seed, rules.tree, node, scratch.column_of, buffers)
    if target.n_classes:
        scratch.total[:] = 0
        for i in range(m):
            scratch.total[buffers.column[i]] += 1
    return first(buffers, m)


@njit(cache=True, nogil=True)
def _judge(
    pixels: np.ndarray, node: NodeSamples, target: Target, n_columns: int, n_inner: int, min_samples: int,
    scratch: Scratch,
) -> tuple[float, int, int, int]:  # fmt: skip
    """(gain, last bin of the left side, low, high) of the feature in `scratch.feature`."""
    m = len(node.x)
    places, values = scratch.places[:m], scratch.values[:m]
    candidate_values(pixels, node, scratch.feature, places, values)
    low, high = inner_range(values)
    bin_values(values, low, high, n_inner, n_columns, places)
    if target.n_classes:
        total = scratch.total[:n_columns]
        gain, last = entropy_gain(
            places, node.column, total, n_inner + 2, min_samples, scratch.n_log_n, scratch.counts, scratch.left
        )
    else:
        gain, last = direction_gain(places, node.direction, n_inner + 2, min_samples, scratch.sums)
    return gain, last, low, high
