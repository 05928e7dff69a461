"""The best split of one node: all candidates on a few samples, then the finalists on many."""

from typing import NamedTuple

import numpy as np
from numba import int32, njit, uint32
from numpy.typing import NDArray

from forests.crops import Crops
from forests.features import draw_feature, draw_hit, fact_values, feature_values, hit_values, probe_places
from forests.growing.bins import bin_threshold, bin_values, inner_range, n_inner_bins
from forests.growing.buffers import NodeSamples, Target, empty_buffers, first, gather_node
from forests.growing.gain import direction_gain, entropy_gain, n_log_n_table
from forests.samples import Samples

DEPTH_TO_HITS = 4
"""Where hints have classes, candidates that ask for depth to one that asks whether a probe hits a class."""


class Rules(NamedTuple):
    """`GrowthConfig`, what names the tree, and how many classes and facts hints have (0 = none), for kernels."""

    seed: int
    tree: int
    max_depth: int
    n_candidates: int
    candidates_per_sample: int
    n_thresholds: int
    max_samples: int
    n_racing_samples: int
    n_finalists: int
    min_samples_leaf: int
    max_offset: float
    n_hint_classes: int
    n_facts: int


class Scratch(NamedTuple):
    """Memory of one thread.

    Attributes:
        buffers: The node's samples.
        feature: (4,) float32.
        places: (max_samples,) int32.
        values: (max_samples,) int32.
        counts: (bins * classes,) uint32.
        sums: (bins * 4,) int64.
        left: (256,) uint32, by class alive.
        total: (256,) uint32, by class alive.
        column_of: (256,) int32, class -> class alive.
        gains: (n_candidates + candidates for hints,) float64.
        largest: (n_finalists,) float64.
        n_log_n: (max_samples + 1,) int64.
    """

    buffers: NodeSamples
    feature: NDArray[np.float32]
    places: NDArray[np.int32]
    values: NDArray[np.int32]
    counts: NDArray[np.uint32]
    sums: NDArray[np.int64]
    left: NDArray[np.uint32]
    total: NDArray[np.uint32]
    column_of: NDArray[np.int32]
    gains: NDArray[np.float64]
    largest: NDArray[np.float64]
    n_log_n: NDArray[np.int64]


class Pool(NamedTuple):
    """A node's candidates.

    Attributes:
        crops: Images.
        node: The node's number in the full binary tree.
        n_classes: As in `Target`.
        n_columns: Classes alive, or 4: words a bin.
        n_depth: The first so many candidates ask for depth, the rest for hints.
        gains: (n_candidates,) float64, gains so far.
    """

    crops: Crops
    node: int
    n_classes: int
    n_columns: int
    n_depth: int
    gains: NDArray[np.float64]


class Judged(NamedTuple):
    """The best candidate.

    Attributes:
        gain: Times samples; 0 if there is none.
        candidate: Its number, or -1.
        last_bin: The greatest bin that goes left.
        low: Of the inner range [mm].
        high: Of the inner range [mm].
    """

    gain: float
    candidate: int
    last_bin: int
    low: int
    high: int


@njit(cache=True, nogil=True)
def make_scratch(rules: Rules, target: Target, n: int) -> Scratch:
    """Memory for splitting nodes of up to n samples."""
    m = min(n, max(rules.max_samples, rules.n_racing_samples))
    n_bins = rules.n_thresholds + 1
    return Scratch(
        empty_buffers(m, m if len(target.directions) else 0),
        np.empty(4, np.float32),
        np.empty(m, np.int32),
        np.empty(m, np.int32),
        np.empty(n_bins * target.n_classes, np.uint32),
        np.empty(n_bins * 4, np.int64),
        np.empty(256, np.uint32),
        np.empty(256, np.uint32),
        np.empty(256, np.int32),
        np.empty(rules.n_candidates + n_hint_candidates(rules.n_candidates, rules), np.float64),
        np.empty(rules.n_finalists, np.float64),
        n_log_n_table(m),
    )


