"""What a trained random walk forest holds."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.frames import LabelTable
from forests.rwf.config import RWFConfig
from forests.skeleton.model import SkeletonModel


class ExpertTree(NamedTuple):
    """One tree of one joint's expert, as it was grown.

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


class PackedTree(NamedTuple):
    """One tree in 16-bit numbers, as it is kept.

    Attributes:
        is_leaf: (ceil(n_nodes / 8),) uint8, a bit a node, breadth first (`forests.tree.shape_of`).
        probe: (n_inner, 4) int16, offsets ux, uy, vx, vy of the nodes that are no leaves, in units.
        threshold: (n_inner,) int16, theirs [mm].
        vote: (n_votes, 4) int16, offsets x, y, z to the joint in units and weight, leaf after leaf: one vote a
            cluster.
        is_last: (ceil(n_votes / 8),) uint8, a bit a vote: the last of its leaf.
    """

    is_leaf: NDArray[np.uint8]
    probe: NDArray[np.int16]
    threshold: NDArray[np.int16]
    vote: NDArray[np.int16]
    is_last: NDArray[np.uint8]


class Experts(NamedTuple):
    """All experts' trees.

    Attributes:
        trees: Of each joint.
        probe_m: Unit of the probes' offsets [m].
        offset_m: Unit of the votes' offsets [m].
        n_clusters: Votes of a leaf, at most.
    """

    trees: tuple[tuple[PackedTree, ...], ...]
    probe_m: np.float32
    offset_m: np.float32
    n_clusters: int


class WalkPlan(NamedTuple):
    """How the experts walk.

    Attributes:
        order: (n_joints,) int32, joints in the order of their walks.
        start_from: (n_joints,) int32, the joint whose estimate a walk starts from, walked before; -1 = the start
            point.
        scatter_m: (n_joints,) float32, standard deviation of the walkers about the estimate, along each axis [m].
        bandwidth_m: (n_joints,) float32, b of the votes' kernel exp(-d^2 / b^2) [m].
        n_arriving: (n_joints,) int32, first steps whose votes do not count in the end.
        gate_m: (n_joints, n_trees, 2) float32: walkers less than the first behind the measured depth are put on it,
            and none is farther behind it than the second [m].
        n_walks: (n_joints,) int32, walkers of a joint, side by side.
        n_steps: Steps of a walk.
    """

    order: NDArray[np.int32]
    start_from: NDArray[np.int32]
    scatter_m: NDArray[np.float32]
    bandwidth_m: NDArray[np.float32]
    n_arriving: NDArray[np.int32]
    gate_m: NDArray[np.float32]
    n_walks: NDArray[np.int32]
    n_steps: int


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
        experts: The trees of all joints.
        plan: How the experts walk.
        limbs: Ranges of the limbs' lengths in the training frames.
        weights: (n_outcomes, n_joints, n_terms) float32, logistic regressions of what is in `evidence.OUTCOMES` on
            `evidence.TERMS`; NaN = not calibrated.
        skeleton: What makes one skeleton out of the walks' ends; None = joints are answered as walked to.
    """

    config: RWFConfig
    labels: LabelTable
    joints: tuple[str, ...]
    experts: Experts
    plan: WalkPlan
    limbs: Limbs
    weights: NDArray[np.float32]
    skeleton: SkeletonModel | None = None
