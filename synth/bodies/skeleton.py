"""The body's joint tree: degrees of freedom with axes and limits, and the 15 named joint centres.

The root link is the pelvis, its origin midway between the hip joint centres. Every link's frame is parallel to
the body's when all angles are zero: standing upright, arms hanging, palms facing the thighs; x forward, y to
the person's left, z up. A ball joint is a chain of hinges whose inner links have no skin.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.vocabulary import JOINT_NAMES, N_JOINTS


@dataclass(frozen=True)
class Dof:
    """One hinge and the link that it moves.

    Attributes:
        name: Hinge's name; the link it moves is "<name>_link".
        parent: Name of the hinge whose link carries this one, or "root".
        axis: Unit axis in the parent's frame.
        lower: Lower limit [rad].
        upper: Upper limit [rad].
    """

    name: str
    parent: str
    axis: tuple[float, float, float]
    lower: float
    upper: float


_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def _negated(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    return (-axis[0], -axis[1], -axis[2])


def _mirrored(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    """A rotation axis seen in the mirror that swaps left and right (a pseudovector)."""
    return (-axis[0], axis[1], -axis[2])


# name, parent, axis, lower and upper limit in degrees. Positive is what the name says: flexion bends forward,
# the spine's lateral leans to the right, its rotation turns to the left.
_TRUNK = (
    ("lumbar_flexion", "root", _Y, -20, 50),
    ("lumbar_lateral", "lumbar_flexion", _X, -20, 20),
    ("lumbar_rotation", "lumbar_lateral", _Z, -10, 10),
    ("thorax_flexion", "lumbar_rotation", _Y, -15, 35),
    ("thorax_lateral", "thorax_flexion", _X, -20, 20),
    ("thorax_rotation", "thorax_lateral", _Z, -35, 35),
    ("neck_flexion", "thorax_rotation", _Y, -35, 35),
    ("neck_lateral", "neck_flexion", _X, -35, 35),
    ("neck_rotation", "neck_lateral", _Z, -40, 40),
    ("head_flexion", "neck_rotation", _Y, -25, 25),
    ("head_rotation", "head_flexion", _Z, -40, 40),
)
# The left side; the right one is its mirror image. Ranges of motion after the American Academy of Orthopaedic
# Surgeons' averages (Greene & Heckman 1994), rounded.
_LEFT = (
    ("clavicle_elevation", "thorax_rotation", _X, -10, 35),
    ("clavicle_protraction", "clavicle_elevation", _negated(_Z), -15, 30),
    ("shoulder_flexion", "clavicle_protraction", _negated(_Y), -60, 180),
    ("shoulder_abduction", "shoulder_flexion", _X, -50, 95),
    ("shoulder_rotation", "shoulder_abduction", _negated(_Z), -90, 90),
    ("elbow_flexion", "shoulder_rotation", _negated(_Y), 0, 150),
    ("forearm_pronation", "elbow_flexion", _negated(_Z), -85, 85),
    ("wrist_flexion", "forearm_pronation", _negated(_X), -70, 80),
    ("wrist_deviation", "wrist_flexion", _negated(_Y), -35, 25),
    ("fingers_flexion", "wrist_deviation", _negated(_X), -10, 90),
    ("fingertips_flexion", "fingers_flexion", _negated(_X), 0, 100),
    ("thumb_flexion", "wrist_deviation", _negated(_Z), -20, 60),
    ("hip_flexion", "root", _negated(_Y), -25, 125),
    ("hip_abduction", "hip_flexion", _X, -30, 50),
    ("hip_rotation", "hip_abduction", _negated(_Z), -50, 45),
    ("knee_flexion", "hip_rotation", _Y, 0, 150),
    ("ankle_flexion", "knee_flexion", _negated(_Y), -50, 25),
    ("ankle_inversion", "ankle_flexion", _negated(_X), -20, 35),
    ("toes_extension", "ankle_inversion", _negated(_Y), -30, 60),
)
_MIDLINE = {"root"} | {row[0] for row in _TRUNK}


def _dofs() -> tuple[Dof, ...]:
    out = [Dof(name, parent, axis, np.radians(lo), np.radians(hi)) for name, parent, axis, lo, hi in _TRUNK]
    for side in "lr":
        for name, parent, axis, lo, hi in _LEFT:
            parent_name = parent if parent in _MIDLINE else f"{side}_{parent}"
            turned = axis if side == "l" else _mirrored(axis)
            out.append(Dof(f"{side}_{name}", parent_name, turned, np.radians(lo), np.radians(hi)))
    return tuple(out)


DOFS: tuple[Dof, ...] = _dofs()
"""The 49 hinges, parents before children."""
N_DOFS = len(DOFS)
DOF_IDX: dict[str, int] = {dof.name: i for i, dof in enumerate(DOFS)}
"""Index of a hinge by name."""
LINK_IDX: dict[str, int] = {"root": 0} | {dof.name: i + 1 for i, dof in enumerate(DOFS)}
"""Index of a link by the name of the hinge that moves it; link 0 is the root, link i + 1 hangs on hinge i."""
N_LINKS = N_DOFS + 1
JOINT_IDX: dict[str, int] = {name: i for i, name in enumerate(JOINT_NAMES)}
"""Index of a joint centre by name."""
PARENT_LINK: NDArray[np.int64] = np.array([LINK_IDX[dof.parent] for dof in DOFS], dtype=np.int64)
"""(n_dofs,) index of the link that carries hinge i."""
AXES: NDArray[np.float64] = np.array([dof.axis for dof in DOFS], dtype=np.float64)
"""(n_dofs, 3) unit axis of hinge i in its parent link's frame."""
LOWER: NDArray[np.float64] = np.array([dof.lower for dof in DOFS], dtype=np.float64)
"""(n_dofs,) lower limits [rad]."""
UPPER: NDArray[np.float64] = np.array([dof.upper for dof in DOFS], dtype=np.float64)
"""(n_dofs,) upper limits [rad]."""
MIRRORED_DOF: NDArray[np.int64] = np.array(
    [
        DOF_IDX[dof.name if dof.name in _MIDLINE else ("r" if dof.name[0] == "l" else "l") + dof.name[1:]]
        for dof in DOFS
    ],
    dtype=np.int64,
)
"""(n_dofs,) index of the hinge on the other side."""
MIRRORED_SIGN: NDArray[np.float64] = np.array(
    [-1.0 if dof.name.endswith(("_lateral", "_rotation")) and dof.name in _MIDLINE else 1.0 for dof in DOFS]
)
"""(n_dofs,) sign that a mirrored angle takes: a mirrored pose is `angles[MIRRORED_DOF] * MIRRORED_SIGN`."""