@njit(cache=True, nogil=True)
def best_split(
    crops: Crops, samples: Samples, target: Target, members: np.ndarray, node: int, rules: Rules, scratch: Scratch
) -> tuple[bool, int, int]:
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
        (a split was found, threshold [mm], what is asked (`forests.features`)).
    """
    n_columns = _count_columns(target, members, scratch.column_of)
    if target.n_classes and n_columns == 1:
        if len(target.directions) == 0:
            return False, 0, 0
        target, n_columns = Target(target.classes, 0, target.directions), 4
    n_racing = min(len(members), rules.n_racing_samples)
    m = min(len(members), rules.max_samples)
    n_depth = min(rules.n_candidates, rules.candidates_per_sample * len(members))
    n_candidates = n_depth + n_hint_candidates(n_depth, rules)
    gains = scratch.gains[:n_candidates]
    gains[:] = 0.0
    pool = Pool(crops, node, target.n_classes, n_columns, n_depth, gains)
    least, n_final = 0.0, n_candidates
    if n_racing < m and rules.n_finalists < n_candidates:
        race = _gathered(crops, samples, target, members, n_racing, node, rules, scratch)
        _judge(pool, race, 1, least, n_candidates, rules, scratch)
        least, n_final = _nth_largest(gains, scratch.largest), rules.n_finalists
    final = _gathered(crops, samples, target, members, m, node, rules, scratch)
    best = _judge(pool, final, rules.min_samples_leaf, least, n_final, rules, scratch)
    if best.gain <= 1e-9 * m:
        return False, 0, 0
    hint = draw_candidate(pool, best.candidate, rules, scratch.feature)
    return True, bin_threshold(best.last_bin, best.low, best.high, n_inner_bins(m, rules.n_thresholds)), hint


@njit(cache=True, nogil=True)
def n_hint_candidates(n_depth: int, rules: Rules) -> int:
    """Candidates of a node that ask for hints beside those that ask for depth: every fact is one."""
    n_hits = max(n_depth // DEPTH_TO_HITS, 1) if rules.n_hint_classes > 0 else 0
    return n_hits + rules.n_facts


@njit(cache=True, nogil=True)
def draw_candidate(pool: Pool, candidate: int, rules: Rules, feature: np.ndarray) -> int:
    """Draws a candidate's offsets; returns what it asks (`forests.features`)."""
    if candidate < pool.n_depth:
        draw_feature(rules.seed, rules.tree, pool.node, candidate, rules.max_offset, feature)
        return 0
    number = candidate - pool.n_depth
    if number < rules.n_facts:
        feature[:] = 0.0
        return -1 - number
    n_classes, limit = rules.n_hint_classes, rules.max_offset
    return draw_hit(rules.seed, rules.tree, pool.node, number - rules.n_facts, n_classes, limit, feature)


@njit(cache=True, nogil=True)
def _nth_largest(values: np.ndarray, largest: np.ndarray) -> float:
    """The n-th largest of the values for `largest` of length n: np.partition takes 5 s to compile."""
    largest[:] = -np.inf
    for value in values:
        if value > largest[-1]:
            place = len(largest) - 1
            while place > 0 and largest[place - 1] < value:
                largest[place] = largest[place - 1]
                place -= 1
            largest[place] = value
    return largest[-1]


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
            scratch.total[buffers.column[i]] += uint32(1)
    return first(buffers, m)


@njit(cache=True, nogil=True)
def _judge(
    pool: Pool, node: NodeSamples, min_samples: int, least: float, max_judged: int, rules: Rules, scratch: Scratch
) -> Judged:
    """The best of the first `max_judged` candidates whose gain so far is not below `least`; writes their gains.

    Arrays are taken out of their tuples before the loop: inside it, that would cost more than a few probes.
    """
    m = len(node.x)
    x, y, fx_z, fy_z, frame = node.x, node.y, node.fx_z, node.fy_z, node.frame
    right, bottom, width, start, z_mm = node.right, node.bottom, node.width, node.start, node.z_mm
    column, direction = node.column, node.direction
    places, values, feature = scratch.places[:m], scratch.values[:m], scratch.feature
    total, left, counts, sums = scratch.total[: pool.n_columns], scratch.left, scratch.counts, scratch.sums
    n_log_n, pixels, gains, n_columns, is_classes = (
        scratch.n_log_n,
        pool.crops.pixels,
        pool.gains,
        pool.n_columns,
        pool.n_classes > 0,
    )
    classes, facts = pool.crops.classes, pool.crops.facts
    n_inner = n_inner_bins(m, rules.n_thresholds)
    best, winner, best_bin, best_low, best_high = 0.0, -1, 0, int32(0), int32(0)
    n_judged = 0
    for candidate in range(len(gains)):
        if gains[candidate] < least or n_judged == max_judged:
            continue
        n_judged += 1
        hint = draw_candidate(pool, candidate, rules, feature)
        if hint == 0:
            feature_values(pixels, x, y, fx_z, fy_z, right, bottom, width, start, z_mm, feature, places, values)
        elif hint > 0:
            probe_places(x, y, fx_z, fy_z, right, bottom, width, feature[0], feature[1], places)
            hit_values(classes, start, places, hint, values)
        else:
            fact_values(facts, frame, hint, values)
        low, high = inner_range(values)
        bin_values(values, low, high, n_inner, n_columns, places)
        if is_classes:
            gain, last_bin = entropy_gain(places, column, total, n_inner + 2, min_samples, n_log_n, counts, left)
        else:
            gain, last_bin = direction_gain(places, direction, n_inner + 2, min_samples, sums)
        gains[candidate] = gain
        if gain > best:
            best, winner, best_bin, best_low, best_high = gain, candidate, last_bin, low, high
    return Judged(best, winner, best_bin, best_low, best_high)
