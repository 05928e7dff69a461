"""What a trained random walk forest holds, and its trees as the walk reads them."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.frames import LabelTable
from forests.rwf.config import RWFConfig
from forests.rwf.walk import WalkPlan, WalkTables
from forests.skeleton.model import SkeletonModel
from forests.tree import tree_depth

NARROW_M, NARROW_POWER = 0.1, 3
"""A cluster of spread s votes with weight share * (c / (c + s)) ** power: the denser, the more [m]."""


class ExpertTree(NamedTuple):
    """One tree of one joint's expert.

    Attributes:
        nodes: (n_nodes,) of NODE_DTYPE.
        offset: (n_leaves, n_clusters, 3) float32, means of clusters of offsets to the joint [m]; 0 where missing.
        share: (n_leaves, n_clusters) float32, falling, sums to 1; 0 where missing.
        spread: (n_leaves, n_clusters) float32, standard deviations of the clusters [m]; 0 where missing.
    """

    nodes: NDArray
    offset: NDArray[np.float32]
    share: NDArray[np.float32]
    spread: NDArray[np.float32]


class Limbs(NamedTuple):
    """How long limbs are.

    Attributes:
        parent: (n_joints,) int32, -1 = none.
        length_m: (n_joints, 2) float32, shortest and longest distance to the parent [m].
    """

    parent: NDArray[np.int32]
    length_m: NDArray[np.float32]


@dataclass(frozen=True)
class RWFModel:
    """A trained forest.

    Attributes:
        config: How it was trained; its `joints` name those that were learned, if not all that were wanted.
        labels: The training frames' labels and joints.
        joints: Names of the experts' joints, in the order of every joint array of its answers.
        experts: The trees of each joint.
        plan: How the experts walk.
        limbs: Ranges of the limbs' lengths in the training frames.
        within_weights: (n_joints, n_terms) float32, logistic regression of "within 10 cm" on `evidence.TERMS`; NaN =
            not calibrated.
        hidden_weights: (n_joints, n_terms) float32, of "occluded by an object", likewise.
        skeleton: What makes one skeleton out of the walks' ends; None = joints are answered as walked to.
    """

    config: RWFConfig
    labels: LabelTable
    joints: tuple[str, ...]
    experts: tuple[tuple[ExpertTree, ...], ...]
    plan: WalkPlan
    limbs: Limbs
    within_weights: NDArray[np.float32]
    hidden_weights: NDArray[np.float32]
    skeleton: SkeletonModel | None = None


def walk_tables(experts: tuple[tuple[ExpertTree, ...], ...]) -> WalkTables:
    """Puts all trees behind one another, and weighs their clusters.

    Args:
        experts: The trees of each joint.
    """
    shape = len(experts), len(experts[0])
    root, levels = np.empty(shape, np.int32), np.empty(shape, np.int32)
    nodes, n_nodes, n_leaves = [], 0, 0
    for joint, trees in enumerate(experts):
        for number, tree in enumerate(trees):
            moved = tree.nodes.copy()
            moved["left"] += n_nodes
            moved["leaf"] += np.where(moved["leaf"] >= 0, n_leaves, 0).astype(np.int32)
            root[joint, number] = n_nodes
            levels[joint, number] = tree_depth(tree.nodes)
            nodes.append(moved)
            n_nodes += len(moved)
            n_leaves += len(tree.offset)
    flat = [tree for trees in experts for tree in trees]
    weight = [tree.share * (NARROW_M / (NARROW_M + tree.spread)) ** NARROW_POWER for tree in flat]
    vote = [np.concatenate([tree.offset, w[:, :, None]], axis=2) for tree, w in zip(flat, weight, strict=True)]
    return WalkTables(np.concatenate(nodes), root, levels, np.concatenate(vote).astype(np.float32))
