"""A regression forest as a graph in the ONNX format: from a depth image to the leaves, and to the joints."""

import json

import numpy as np

from forests.oarf.descend import flatten
from forests.oarf.model import OARFModel
from forests.oarf.vote import vote_table
from forests.records import to_json
from nets.graph import Graph
from nets.values import Value
from pipelines.export.errors import UnexportableError
from pipelines.export.forest.cells import bin_votes
from pipelines.export.forest.descent import leaves_of
from pipelines.export.forest.modes import modes_of_cells, settle
from pipelines.export.forest.pixels import choose_voters, foreground_of, points_of
from pipelines.export.forest.votes import cast_votes

N_PROPOSALS = 3
"""Given per joint, as by `Predictor.predict`."""


def to_onnx(model: OARFModel) -> bytes:
    """The bytes of an .onnx file that finds joints as the forest does; the same model gives the same bytes.

    The inputs are "depth", (height, width) uint16 [mm], 0 = nothing; "intrinsics", (4,) float32, fx, fy, cx, cy [px];
    and "box", (4,) float32, left, top, right, bottom [px], where pixels may vote. The outputs are "proposals",
    (n_joints, 3, 3) float32 [m], the densest first, NaN where missing; "confidence", (n_joints, 3) float32 [m^2];
    "pixels", (n, 2) int64, row and column of the voting pixels, and "leaves", (n_trees, n) int32, which they reach.
    Joints are found one by one; a skeleton that the forest has learned is left out.

    Args:
        model: A trained forest.

    Raises:
        UnexportableError: Trees that ask for more than depth.
        MissingLibraryError: onnx is not installed.
    """
    trees, leaves = model.trees, [tree.leaves for tree in model.trees]
    if model.context is not None or any(tree.hints is not None for tree in trees):
        raise UnexportableError("its trees ask for hints beside depth, which a graph of depth alone does not tell")
    flat = flatten([tree.nodes for tree in trees], [table.n_leaves for table in leaves])
    table = vote_table(leaves, model.tuning.max_offset_m)
    bandwidth, n_joints = model.tuning.bandwidth_m, model.labels.n_joints

    graph = Graph()
    depth = Value(graph, graph.input("depth", "height", "width", dtype=np.uint16), np.uint16).cast(np.int32)
    intrinsics, box = (Value(graph, graph.input(name, 4), np.float32) for name in ("intrinsics", "box"))
    foreground = foreground_of(depth)
    voters = choose_voters(depth, foreground, box, model.config.n_voting_pixels)
    reached = leaves_of(flat, foreground, voters, intrinsics.at(np.array([0, 1])))
    votes = cast_votes(table, reached, points_of(voters, intrinsics))
    modes = modes_of_cells(bin_votes(votes, bandwidth), bandwidth, N_PROPOSALS)
    modes = settle(modes, votes, bandwidth)
    focal = intrinsics.cast(np.float64)
    area = voters.stands_for / (focal.pick(0) * focal.pick(1) * float(len(trees)))

    voters.pixels.called("pixels")
    reached.called("leaves")
    modes.place.called("proposals")
    (modes.density * area.cast(np.float32)).called("confidence")
    graph.output("proposals", n_joints, N_PROPOSALS, 3)
    graph.output("confidence", n_joints, N_PROPOSALS)
    graph.output("pixels", "n", 2, dtype=np.int64)
    graph.output("leaves", len(trees), "n", dtype=np.int32)
    return graph.finish(
        {"config": json.dumps(to_json(model.config), sort_keys=True), "joints": json.dumps(model.labels.joints)}
    )
