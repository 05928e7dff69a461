"""Splitting nodes and growing whole subtrees: the compiled part of growing."""

from typing import NamedTuple

import numpy as np
from numba import int32, njit
from numpy.typing import NDArray

from forests.crops import Crops
from forests.features import difference, hint_value, pixels_per_metre, probe
from forests.growing.buffers import Target
from forests.growing.splitting import Rules, best_split, make_scratch
from forests.samples import Samples


class GrownNodes(NamedTuple):
    """Nodes as they were grown, in any order.

    Attributes:
        number: (n,) int64, in the full binary tree (root 1, children 2i and 2i + 1).
        begin: (n,) int64, the node's samples are order[begin:end].
        end: (n,) int64.
        feature: (n, 4) float32 (ux, uy, vx, vy) [m].
        threshold: (n,) int32 [mm], or of the hint.
        hint: (n,) int16, what is asked (`forests.features`).
        is_split: (n,) bool, False = leaf.
    """

    number: NDArray[np.int64]
    begin: NDArray[np.int64]
    end: NDArray[np.int64]
    feature: NDArray[np.float32]
    threshold: NDArray[np.int32]
    hint: NDArray[np.int16]
    is_split: NDArray[np.bool_]


@njit(cache=True, nogil=True)
def grow_nodes(
    crops: Crops, samples: Samples, target: Target, order: np.ndarray, node: int, depth: int, begin: int, end: int,
    max_nodes: int, rules: Rules, stop: np.ndarray,
) -> tuple[GrownNodes, np.ndarray]:  # fmt: skip
    """Grows the subtree below a node, depth first, or the first nodes of it.

    Args:
        crops: Images.
        samples: Pixels.
        target: What they are.
        order: (n_samples,) int32; order[begin:end] is permuted so that every node's samples are a stretch of it.
        node: Number in the full binary tree.
        depth: Decisions above it.
        begin: Of its samples in `order`.
        end: Of its samples in `order`.
        max_nodes: Nodes grown at most.
        rules: How.
        stop: (1,) bool, set from outside to give up.

    Returns:
        (the nodes, (n, 4) int64 number, depth, begin and end of the nodes that are left to do).
    """
    room = max(min(max_nodes, 2 * ((end - begin) // rules.min_samples_leaf) - 1), 1)
    grown = GrownNodes(
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
        np.zeros((room, 4), np.float32),
        np.zeros(room, np.int32),
        np.zeros(room, np.int16),
        np.zeros(room, np.bool_),
    )
    scratch = make_scratch(rules, target, end - begin)
    moved = np.empty(end - begin, np.int32)
    todo = np.empty((rules.max_depth + 2, 4), np.int64)
    _set_task(todo[0], node, depth, begin, end)
    n_todo, n_grown = 1, 0
    while n_todo > 0 and n_grown < max_nodes and not stop[0]:
        n_todo -= 1
        number, level, first, last = todo[n_todo]
        grown.number[n_grown], grown.begin[n_grown], grown.end[n_grown] = number, first, last
        members = order[first:last]
        if level < rules.max_depth and last - first >= 2 * rules.min_samples_leaf:
            is_split, threshold, hint = best_split(crops, samples, target, members, number, rules, scratch)
            if is_split:
                grown.is_split[n_grown] = True
                grown.feature[n_grown] = scratch.feature
                grown.threshold[n_grown], grown.hint[n_grown] = threshold, hint
                middle = first + _partition(crops, samples, members, scratch.feature, hint, threshold, moved)
                _set_task(todo[n_todo], 2 * number + 1, level + 1, middle, last)
                _set_task(todo[n_todo + 1], 2 * number, level + 1, first, middle)
                n_todo += 2
        n_grown += 1
    kept = GrownNodes(
        grown.number[:n_grown].copy(),
        grown.begin[:n_grown].copy(),
        grown.end[:n_grown].copy(),
        grown.feature[:n_grown].copy(),
        grown.threshold[:n_grown].copy(),
        grown.hint[:n_grown].copy(),
        grown.is_split[:n_grown].copy(),
    )
    return kept, todo[:n_todo].copy()


def grow_subtree(
    crops: Crops, samples: Samples, target: Target, node: int, depth: int, members: NDArray[np.int32], rules: Rules
) -> tuple[GrownNodes, NDArray[np.int32]]:
    """Grows the subtree below a node from its samples alone, wherever it is called.

    Returns:
        (the nodes, whose begin and end count in the members; the members in the order of the leaves).
    """
    order = members.copy()
    stop = np.zeros(1, np.bool_)
    grown, _ = grow_nodes(crops, samples, target, order, node, depth, 0, len(order), 2**62, rules, stop)
    return grown, order


@njit(cache=True, nogil=True)
def _set_task(task: np.ndarray, number: int, depth: int, begin: int, end: int) -> None:
    task[0], task[1], task[2], task[3] = number, depth, begin, end


@njit(cache=True, nogil=True)
def _partition(
    crops: Crops, samples: Samples, members: np.ndarray, feature: np.ndarray, hint: int, threshold: int,
    moved: np.ndarray,
) -> int:  # fmt: skip
    """Moves the samples that go left to the front, keeping the order on both sides; returns how many there are."""
    half = np.float32(0.5)
    n_left, n_right = 0, 0
    for i in range(len(members)):
        s = members[i]
        frame = samples.frame[s]
        x, y = np.float32(samples.x[s]) + half, np.float32(samples.y[s]) + half
        fx_z = pixels_per_metre(crops.intrinsics[frame, 0], samples.z_mm[s])
        fy_z = pixels_per_metre(crops.intrinsics[frame, 1], samples.z_mm[s])
        start, width, height = crops.start[frame], crops.width[frame], crops.height[frame]
        if hint != 0:
            value = hint_value(
                crops.classes, crops.facts, frame, start, width, height, x, y, fx_z, fy_z, feature, hint
            )
        else:
            u = probe(crops.pixels, start, width, height, x, y, fx_z, fy_z, feature[0], feature[1])
            v = int32(samples.z_mm[s])
            if feature[2] != 0.0 or feature[3] != 0.0:
                v = int32(probe(crops.pixels, start, width, height, x, y, fx_z, fy_z, feature[2], feature[3]))
            value = difference(u, v)
        if value > threshold:
            moved[n_right] = s
            n_right += 1
        else:
            members[n_left] = s
            n_left += 1
    members[n_left:] = moved[:n_right]
    return n_left
