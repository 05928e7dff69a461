"""What a trained regression forest holds: trees and their leaf tables, as arrays."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.frames import LabelTable
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig


class LeafTable(NamedTuple):
    """What a tree's leaves know. Layer 0: votes learned from body samples; layer 1: from occluder samples.

    Attributes:
        probability: (n_leaves, n_classes) float32, p(c | leaf), sums to 1.
        mode: (n_leaves, n_layers, n_joints, n_modes, 3) float32, offsets from the pixel's point to the joint [m],
            the heaviest mode first; 0 where missing. n_layers is 1 for the baseline, else 2.
        weight: (n_leaves, n_layers, n_joints, n_modes) float32, of the leaf's samples that know the joint, in
            both layers, the share that ended in the mode; 0 where missing.
    """

    probability: NDArray[np.float32]
    mode: NDArray[np.float32]
    weight: NDArray[np.float32]


class ForestTree(NamedTuple):
    """One tree.

    Attributes:
        nodes: (n_nodes,) of NODE_DTYPE.
        leaves: By the nodes' leaf numbers.
    """

    nodes: NDArray
    leaves: LeafTable


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
    """

    config: OARFConfig
    labels: LabelTable
    classes: ClassTable
    trees: tuple[ForestTree, ...]
    tuning: Tuning
