"""What the leaves of a grown tree know: classes, and modes of the offsets to each joint."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.frames import is_known
from forests.growing import Call, Crew, GrownTree
from forests.hashing import hash4, splitmix64
from forests.modes import WeightedPoints, bell, find_modes, keep_heaviest
from forests.oarf.packed import LeafTable
from forests.samples import TrainingSet

N_DRAWN = 400
"""Samples of a leaf and layer that mean shift looks at, drawn by hash where there are more."""
N_STARTS = 96
"""Samples of these that climb; the others end where their neighbour in the leaf ends."""
_TASK_LEAVES = 1024
_VOTE_STREAM = 0x1EAF_0000_0000
"""Beyond the numbers of candidates, which are hashed with the same seed and tree."""


class _Seen(NamedTuple):
    """What mean shift at the leaves reads, the same for all of them.

    `is_known` (n_frames, n_joints + 1) says which joints a frame knows; the last column is true throughout. `facing`
    is (n_frames, 2), or (0, 2) where headings are not learned. `layer` is 0 of body samples, 1 of occluder samples, and
    2 of those that vote for nothing.
    """

    points: NDArray[np.float32]
    frame: NDArray[np.int32]
    layer: NDArray[np.uint8]
    joints: NDArray[np.float32]
    is_known: NDArray[np.bool_]
    facing: NDArray[np.float32]


class LeafRules(NamedTuple):
    """What a tree's leaves are made by.

    Attributes:
        n_classes: Classes.
        n_parts: The first so many classes are body parts; if all are, there is one layer.
        bandwidth_m: b [m].
        n_leaf_votes: Votes kept a joint and layer.
        seed: Of the forest.
        tree: The tree's number.
        n_drawn: Samples of a leaf and layer that are looked at, at most.
        n_starts: Samples of these that climb, at most.
        n_silent: The last so many classes vote for nothing.
    """

    n_classes: int
    n_parts: int
    bandwidth_m: float
    n_leaf_votes: int
    seed: int
    tree: int
    n_drawn: int = N_DRAWN
    n_starts: int = N_STARTS
    n_silent: int = 0


class _Votes(NamedTuple):
    """Votes, weights and facings of leaves, as `LeafTable` has them; no facings where headings are not learned."""

    vote: NDArray[np.float32]
    weight: NDArray[np.float32]
    facing: NDArray[np.float32]


def leaf_table(
    training: TrainingSet,
    classes: NDArray[np.uint8],
    grown: GrownTree,
    rules: LeafRules,
    n_threads: int = 1,
    on_leaves: Callable[[int], object] = lambda n: None,
    facing: NDArray[np.float32] | None = None,
    crew: Crew | None = None,
) -> LeafTable:
    """Learns the leaves of a tree (equations 5 and 8).

    Mean shift runs on the offsets from samples to a joint, in each leaf on those of body samples and on those of
    occluder samples for themselves. Samples of surroundings vote for nothing, but count: a leaf that holds many of them
    says little.

    A sample votes for the joints that its frame knows. The rest of a leaf's samples are taken to be like them: a
    mode's weight is the share of the leaf's samples that know the joint, of both layers, that climb to it. So a
    joint that half of the frames know is found with the confidence of one that all know, and what a leaf says of
    a joint is what it would say if the other frames were not there. A joint that nobody in a leaf knows gets no
    modes there.

    Args:
        training: What the tree was grown on.
        classes: (n_samples,) uint8, body parts first.
        grown: The tree, and the samples of its leaves: all, or those that they are to learn from.
        rules: How.
        n_threads: Threads; the table is the same for any number.
        on_leaves: Told, from the calling thread, how many further leaves are done.
        facing: (n_frames, 2) float32, cosine and sine of people's headings, zeros where not known; None = votes
            do not learn which way people face.
        crew: Learns the votes in place of threads; the table is the same.

    Raises:
        ValueError: A rule out of range, or classes that do not fit the tree.
    """
    _check(classes, grown, rules, n_threads)
    n_leaves, n_layers = len(grown.leaf_start) - 1, 1 if rules.n_classes == rules.n_parts else 2
    shape = (n_leaves, n_layers, training.joints.shape[1], rules.n_leaf_votes)
    shapes = (*shape, 3), shape, (*shape, 2) if facing is not None else (0, 0, 0, 0, 2)
    out = _Votes(*(np.zeros(each, np.float32) for each in shapes))
    layers = (classes >= rules.n_parts).astype(np.uint8) + (classes >= rules.n_classes - rules.n_silent)
    seen = _seen(training, layers.astype(np.uint8), facing)
    if crew is None:
        _learn_votes(grown, rules, out, partial(_called, seen), n_threads, on_leaves)
    else:
        with crew.sharing(seen) as call:
            _learn_votes(grown, rules, out, call, crew.n_calls, on_leaves)
    shares = _class_shares(grown, classes, rules.n_classes)
    return LeafTable(shares, out.vote, out.weight, None if facing is None else out.facing)


def _learn_votes(
    grown: GrownTree, rules: LeafRules, out: _Votes, call: Call, n_calls: int, on_leaves: Callable[[int], object]
) -> None:
    """Fills in the votes of all leaves, so many stretches of leaves at a time."""
    n_leaves = len(grown.leaf_start) - 1

    def run(first: int) -> int:
        last = min(first + _TASK_LEAVES, n_leaves)
        start = grown.leaf_start[first : last + 1]
        parts = [part[first:last] for part in out]
        members, shapes = grown.order[start[0] : start[-1]], tuple(part.shape for part in parts)
        for part, found in zip(
            parts, call(_votes_of_leaves, start - start[0], members, first, rules, shapes), strict=True
        ):
            part[:] = found
        return last - first

    _run_all(run, n_leaves, n_calls, on_leaves)


def _run_all(run: Callable[[int], int], n_leaves: int, n_threads: int, on_leaves: Callable[[int], object]) -> None:
    with ThreadPoolExecutor(n_threads) as pool:
        try:
            for task in as_completed([pool.submit(run, first) for first in range(0, n_leaves, _TASK_LEAVES)]):
                on_leaves(task.result())
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def regrouped(nodes: NDArray, n_leaves: int, leaf: NDArray[np.int32], is_kept: NDArray[np.bool_]) -> GrownTree:
    """A tree with a part of its samples, to learn its leaves anew from them.

    Args:
        nodes: Of the tree.
        n_leaves: Leaves of the tree.
        leaf: (n_samples,) int32, the leaf of each sample.
        is_kept: (n_samples,) bool, which samples stay.
    """
    kept = np.flatnonzero(is_kept).astype(np.int32)
    start = np.zeros(n_leaves + 1, np.int64)
    np.cumsum(np.bincount(leaf[kept], minlength=n_leaves), out=start[1:])
    return GrownTree(nodes, start, kept[np.argsort(leaf[kept], kind="stable")])


def _seen(training: TrainingSet, layer: NDArray[np.uint8], facing: NDArray[np.float32] | None) -> _Seen:
    everybody = np.ones((len(training.joints), 1), np.bool_)
    known = np.hstack([is_known(training.joints), everybody])
    samples = training.samples
    faced = np.empty((0, 2), np.float32) if facing is None else facing
    return _Seen(samples.points(training.crops), samples.frame, layer, training.joints, known, faced)


def _check(classes: NDArray[np.uint8], grown: GrownTree, rules: LeafRules, n_threads: int) -> None:
    n_parts, n_classes = rules.n_parts, rules.n_classes
    if not 1 <= n_parts <= n_classes <= 256:
        raise ValueError(f"n_parts={n_parts} and n_classes={n_classes} must be in 1..256, parts not above classes")
    if classes.ndim != 1 or len(classes) < len(grown.order) or classes.dtype != np.uint8:
        raise ValueError(f"classes are {classes.dtype} {classes.shape}, must be uint8 {grown.order.shape}")
    if len(classes) and classes.max() >= n_classes:
        raise ValueError(f"class {classes.max()} is not in 0..{n_classes - 1}")
    if not 0.0 < rules.bandwidth_m < np.inf:
        raise ValueError(f"bandwidth_m={rules.bandwidth_m} must be above 0 and finite")
    for name in ("n_leaf_votes", "n_drawn", "n_starts"):
        if getattr(rules, name) < 1:
            raise ValueError(f"{name}={getattr(rules, name)} must be at least 1")
    if n_threads < 1:
        raise ValueError(f"n_threads={n_threads} must be at least 1")


def _class_shares(grown: GrownTree, classes: NDArray[np.uint8], n_classes: int) -> NDArray[np.float32]:
    """(n_leaves, n_classes) float32, p(c | leaf); a leaf without samples knows nothing: all classes alike."""
    n_samples = np.diff(grown.leaf_start)
    row = np.repeat(np.arange(len(n_samples)), n_samples) * n_classes
    count = np.bincount(row + classes[grown.order], minlength=len(n_samples) * n_classes)
    share = np.full((len(n_samples), n_classes), 1.0 / n_classes)
    np.divide(count.reshape(share.shape), n_samples[:, None], out=share, where=n_samples[:, None] > 0)
    return share.astype(np.float32)


def _called(seen: _Seen, function: Call, *arguments: object) -> Any:
    return function(seen, *arguments)


def _votes_of_leaves(
    seen: _Seen,
    leaf_start: NDArray[np.int64],
    order: NDArray[np.int32],
    first: int,
    rules: LeafRules,
    shapes: tuple[tuple[int, ...], ...],
) -> _Votes:
    """What leaves from number `first` on learn, from their samples alone."""
    found = _Votes(*(np.zeros(shape, np.float32) for shape in shapes))
    _cluster_leaves(seen, leaf_start, order, first, rules, *found)
    return found


@njit(cache=True, nogil=True)
def _cluster_leaves(
    seen: _Seen, leaf_start: np.ndarray, order: np.ndarray, first: int, rules: LeafRules,
    vote: np.ndarray, weight: np.ndarray, facing: np.ndarray,
) -> None:  # fmt: skip
    """Writes votes, weights and, if they are learned, facings of the leaves first, first + 1, ... to rows from 0."""
    n_layers, n_joints = weight.shape[1], weight.shape[2]
    columns = np.empty(n_joints, np.int64)
    drawn = np.empty(rules.n_drawn, np.int32)
    x, y, z = np.empty(rules.n_drawn), np.empty(rules.n_drawn), np.empty(rules.n_drawn)
    ones = np.ones(rules.n_drawn)
    found = np.empty((min(rules.n_drawn, rules.n_starts), 5))
    for row in range(len(leaf_start) - 1):
        leaf = first + row
        members = order[leaf_start[row] : leaf_start[row + 1]]
        _choose_columns(seen, members, columns)
        for layer in range(n_layers):
            column, n, share = -1, 0, 0.0
            for joint in range(n_joints):
                if columns[joint] != column:
                    column = columns[joint]
                    n, share = _draw(seen, members, layer, column, leaf, rules, drawn)
                if n == 0:
                    continue
                points = WeightedPoints(x[:n], y[:n], z[:n], ones[:n])
                _offsets(seen, drawn, joint, points)
                n_found = find_modes(points, rules.bandwidth_m, rules.n_starts, found)
                for k in range(n_found):
                    found[k, 3] *= share
                votes, weights = vote[row, layer, joint], weight[row, layer, joint]
                keep_heaviest(found, n_found, votes, weights)
                if len(facing) > 0:
                    _average_facings(
                        seen, drawn, points, rules.bandwidth_m, votes, weights, facing[row, layer, joint]
                    )


@njit(cache=True, nogil=True)
def _choose_columns(seen: _Seen, members: np.ndarray, columns: np.ndarray) -> None:
    """Fills in, by joint, the column of `is_known` that tells who votes for it: the last if all of a leaf do."""
    columns[:] = len(columns)
    for s in members:
        frame = seen.frame[s]
        for joint in range(len(columns)):
            if not seen.is_known[frame, joint]:
                columns[joint] = joint


@njit(cache=True, nogil=True)
def _draw(
    seen: _Seen, members: np.ndarray, layer: int, column: int, leaf: int, rules: LeafRules, drawn: np.ndarray
) -> tuple[int, float]:
    """Draws samples of one layer that vote: one out of each of n_drawn equal stretches, by hash.

    Returns:
        How many, and the share of both layers' voters that each of them stands for.
    """
    n_of_layer, n_of_all = 0, 0
    for s in members:
        n_of_all += seen.is_known[seen.frame[s], column]
        n_of_layer += seen.is_known[seen.frame[s], column] and seen.layer[s] == layer
    if n_of_layer == 0:
        return 0, 0.0
    n = min(n_of_layer, len(drawn))
    key = hash4(rules.seed, rules.tree, leaf, _VOTE_STREAM + layer)
    k, number = 0, 0
    place = np.int64(splitmix64(key) % np.uint64(n_of_layer // n))
    for s in members:
        if seen.layer[s] != layer or not seen.is_known[seen.frame[s], column]:
            continue
        if number == place:
            drawn[k] = s
            k += 1
            if k == n:
                break
            begin, end = k * n_of_layer // n, (k + 1) * n_of_layer // n
            place = begin + np.int64(splitmix64(key + np.uint64(k)) % np.uint64(end - begin))
        number += 1
    return n, n_of_layer / (n * n_of_all)


@njit(cache=True, nogil=True)
def _offsets(seen: _Seen, drawn: np.ndarray, joint: int, offsets: WeightedPoints) -> None:
    """Fills in the offsets from the samples' points to a joint [m]."""
    for i in range(len(offsets.x)):
        s = drawn[i]
        frame = seen.frame[s]
        offsets.x[i] = seen.joints[frame, joint, 0] - seen.points[s, 0]
        offsets.y[i] = seen.joints[frame, joint, 1] - seen.points[s, 1]
        offsets.z[i] = seen.joints[frame, joint, 2] - seen.points[s, 2]


@njit(cache=True, nogil=True)
def _average_facings(
    seen: _Seen, drawn: np.ndarray, offsets: WeightedPoints, bandwidth: float, votes: np.ndarray,
    weights: np.ndarray, facing: np.ndarray,
) -> None:  # fmt: skip
    """Fills in, for the votes of a joint, which way the people face whose samples' offsets are near to each."""
    scale = 1.0 / (32.0 * bandwidth * bandwidth)
    for k in range(len(weights)):
        if weights[k] == 0.0:
            continue
        cos, sin, total = 0.0, 0.0, 0.0
        for i in range(len(offsets.x)):
            dx, dy, dz = offsets.x[i] - votes[k, 0], offsets.y[i] - votes[k, 1], offsets.z[i] - votes[k, 2]
            near = bell(min((dx * dx + dy * dy + dz * dz) * scale, 1.0))
            frame = seen.frame[drawn[i]]
            cos += near * seen.facing[frame, 0]
            sin += near * seen.facing[frame, 1]
            total += near
        facing[k, 0], facing[k, 1] = cos / total, sin / total
