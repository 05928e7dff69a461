"""The kinematic tree: which joint a limb hangs on, the order of the joints, and left for right."""

import numpy as np
from numpy.typing import NDArray

SKELETON: tuple[tuple[str, str], ...] = (
    ("neck", ""),
    ("torso", "neck"),
    ("head", "neck"),
    ("r_shoulder", "neck"),
    ("l_shoulder", "neck"),
    ("r_elbow", "r_shoulder"),
    ("l_elbow", "l_shoulder"),
    ("r_hand", "r_elbow"),
    ("l_hand", "l_elbow"),
    ("r_hip", "torso"),
    ("l_hip", "torso"),
    ("r_knee", "r_hip"),
    ("l_knee", "l_hip"),
    ("r_foot", "r_knee"),
    ("l_foot", "l_knee"),
)
"""(joint, parent), parents first; "" is no joint, but the place where the person was found."""


def parents_of(joints: tuple[str, ...], skeleton: tuple[tuple[str, str], ...] = SKELETON) -> NDArray[np.int32]:
    """(n_joints,) place of each joint's nearest ancestor among `joints`; -1 = none.

    A joint that the skeleton does not name has no parent.
    """
    above = dict(skeleton)
    parents = np.full(len(joints), -1, np.int32)
    for place, name in enumerate(joints):
        ancestor = above.get(name, "")
        while ancestor and ancestor not in joints:
            ancestor = above.get(ancestor, "")
        if ancestor:
            parents[place] = joints.index(ancestor)
    return parents


def parents_first(parents: NDArray[np.int32]) -> NDArray[np.int32]:
    """(n_joints,) places, every parent before its children.

    Raises:
        ValueError: A joint is its own ancestor.
    """
    order: list[int] = []
    while len(order) < len(parents):
        ready = [j for j in range(len(parents)) if j not in order and (parents[j] < 0 or parents[j] in order)]
        if not ready:
            raise ValueError("the skeleton has a joint that is its own ancestor")
        order += ready
    return np.array(order, np.int32)


def mirrored_joints(joints: tuple[str, ...]) -> NDArray[np.int32]:
    """(n_joints,) place of the joint on the other side, "l_" for "r_"; a joint without one is its own."""
    other = {"l_": "r_", "r_": "l_"}
    names = [other.get(name[:2], name[:2]) + name[2:] for name in joints]
    return np.array([joints.index(o) if o in joints else k for k, o in enumerate(names)], np.int32)
