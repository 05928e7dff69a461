"""Part of a forest's graph: the votes that leaves cast, as `forests.oarf.vote.cast_votes` has it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.oarf.packed import WEIGHT_ONE
from forests.oarf.vote import VoteTable
from nets.values import Value, constant, counted, joined, zeros


class CastVotes(NamedTuple):
    """Votes for all joints, those of body modes first, and at the end for each joint one that weighs nothing.

    Attributes:
        place: (n, 3) float32, in the camera's frame [m].
        weight: (n,) float32.
        joint: (n,) int64.
    """

    place: Value
    weight: Value
    joint: Value


def cast_votes(table: VoteTable, leaves: Value, points: Value) -> CastVotes:
    """The votes of pixels that have reached their leaves.

    Args:
        table: Votes of the leaves.
        leaves: (n_trees, n) int32, numbered through all trees.
        points: (n, 3) float32, the pixels in the camera's frame [m].
    """
    graph, n_joints = leaves.graph, table.n_streams // table.n_layers
    starts = layer_starts(table)
    begin, count = (
        constant(graph, of).at(leaves, axis=1).turned(0, 2, 1)  # (n_layers, n, n_trees): in the order of voting
        for of in (starts[:, :-1].copy(), np.diff(starts, axis=1))
    )
    most = int(np.diff(starts, axis=1).max(initial=0))
    ranks = np.arange(most, dtype=np.int32)
    voting = (count.with_axis(3) > ranks).true_places().turned(1, 0)
    entry = begin.at_each(voting.part([0], [3], [1])) + voting.pick(3, 1).cast(np.int32)
    point = points.at(voting.pick(1, 1))
    entries = in_layers(table)
    offset, weight, joint = (
        constant(graph, np.ascontiguousarray(of)).at(entry)
        for of in (entries[:, :3], entries[:, 3], (entries[:, 4] // table.n_layers).astype(np.int16))
    )
    z = point.pick(2, 1)
    area = z * z * float(np.float32(1.0 / WEIGHT_ONE))
    nothing = constant(graph, np.zeros(n_joints, np.float32))
    return CastVotes(
        joined([point + offset.cast(np.float32) * 1e-3, zeros(np.float32, [n_joints, 3], graph)], 0),
        joined([area * weight.cast(np.float32), nothing], 0),
        joined([joint.cast(np.int64), counted(nothing.size(0))], 0),
    )


def in_layers(table: VoteTable) -> NDArray[np.int16]:
    """The table's entries with all of the first layer before all of the second."""
    order = np.argsort(table.entries[:, 4] % table.n_layers, kind="stable")
    return table.entries[order]


def layer_starts(table: VoteTable) -> NDArray[np.int32]:
    """(n_layers, n_leaves + 1) int32: where in `in_layers` the votes of a leaf begin, and end."""
    layer = table.entries[:, 4] % table.n_layers
    starts, before = [], 0
    for number in range(table.n_layers):
        passed = np.concatenate([np.zeros(1, np.int64), np.cumsum(layer == number)])
        starts.append(before + passed[table.start])
        before += passed[-1]
    return np.stack(starts).astype(np.int32)
