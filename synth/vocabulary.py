"""The names and codes that every frame, corpus and table uses: joints, body parts, occluder classes, states."""

from enum import IntEnum

JOINT_NAMES: tuple[str, ...] = (
    "head",
    "neck",
    "torso",
    "r_shoulder",
    "l_shoulder",
    "r_elbow",
    "l_elbow",
    "r_hand",
    "l_hand",
    "r_hip",
    "l_hip",
    "r_knee",
    "l_knee",
    "r_foot",
    "l_foot",
)
"""The 15 joints in their one order; left and right are the person's own."""

N_JOINTS = len(JOINT_NAMES)
BONES: tuple[tuple[int, int], ...] = (
    (0, 1), (1, 3), (1, 4), (3, 5), (4, 6), (5, 7), (6, 8), (1, 2),
    (2, 9), (2, 10), (9, 11), (10, 12), (11, 13), (12, 14),
)  # fmt: skip
"""Pairs of joint indices that a skeleton picture draws a line between."""

PART_NAMES: tuple[str, ...] = (
    "background",
    "lu_head", "ru_head", "lw_head", "rw_head",
    "neck",
    "l_shoulder", "r_shoulder",
    "lu_arm", "ru_arm", "lw_arm", "rw_arm",
    "l_elbow", "r_elbow",
    "l_wrist", "r_wrist",
    "l_hand", "r_hand",
    "lu_torso", "ru_torso", "lw_torso", "rw_torso",
    "lu_leg", "ru_leg", "lw_leg", "rw_leg",
    "l_knee", "r_knee",
    "l_ankle", "r_ankle",
    "l_foot", "r_foot",
)  # fmt: skip
"""Body part names by label: 0 is background, 1..31 the parts of Shotton et al. 2011 (section 3.1).

The first letter is the person's left or right; in "lu"/"rw" the second is upper or lower.
"lu_head" is the left upper head, "lw_head" the left lower head.
"""

N_PARTS = len(PART_NAMES) - 1
PART: dict[str, int] = {name: label for label, name in enumerate(PART_NAMES)}


def _mirrored(name: str) -> str:
    if name[0] in "lr" and (name[1] == "_" or name[2] == "_"):
        return ("r" if name[0] == "l" else "l") + name[1:]
    return name


MIRRORED_PART: tuple[int, ...] = tuple(PART[_mirrored(name)] for name in PART_NAMES)
"""Label of the part on the other side; index with a label image to mirror it."""
MIRRORED_JOINT: tuple[int, ...] = tuple(JOINT_NAMES.index(_mirrored(name)) for name in JOINT_NAMES)
"""Index of the joint on the other side."""

OCCLUDER_CLASSES: tuple[str, ...] = (
    "none",
    "table",
    "laptop",
    "stroller",
    "chair",
    "monitor",
    "suitcase",
    "other",
)
"""Occluder class names by code: 0 is none."""
OCCLUDER_CODE: dict[str, int] = {name: code for code, name in enumerate(OCCLUDER_CLASSES)}

SURFACE_CLASSES: tuple[str, ...] = ("floor", "wall", "ceiling", "background")
"""What a room is made of; "background" is what belongs to it and has no occluder class: shelves, curtains, pillars."""
SCENE_CLASSES: tuple[str, ...] = OCCLUDER_CLASSES + SURFACE_CLASSES
"""Names by code in whole scenes: the occluder classes keep their codes, the surfaces follow them."""
SCENE_CODE: dict[str, int] = {name: code for code, name in enumerate(SCENE_CLASSES)}
MAX_PEOPLE = 8
"""Of one whole scene."""

CONTACT_NAMES: tuple[str, ...] = ("l_heel", "l_toes", "r_heel", "r_toes", "seat", "l_hand", "r_hand")
"""What of a person of a clip can touch floor, seat or things, by column of the contact labels."""

SPLITS: tuple[str, ...] = ("train", "val", "test")
"""Names of the splits by code; who and what stands in one stands in no other."""


class JointState(IntEnum):
    """Why a joint can or cannot be seen."""

    VISIBLE = 0
    OCCLUDED = 1
    """An object stands between the camera and the surface over the joint."""
    SELF_OCCLUDED = 2
    """Another part of the person does."""
    OUTSIDE = 3
    """The joint projects outside the image, or lies behind the camera."""
    UNKNOWN = 4
    """Not annotated, in recorded frames; its coordinates are NaN, and those of no other joint are."""
    OCCLUDED_BY_PERSON = 5
    """Another person stands between the camera and the surface over the joint; in whole scenes only."""


SINGLE_STATES: tuple[JointState, ...] = tuple(
    state for state in JointState if state is not JointState.OCCLUDED_BY_PERSON
)
"""States of joints in frames that show one person."""
