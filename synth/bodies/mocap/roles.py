"""Which joint of a file plays which part of the body: two naming conventions, and any other by a table."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from synth.bodies.mocap.bvh import END, Bvh, MocapError

_MIDLINE = ("hips", "thorax", "neck", "head")
_SIDED = ("clavicle", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "toe")
ROLES: tuple[str, ...] = _MIDLINE + tuple(f"{side}_{name}" for name in _SIDED for side in "lr")
"""Roles that a file must fill; a joint stands for the place where it turns."""


@dataclass(frozen=True)
class Convention:
    """A way of naming joints.

    Attributes:
        name: How it is called in reports.
        joints: Joint name by role.
        arms_at_rest: Elevation of the arms in the T-pose that turns are counted from [rad]; None if the rest
            pose shows it.
    """

    name: str
    joints: Mapping[str, str]
    arms_at_rest: float | None = None

    def __post_init__(self) -> None:
        unknown = [role for role in self.joints if role not in ROLES]
        if unknown:
            raise MocapError(f"joint mapping has unknown roles {', '.join(unknown)}; known are {', '.join(ROLES)}")
        missing = [role for role in ROLES if role not in self.joints]
        if missing:
            raise MocapError(f"joint mapping lacks the roles {', '.join(missing)}")


def _daz() -> Convention:
    joints = {"hips": "hip", "thorax": "chest", "neck": "neck", "head": "head"}
    names = {
        "clavicle": "Collar", "shoulder": "Shldr", "elbow": "ForeArm", "wrist": "Hand",
        "hip": "Thigh", "knee": "Shin", "ankle": "Foot", "toe": f"Foot{END}",
    }  # fmt: skip
    joints |= {f"{s}_{role}": s + name for role, name in names.items() for s in "lr"}
    # The CMU trials in this naming turn as those in the other one do from arms 8 degrees down, though drawn level.
    return Convention("daz", joints, arms_at_rest=-np.radians(8.0))


def _motion_builder() -> Convention:
    joints = {"hips": "Hips", "thorax": "Spine1", "neck": "Neck1", "head": "Head"}
    names = {
        "clavicle": "Shoulder", "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand",
        "hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "toe": "ToeBase",
    }  # fmt: skip
    for side, word in (("l", "Left"), ("r", "Right")):
        joints |= {f"{side}_{role}": word + name for role, name in names.items()}
    return Convention("motion_builder", joints)


CONVENTIONS: tuple[Convention, ...] = (_daz(), _motion_builder())
"""Conventions that are found out without being told."""


def joints_of(bvh: Bvh, custom: Convention | None = None) -> tuple[Convention, dict[str, int]]:
    """The naming that a file follows, and the index of the joint of each role.

    Args:
        bvh: The file.
        custom: Naming to use; by default the known convention that fits.

    Raises:
        MocapError: A joint is missing.
    """
    names = {joint.name: i for i, joint in enumerate(bvh.joints)}
    candidates = CONVENTIONS if custom is None else (custom,)
    best = min(candidates, key=lambda convention: len(_missing(convention, names)))
    missing = _missing(best, names)
    if missing:
        wanted = ", ".join(f"{best.joints[role]} ({role})" for role in missing)
        raise MocapError(f"lacks joints of the {best.name!r} naming: {wanted}; it has {', '.join(names)}")
    return best, {role: names[best.joints[role]] for role in ROLES}


def _missing(convention: Convention, names: Mapping[str, int]) -> list[str]:
    return [role for role in ROLES if convention.joints[role] not in names]
