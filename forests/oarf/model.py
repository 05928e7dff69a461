"""What a trained regression forest holds: trees and their leaf tables."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.frames import LabelTable
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.packed import PackedLeaves
from forests.skeleton.model import SkeletonModel


class ForestTree(NamedTuple):
    """One tree.

    Attributes:
        nodes: (n_nodes,) of NODE_DTYPE.
        leaves: By the nodes' leaf numbers.
        hints: (n_nodes,) int16, what each node asks (`forests.features`); None = all ask for depth.
    """

    nodes: NDArray
    leaves: PackedLeaves
    hints: NDArray[np.int16] | None = None


@dataclass(frozen=True)
class Tuning:
    """What is learned on validation frames.

    Attributes:
        max_offset_m: (n_joints,) float32, lambda_j: leaf modes longer than this do not vote [m].
        bandwidth_m: (n_joints,) float32, b_j of the votes' mean shift [m].
        within_weights: (n_joints, n_terms) float32, logistic regression of "within 10 cm"; NaN = not calibrated.
        hidden_weights: (n_joints, n_terms) float32, logistic regression of "hidden by an object"; NaN likewise.
    """

    max_offset_m: NDArray[np.float32]
    bandwidth_m: NDArray[np.float32]
    within_weights: NDArray[np.float32]
    hidden_weights: NDArray[np.float32]


@dataclass(frozen=True)
class OARFModel:
    """A trained forest.

    Attributes:
        config: How it was trained.
        labels: The training frames' labels and joints.
        classes: What it tells apart.
        trees: The trees.
        tuning: What was learned on validation frames.
        skeleton: What makes one skeleton out of the joints' proposals; None = joints are answered one by one.
        context: The forest whose predictions of pixels are the trees' hints; None = hints are told, or not asked for.
    """

    config: OARFConfig
    labels: LabelTable
    classes: ClassTable
    trees: tuple[ForestTree, ...]
    tuning: Tuning
    skeleton: SkeletonModel | None = None
    context: "OARFModel | None" = None
