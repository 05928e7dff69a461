"""The skeleton that labels pixels: bones between joints, and which parts lie along each."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synth.vocabulary import JOINT_NAMES, N_JOINTS, PART

_HIPS = N_JOINTS
"""Place of the middle of the hips after the 15 joints."""


class Bones(NamedTuple):
    """Bones of one person, for the kernel.

    Attributes:
        start: (n, 3) float64, camera frame [m].
        end: (n, 3) float64 [m].
        reach: (n,) float64, a surface this near to a bone may be its own [m].
        cuts: (n, 3) float64, rising shares of the bone's length where the next part begins; 2 = none does.
        parts: (n, 2, 4) uint8, part labels by side of the bone (right, left) and stretch.
        left: (3,) float64, to the person's left [m]; 0 if unknown.
    """

    start: NDArray[np.float64]
    end: NDArray[np.float64]
    reach: NDArray[np.float64]
    cuts: NDArray[np.float64]
    parts: NDArray[np.uint8]
    left: NDArray[np.float64]


class _Bone(NamedTuple):
    """A bone by names; {s} stands for the side: of the limb, or of a pixel on trunk or head."""

    start: str
    end: str
    stretched: float
    reach: float
    parts: tuple[str, ...]
    cuts: tuple[float, ...] = ()


_MIDDLE = (
    _Bone("neck", "head", 1.6, 0.20, ("neck", "{s}w_head", "{s}u_head"), (0.25, 0.62)),
    _Bone("neck", "torso", 1.0, 0.25, ("{s}u_torso",)),
    _Bone("torso", "hips", 1.0, 0.25, ("{s}w_torso",)),
)
_LIMBS = (
    _Bone("neck", "{s}_shoulder", 1.0, 0.20, ("{s}u_torso", "{s}_shoulder"), (0.65,)),
    _Bone("{s}_shoulder", "{s}_hip", 1.0, 0.22, ("{s}_shoulder", "{s}u_torso", "{s}w_torso"), (0.1, 0.5)),
    _Bone("hips", "{s}_hip", 1.0, 0.22, ("{s}w_torso",)),
    _Bone("{s}_shoulder", "{s}_elbow", 1.0, 0.15, ("{s}_shoulder", "{s}u_arm", "{s}_elbow"), (0.25, 0.85)),
    _Bone(
        "{s}_elbow", "{s}_hand", 1.3, 0.14, ("{s}_elbow", "{s}w_arm", "{s}_wrist", "{s}_hand"), (0.12, 0.6, 0.7)
    ),
    _Bone("{s}_hip", "{s}_knee", 1.0, 0.20, ("{s}u_leg", "{s}_knee"), (0.87,)),
    _Bone(
        "{s}_knee", "{s}_foot", 1.1, 0.17, ("{s}_knee", "{s}w_leg", "{s}_ankle", "{s}_foot"), (0.13, 0.73, 0.84)
    ),
)
_TABLE = tuple((bone, None) for bone in _MIDDLE) + tuple((bone, side) for bone in _LIMBS for side in "rl")


def _place(name: str, side: str | None) -> int:
    joint = name.format(s=side)
    return _HIPS if joint == "hips" else JOINT_NAMES.index(joint)


def _labels(bone: _Bone, side: str | None) -> NDArray[np.uint8]:
    """(2, 4) labels; the last stretch's repeated."""
    rows = [[PART[part.format(s=side or own)] for part in bone.parts] for own in "rl"]
    return np.array([row + [row[-1]] * (4 - len(row)) for row in rows], np.uint8)


_STARTS = np.array([_place(bone.start, side) for bone, side in _TABLE])
_ENDS = np.array([_place(bone.end, side) for bone, side in _TABLE])
_STRETCHED = np.array([bone.stretched for bone, _ in _TABLE])
_REACH = np.array([bone.reach for bone, _ in _TABLE])
_CUTS = np.array([[*bone.cuts, 2.0, 2.0, 2.0][:3] for bone, _ in _TABLE])
_PARTS = np.stack([_labels(bone, side) for bone, side in _TABLE])


def bones_of(places: NDArray[np.float64]) -> Bones:
    """The bones both of whose ends are known.

    Args:
        places: (15, 3) float64, camera frame [m]; NaN where unknown.
    """
    hips = (places[JOINT_NAMES.index("r_hip")] + places[JOINT_NAMES.index("l_hip")]) / 2.0
    points = np.vstack([places, hips])
    start, end = points[_STARTS], points[_ENDS]
    end = start + _STRETCHED[:, None] * (end - start)
    is_there = np.isfinite(start).all(axis=1) & np.isfinite(end).all(axis=1)
    across = places[JOINT_NAMES.index("l_shoulder")] - places[JOINT_NAMES.index("r_shoulder")]
    left = np.where(np.isfinite(across).all(), across, 0.0)
    return Bones(start[is_there], end[is_there], _REACH[is_there], _CUTS[is_there], _PARTS[is_there], left)
