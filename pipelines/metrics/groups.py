"""The groups of joints that measures are split by."""

import itertools
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pipelines.metrics.results import Truths
from synth.vocabulary import SINGLE_STATES, JointState

Groups = Mapping[str, NDArray[np.bool_]]
"""(n, n_joints) bool by name: whether a joint of a frame belongs to the group."""

VISIBLE_FRACTION_EDGES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Bins of the person's visible fraction; the lower edge belongs to a bin, 1 to a bin of its own."""


def by_state(truths: Truths) -> Groups:
    """By why a joint can or cannot be seen; `non_occluded` holds all that no object hides."""
    told = [state for state in SINGLE_STATES if state is not JointState.UNKNOWN]
    groups = {state.name.lower(): truths.state == state for state in told}
    return groups | {"non_occluded": truths.state != JointState.OCCLUDED}


def by_joint(truths: Truths) -> Groups:
    """By joint."""
    names = np.arange(len(truths.joints))
    return {name: np.broadcast_to(names == i, truths.state.shape) for i, name in enumerate(truths.joints)}


def by_hiding_class(truths: Truths) -> Groups:
    """Joints that an object hides, by its class."""
    groups = {name: truths.hiding_class == code for code, name in enumerate(truths.occluders) if code}
    return {name: is_in for name, is_in in groups.items() if is_in.any()}


def by_object_in_frame(truths: Truths) -> Groups:
    """All joints, by the classes that the frame shows; a frame with several classes is in several groups."""
    groups = {"none": truths.object_classes == 0}
    groups |= {
        name: (truths.object_classes >> code & 1) == 1 for code, name in enumerate(truths.occluders) if code
    }
    return {name: _all_joints(truths, is_in) for name, is_in in groups.items() if is_in.any()}


def by_visible_fraction(truths: Truths) -> Groups:
    """All joints, by how much of the person the frame shows."""
    share = truths.visible_fraction
    edges = VISIBLE_FRACTION_EDGES
    groups = {f"{a:g}-{b:g}": (share >= a) & (share < b) for a, b in itertools.pairwise(edges)}
    groups["1"] = share >= 1.0
    return {name: _all_joints(truths, is_in) for name, is_in in groups.items()}


def by_family(truths: Truths) -> Groups:
    """All joints, by the kind of scene."""
    return {name: _all_joints(truths, truths.family == code) for code, name in enumerate(truths.families)}


def _all_joints(truths: Truths, is_in: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return np.broadcast_to(is_in[:, None], truths.state.shape)
