"""Which joint of a file plays which part of the body: two naming conventions, and any other by a table."""

from collections.abc import Mapping
from dataclasses import dataclass

from synth.bodies.mocap.bvh import END, Bvh, MocapError

_MIDLINE = ("hips", "thorax", "neck", "head")
_SIDED = ("clavicle", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "toe")
REQUIRED: tuple[str, ...] = _MIDLINE + tuple(f"{side}_{name}" for name in _SIDED for side in "lr")
"""Roles that every file must fill; a joint stands for the place where it turns."""
OPTIONAL: tuple[str, ...] = ("l_fingers", "r_fingers")
"""Roles that make hands better: where the fingers begin."""


@dataclass(frozen=True)
class Convention:
    """A way of naming joints.

    Attributes:
        name: How it is called in reports.
        joints: Joint name by role.
    """

    name: str
    joints: Mapping[str, str]

    def __post_init__(self) -> None:
        known = REQUIRED + OPTIONAL
        unknown = [role for role in self.joints if role not in known]
        if unknown:
            raise MocapError(f"joint mapping has unknown roles {', '.join(unknown)}; known are {', '.join(known)}")
        missing = [role for role in REQUIRED if role not in self.joints]
        if missing:
            raise MocapError(f"joint mapping lacks the roles {', '.join(missing)}")


def _daz() -> Convention:
    joints = {"hips": "hip", "thorax": "chest", "neck": "neck", "head": "head"}
    names = {
        "clavicle": "Collar", "shoulder": "Shldr", "elbow": "ForeArm", "wrist": "Hand", "fingers": "Mid1",
        "hip": "Thigh", "knee": "Shin", "ankle": "Foot", "toe": f"Foot{END}",
    }  # fmt: skip
    return Convention("daz", joints | {f"{s}_{role}": s + name for role, name in names.items() for s in "lr"})


def _motion_builder() -> Convention:
    joints = {"hips": "Hips", "thorax": "Spine1", "neck": "Neck1", "head": "Head"}
    names = {
        "clavicle": "Shoulder", "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand", "fingers": "HandIndex1",
        "hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "toe": "ToeBase",
    }  # fmt: skip
    for side, word in (("l", "Left"), ("r", "Right")):
        joints |= {f"{side}_{role}": word + name for role, name in names.items()}
    return Convention("motion_builder", joints)


CONVENTIONS: tuple[Convention, ...] = (_daz(), _motion_builder())
"""Conventions that are found out without being told."""


def joints_of(bvh: Bvh, custom: Convention | None = None) -> dict[str, int]:
    """Index of the joint of each role.

    Args:
        bvh: The file.
        custom: Naming to use; by default the known convention that fits.

    Raises:
        MocapError: A required joint is missing.
    """
    names = {joint.name: i for i, joint in enumerate(bvh.joints)}
    candidates = CONVENTIONS if custom is None else (custom,)
    best = min(candidates, key=lambda convention: len(_missing(convention, names)))
    missing = _missing(best, names)
    if missing:
        wanted = ", ".join(f"{best.joints[role]} ({role})" for role in missing)
        raise MocapError(f"lacks joints of the {best.name!r} naming: {wanted}; it has {', '.join(names)}")
    return {role: names[name] for role, name in best.joints.items() if name in names}


def _missing(convention: Convention, names: Mapping[str, int]) -> list[str]:
    return [role for role in REQUIRED if convention.joints[role] not in names]