BONE_LINKS: tuple[str, ...] = (
    "root", "lumbar_rotation", "thorax_rotation", "neck_rotation", "head_rotation",
    "l_clavicle_protraction", "l_shoulder_abduction", "l_shoulder_rotation", "l_elbow_flexion",
    "l_forearm_pronation", "l_wrist_deviation", "l_fingers_flexion", "l_fingertips_flexion", "l_thumb_flexion",
    "l_hip_abduction", "l_hip_rotation", "l_knee_flexion", "l_ankle_inversion", "l_toes_extension",
    "r_clavicle_protraction", "r_shoulder_abduction", "r_shoulder_rotation", "r_elbow_flexion",
    "r_forearm_pronation", "r_wrist_deviation", "r_fingers_flexion", "r_fingertips_flexion", "r_thumb_flexion",
    "r_hip_abduction", "r_hip_rotation", "r_knee_flexion", "r_ankle_inversion", "r_toes_extension",
)  # fmt: skip
"""Links that skin hangs on. Along the upper arm, forearm and thigh the skin goes over from the untwisted link
(shoulder_abduction, elbow_flexion, hip_abduction) to the twisted one (shoulder_rotation, forearm_pronation,
hip_rotation), so that a twist spreads along the limb."""

JOINT_LINKS: tuple[str, ...] = (
    "head_rotation", "neck_rotation", "lumbar_rotation",
    "r_clavicle_protraction", "l_clavicle_protraction",
    "r_elbow_flexion", "l_elbow_flexion",
    "r_wrist_deviation", "l_wrist_deviation",
    "root", "root",
    "r_knee_flexion", "l_knee_flexion",
    "r_ankle_inversion", "l_ankle_inversion",
)  # fmt: skip
"""Link that each of the 15 joint centres is fixed to."""


