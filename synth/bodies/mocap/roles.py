"""Which joint of a file plays which part of the body: two naming conventions, and any other by a table."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.bvh import END, Bvh
from synth.bodies.mocap.text import MocapError

STRAIGHT_BELOW = np.radians(30.0)
"""Toes on average nearer than this to the line of the shank do not tell where a foot points."""
_MIDLINE = ("hips", "thorax", "neck", "head")
_SIDED = ("clavicle", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "toe")
_HIPS = re.compile(r"(.*[^a-z])?hips?", re.IGNORECASE)
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
        drawn_elbows: Bend of the elbows in the pose without turns, of files whose turns mean straight limbs by it
            [rad]; None if there are no such files.
    """

    name: str
    joints: Mapping[str, str]
    arms_at_rest: float | None = None
    drawn_elbows: float | None = None

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
    return Convention("daz", joints, arms_at_rest=-np.radians(8.0), drawn_elbows=np.radians(17.2))


def _named(name: str, thorax: str, neck: str, limbs: Mapping[str, str], toe: str) -> Convention:
    joints = {"hips": "Hips", "thorax": thorax, "neck": neck, "head": "Head"}
    for side, word in (("l", "Left"), ("r", "Right")):
        joints |= {f"{side}_{role}": word + limb for role, limb in limbs.items()}
        joints[f"{side}_toe"] = word + toe
    return Convention(name, joints)


_ARM_LIMBS = {
    "clavicle": "Shoulder", "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand",
    "hip": "UpLeg", "knee": "Leg", "ankle": "Foot",
}  # fmt: skip
_JOINT_LIMBS = {
    "clavicle": "Collar", "shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist",
    "hip": "Hip", "knee": "Knee", "ankle": "Ankle",
}  # fmt: skip


def _conventions() -> Iterator[Convention]:
    """Known namings; of those that fit a file equally well, the first is taken, so the highest spine joint."""
    yield _daz()
    for toe in ("ToeBase", "Toe", f"Foot{END}"):
        for number in (4, 3, 2):
            yield _named("mixamo", f"Spine{number}", "Neck", _ARM_LIMBS, toe)
        yield _named("motion_builder", "Spine1", "Neck1", _ARM_LIMBS, toe)
        for spine in ("Spine1", "Spine"):
            yield _named("mixamo", spine, "Neck", _ARM_LIMBS, toe)
    for toe in ("Toe", f"Ankle{END}"):
        for chest in ("Chest4", "Chest3", "Chest2", "Chest"):
            yield _named("xsens", chest, "Neck", _JOINT_LIMBS, toe)


def joints_in_front(bvh: Bvh, joints: Mapping[str, int], position: NDArray[np.float64]) -> dict[str, int]:
    """The joints by role, but for toes that are straight below their ankles the first joint beyond that is not.

    Args:
        bvh: The file.
        joints: Index of the joint of each role.
        position: (n, n_joints, 3) joints in any frames, in the file's axes.
    """
    out = dict(joints)
    for side in "lr":
        knee, ankle = (position[:, joints[f"{side}_{role}"]] for role in ("knee", "ankle"))
        shank = ankle - knee
        for candidate in _below(bvh, joints[f"{side}_toe"]):
            way = position[:, candidate] - ankle
            length = np.linalg.norm(way, axis=1), np.linalg.norm(shank, axis=1)
            along = (way * shank).sum(axis=1) / np.maximum(length[0] * length[1], 1e-12)
            if np.median(along) < np.cos(STRAIGHT_BELOW) and np.median(length[0]) > 1e-3 * np.median(length[1]):
                out[f"{side}_toe"] = candidate
                break
    return out


def _below(bvh: Bvh, joint: int) -> list[int]:
    """A joint and those below it, nearest first."""
    found = [joint]
    for above in found:
        found += [k for k, other in enumerate(bvh.joints) if other.parent == above]
    return found


CONVENTIONS: tuple[Convention, ...] = tuple(_conventions())
"""Conventions that are found out without being told."""


def plain_names(names: Sequence[str]) -> list[str]:
    """Joint names without what programs add to them: "mixamorig:", "Character1_", spaces, capitals.

    Args:
        names: Of all joints of a file.
    """
    short = [name.rpartition(":")[2] for name in names]
    hips = [found[1] for found in (_HIPS.fullmatch(name) for name in short) if found]
    prefix = (hips[0] or "") if hips else ""
    if 2 * sum(name.startswith(prefix) for name in short) <= len(short):
        prefix = ""  # of a side, not of the file
    return [_plain(name.removeprefix(prefix)) for name in short]


def _plain(name: str) -> str:
    return re.sub(r"[ _.-]", "", name.rpartition(":")[2]).lower()


def joints_of(bvh: Bvh, custom: Convention | None = None) -> tuple[Convention, dict[str, int]]:
    """The naming that a file follows, and the index of the joint of each role.

    Args:
        bvh: The file.
        custom: Naming to use; by default the known convention that fits.

    Raises:
        MocapError: A joint is missing.
    """
    names = [joint.name for joint in bvh.joints]
    exact = {name: i for i, name in enumerate(names)}
    if custom is not None and all(name in exact for name in custom.joints.values()):
        return custom, {role: exact[custom.joints[role]] for role in ROLES}
    places: dict[str, int] = {}
    for i, name in enumerate(plain_names(names)):
        places.setdefault(name, i)
    candidates = CONVENTIONS if custom is None else (custom,)
    best = min(candidates, key=lambda convention: len(_missing(convention, places)))
    missing = _missing(best, places)
    if missing:
        wanted = ", ".join(f"{best.joints[role]} ({role})" for role in missing)
        raise MocapError(f"lacks joints of the {best.name!r} naming: {wanted}; it has {', '.join(names)}")
    return best, {role: places[_plain(best.joints[role])] for role in ROLES}


def _missing(convention: Convention, names: Mapping[str, int]) -> list[str]:
    """Roles that a file's plain names do not fill."""
    return [role for role in ROLES if _plain(convention.joints[role]) not in names]
