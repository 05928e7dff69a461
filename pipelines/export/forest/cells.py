"""Part of a forest's graph: votes are summed up in cells, as `forests.oarf.peaks` has it, the heavy ones by joint."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.oarf.peaks import CELL, LIGHTEST
from nets.values import LAST, Value, constant, joined, zeros
from pipelines.export.forest.votes import CastVotes

CELLS_A_SIDE = 2**18
"""Cells along an axis that a key tells apart: 105 m to each side for the narrowest kernel."""


class Cells(NamedTuple):
    """Cells of votes of each joint, in the order of their first votes; weights of 0 fill up the rows.

    Attributes:
        place: (n_joints, n, 3) float32, centroids relative to `origin`, in bandwidths.
        weight: (n_joints, n) float32.
        origin: (n_joints, 3) float64, centroid of the heaviest cell [m].
    """

    place: Value
    weight: Value
    origin: Value


def bin_votes(votes: CastVotes, bandwidth: NDArray[np.float32]) -> Cells:
    """Sums up votes in cells of CELL bandwidths; drops those lighter than LIGHTEST of a joint's heaviest.

    Args:
        votes: Votes.
        bandwidth: (n_joints,) float32, b_j [m].
    """
    graph, n_joints = votes.place.graph, len(bandwidth)
    sums, joint = _sums(votes, bandwidth)
    of_joint = joint.equals(np.arange(n_joints)[:, None])
    heaviest = of_joint.where(sums.pick(0, 1), -1.0)
    most, which = heaviest.max(1), heaviest.first_of_most(1)
    kept = (sums.pick(0, 1) >= most.at(joint) * LIGHTEST).true_places().pick(0)

    wide = bandwidth.astype(np.float64)
    origin = _centroids(sums.at(which))
    joint, sums = joint.at(kept), sums.at(kept)
    place = (_centroids(sums) - origin.at(joint)) * constant(graph, 1.0 / wide).at(joint).with_axis(1)
    cells = joined([place, sums.part([0], [1], [1])], 1).cast(np.float32)

    is_of = of_joint.at(kept, axis=1).cast(np.int32)
    rank = (is_of * is_of.running_sum(1)).sum(0).cast(np.int64) - 1
    rows = zeros(np.float32, [n_joints, rank.max(0) + 1, 4], graph)
    rows = rows.node("ScatterND", joined([joint.with_axis(1), rank.with_axis(1)], 1), cells)
    return Cells(rows.part([0], [3], [2]), rows.pick(3, 2), origin)


def _centroids(sums: Value) -> Value:
    """(n, 3) of sums (n, 4): w, w x, w y, w z."""
    return sums.part([1], [4], [1]) / sums.part([0], [1], [1]).most(1e-300)


def _sums(votes: CastVotes, bandwidth: NDArray[np.float32]) -> tuple[Value, Value]:
    """Of each cell (n, 4) float64 w, w x, w y, w z, and (n,) int64 its joint, in the order of their first votes."""
    graph = votes.place.graph
    n = votes.joint.size(0)
    key, order = _keys(votes, bandwidth).sorted(n.reshaped(1), 0, is_rising=True)
    # Equal keys lie together, the first vote first: all of them are added up in its place.
    is_same = key.part([1], [LAST], [0]).equals(key.part([0], [-1], [0]))
    is_new = joined([constant(graph, np.ones(1, bool)), ~is_same], 0)
    firsts = order.at(is_new.true_places().pick(0))
    into = firsts.at(is_new.cast(np.int64).running_sum(0) - 1)
    weight = votes.weight.with_axis(1)
    votes_4 = joined([weight, weight * votes.place], 1).cast(np.float64).at(order)
    into_4 = into.with_axis(1) + np.zeros(4, np.int64)
    sums = zeros(np.float64, [n, 4], graph).node("ScatterElements", into_4, votes_4, axis=0, reduction="add")
    ones = (firsts * 0 + 1).cast(np.int32)
    cells = zeros(np.int32, [n], graph).node("ScatterElements", firsts, ones, axis=0).true_places().pick(0)
    return sums.at(cells), votes.joint.at(cells)


def _keys(votes: CastVotes, bandwidth: NDArray[np.float32]) -> Value:
    """(n,) int64, a number for each joint and cell."""
    graph, half = votes.place.graph, CELLS_A_SIDE // 2
    per_metre = (1.0 / (bandwidth.astype(np.float64) * CELL)).astype(np.float32)
    place = (votes.place * constant(graph, per_metre).at(votes.joint).with_axis(1)).floor()
    index = place.cast(np.int64).most(-half).least(half - 1) + half
    key = votes.joint
    for axis in range(3):
        key = key * CELLS_A_SIDE + index.pick(axis, 1)
    return key