@dataclass(frozen=True)
class Skeleton:
    """One person's joint tree: the shared hinges with this person's lengths.

    Attributes:
        offsets: (n_dofs, 3) float64, origin of hinge i in its parent link's frame [m]; zero inside ball joints.
        joint_offsets: (15, 3) float64, each joint centre in the frame of its `JOINT_LINKS` link [m]: head = centre
            of the skull, neck = base of the neck, torso = middle of the trunk, hand = middle of the palm,
            foot = middle of the foot, the rest the hinges themselves.
    """

    offsets: NDArray[np.float64]
    joint_offsets: NDArray[np.float64]

    def __post_init__(self) -> None:
        if self.offsets.shape != (N_DOFS, 3):
            raise ValueError(f"offsets have shape {self.offsets.shape}, must be ({N_DOFS}, 3)")
        if self.joint_offsets.shape != (N_JOINTS, 3):
            raise ValueError(f"joint_offsets have shape {self.joint_offsets.shape}, must be ({N_JOINTS}, 3)")


@dataclass(frozen=True)
class Lengths:
    """Segment lengths that fix a skeleton's offsets, all in metres, the same on both sides.

    Attributes:
        hip_half_width: Midline to hip joint centre.
        pelvis_to_lumbar: Hip centre up to the lumbar hinge (about L4/L5).
        lumbar_to_thorax: Lumbar to thoracic hinge (about T12).
        thorax_to_neck: Thoracic hinge to the base of the neck (about C7/T1).
        neck_to_head: Base of the neck to the hinge under the skull.
        head_up: Skull hinge up to the head's centre.
        clavicle_up: Thoracic hinge up to the inner end of the clavicle.
        clavicle_in: Midline to the inner end of the clavicle.
        clavicle: Inner end of the clavicle to the shoulder joint centre, along y.
        upper_arm: Shoulder to elbow joint centre.
        forearm: Elbow to wrist joint centre.
        palm: Wrist to the knuckles' hinge.
        fingers: Knuckles to the fingertips' hinge.
        thigh: Hip to knee joint centre.
        shank: Knee to ankle joint centre.
        foot: Ankle to toe hinge, along x.
        ankle_height: Ankle joint centre above the sole.
        neck_forward: Base of the neck before (+x) the hip centres.
        head_forward: Hinge under the skull before the hip centres.
        shoulder_forward: Shoulder joint centre before the hip centres.
        skull_forward: Head's centre before the hinge under the skull.
        thumb: Thumb's hinge from the wrist, left hand's frame.
    """

    hip_half_width: float
    pelvis_to_lumbar: float
    lumbar_to_thorax: float
    thorax_to_neck: float
    neck_to_head: float
    head_up: float
    clavicle_up: float
    clavicle_in: float
    clavicle: float
    upper_arm: float
    forearm: float
    palm: float
    fingers: float
    thigh: float
    shank: float
    foot: float
    ankle_height: float
    neck_forward: float = -0.02
    head_forward: float = -0.01
    shoulder_forward: float = -0.02
    skull_forward: float = 0.01
    thumb: tuple[float, float, float] | None = None

    @staticmethod
    def of_stature(stature: float) -> "Lengths":
        """Adult proportions after Winter (2009, fig. 4.1, from Drillis & Contini 1966).

        Args:
            stature: Standing height [m].
        """
        s = stature
        return Lengths(
            hip_half_width=0.050 * s,
            pelvis_to_lumbar=0.055 * s,
            lumbar_to_thorax=0.085 * s,
            thorax_to_neck=0.160 * s,
            neck_to_head=0.050 * s,
            head_up=0.045 * s,
            clavicle_up=0.125 * s,
            clavicle_in=0.012 * s,
            clavicle=0.095 * s,
            upper_arm=0.172 * s,
            forearm=0.146 * s,
            palm=0.052 * s,
            fingers=0.026 * s,
            thigh=0.245 * s,
            shank=0.246 * s,
            foot=0.085 * s,
            ankle_height=0.039 * s,
        )


def make_skeleton(lengths: Lengths) -> Skeleton:
    """Lays the hinges out by the segment lengths.

    Args:
        lengths: Segment lengths [m].
    """
    le = lengths
    offsets = np.zeros((N_DOFS, 3))
    offsets[DOF_IDX["lumbar_flexion"]] = (-0.01, 0, le.pelvis_to_lumbar)
    offsets[DOF_IDX["thorax_flexion"]] = (0, 0, le.lumbar_to_thorax)
    offsets[DOF_IDX["neck_flexion"]] = (le.neck_forward + 0.01, 0, le.thorax_to_neck)
    offsets[DOF_IDX["head_flexion"]] = (le.head_forward - le.neck_forward, 0, le.neck_to_head)
    for side, sign in (("l", 1.0), ("r", -1.0)):
        offsets[DOF_IDX[f"{side}_clavicle_elevation"]] = (0, sign * le.clavicle_in, le.clavicle_up)
        offsets[DOF_IDX[f"{side}_shoulder_flexion"]] = (le.shoulder_forward + 0.01, sign * le.clavicle, 0)
        offsets[DOF_IDX[f"{side}_elbow_flexion"]] = (0, 0, -le.upper_arm)
        offsets[DOF_IDX[f"{side}_wrist_flexion"]] = (0, 0, -le.forearm)
        offsets[DOF_IDX[f"{side}_fingers_flexion"]] = (0, 0, -le.palm)
        offsets[DOF_IDX[f"{side}_fingertips_flexion"]] = (0, 0, -le.fingers)
        thumb = le.thumb or (0.25 * le.palm, 0.0, -0.25 * le.palm)
        offsets[DOF_IDX[f"{side}_thumb_flexion"]] = (thumb[0], sign * thumb[1], thumb[2])
        offsets[DOF_IDX[f"{side}_hip_flexion"]] = (0, sign * le.hip_half_width, 0)
        offsets[DOF_IDX[f"{side}_knee_flexion"]] = (0, 0, -le.thigh)
        offsets[DOF_IDX[f"{side}_ankle_flexion"]] = (0, 0, -le.shank)
        offsets[DOF_IDX[f"{side}_toes_extension"]] = (le.foot, 0, -0.75 * le.ankle_height)
    centres = np.zeros((N_JOINTS, 3))
    trunk = le.pelvis_to_lumbar + le.lumbar_to_thorax + le.thorax_to_neck
    centres[JOINT_IDX["head"]] = (le.skull_forward, 0, le.head_up)
    centres[JOINT_IDX["torso"]] = (0.01, 0, 0.5 * trunk - le.pelvis_to_lumbar)
    for side, sign in (("r", -1.0), ("l", 1.0)):
        centres[JOINT_IDX[f"{side}_shoulder"]] = (le.shoulder_forward + 0.01, sign * le.clavicle, 0)
        centres[JOINT_IDX[f"{side}_hand"]] = (0, 0, -0.6 * le.palm)
        centres[JOINT_IDX[f"{side}_hip"]] = (0, sign * le.hip_half_width, 0)
        centres[JOINT_IDX[f"{side}_foot"]] = (0.5 * le.foot, 0, -0.5 * le.ankle_height)
    return Skeleton(offsets, centres)
