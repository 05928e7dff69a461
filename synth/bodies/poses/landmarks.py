"""Contact landmarks of a body: what of hands, feet and seat touches things, and the lengths of the limbs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body, kept_with_body
from synth.bodies.rig.collision import SEGMENT_IDX, fit_of, moved_by
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import DOF_IDX, LINK_IDX

_PALM = ("wrist_deviation",)
_FINGERTIPS = ("fingertips_flexion",)
_FINGERS = ("fingers_flexion", *_FINGERTIPS)
_THUMB = ("thumb_flexion",)
_FOREARM = ("elbow_flexion", "forearm_pronation")
_FOOT = ("ankle_inversion", "toes_extension")
_THIGH = ("hip_abduction", "hip_rotation")


@dataclass(frozen=True)
class Side:
    """Contact landmarks of one side of a body.

    Attributes:
        palm: (3,) middle of the palm's skin, hand frame [m].
        grip: (3,) skin under the knuckles, where a bar lies in a fist, hand frame [m].
        palm_normal: (3,) out of the palm, hand frame.
        fingertip: (3,) middle of the finger ends, fingertips' frame [m].
        sole: (3,) middle of the sole, foot frame [m].
        hand: Skin vertices of hand and fingers.
        palm_skin: Those of the palm alone.
        finger_skin: Those of the fingers alone.
        thumb_skin: Those of the thumb alone.
        forearm: Skin vertices between elbow and wrist.
        foot: Skin vertices of the foot.
    """

    palm: NDArray[np.float64]
    grip: NDArray[np.float64]
    palm_normal: NDArray[np.float64]
    fingertip: NDArray[np.float64]
    sole: NDArray[np.float64]
    hand: NDArray[np.int64]
    palm_skin: NDArray[np.int64]
    finger_skin: NDArray[np.int64]
    thumb_skin: NDArray[np.int64]
    forearm: NDArray[np.int64]
    foot: NDArray[np.int64]


@dataclass(frozen=True)
class Landmarks:
    """Contact landmarks of a body.

    Attributes:
        side: "l" and "r".
        seat: Skin vertices of pelvis and thighs.
        upper_arm: Shoulder to elbow [m].
        forearm: Elbow to wrist [m].
        palm: Wrist to knuckles [m].
        thigh: Hip to knee [m].
        shank: Knee to ankle [m].
        foot: Ankle to toe hinge [m].
        leg: Hip centre to sole, straight [m].
        trunk: Hip centres to the base of the neck [m].
    """

    side: dict[str, Side]
    seat: NDArray[np.int64]
    upper_arm: float
    forearm: float
    palm: float
    thigh: float
    shank: float
    foot: float
    leg: float
    trunk: float


def mean_radius(body: Body, segment: str, height: float) -> float:
    """Mean distance of a segment's skin from its axis [m].

    Args:
        body: The person.
        segment: Name in `SEGMENTS`.
        height: Share of the segment's extent along its frame's z, 0 at its low end.
    """
    radius = fit_of(body).profiles.radius[SEGMENT_IDX[segment]]
    return float(radius[round(height * (len(radius) - 1))].mean())


class _BindSkin:
    """The skin in the bind pose, by the link that moves each vertex most."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self.T_bind = link_transforms(body.skeleton, body.bind_angles, np.eye(4))
        self.vertices = body.mesh.vertices.astype(np.float64)

    def of(self, side: str, links: tuple[str, ...]) -> NDArray[np.int64]:
        """Vertices that links of a side move."""
        return moved_by(self.body, (f"{side}_{link}" for link in links))

    def local(self, side: str, links: tuple[str, ...], frame: str) -> NDArray[np.float64]:
        """(n, 3) those vertices in the frame of a link of that side [m]."""
        T = self.T_bind[LINK_IDX[f"{side}_{frame}"]]
        return (self.vertices[self.of(side, links)] - T[:3, 3]) @ T[:3, :3]


@kept_with_body
def landmarks_of(body: Body) -> Landmarks:
    """The body's landmarks, found at the first call and kept as long as the body lives."""
    skin = _BindSkin(body)
    length = np.linalg.norm(body.skeleton.offsets, axis=1)
    palm = float(length[DOF_IDX["l_fingers_flexion"]])
    foot = float(length[DOF_IDX["l_toes_extension"]])
    sides = {side: _find_side(skin, side, inward, palm, foot) for side, inward in (("l", -1.0), ("r", 1.0))}
    thigh = float(length[DOF_IDX["l_knee_flexion"]])
    shank = float(length[DOF_IDX["l_ankle_flexion"]])
    names = ["lumbar_flexion", "thorax_flexion", "neck_flexion"]
    pelvis = moved_by(body, ("root",))
    return Landmarks(
        side=sides,
        seat=np.concatenate([pelvis, skin.of("l", _THIGH), skin.of("r", _THIGH)]),
        upper_arm=float(length[DOF_IDX["l_elbow_flexion"]]),
        forearm=float(length[DOF_IDX["l_wrist_flexion"]]),
        palm=palm,
        thigh=thigh,
        shank=shank,
        foot=foot,
        leg=thigh + shank - float(sides["l"].sole[2]),
        trunk=float(sum(length[DOF_IDX[name]] for name in names)),
    )


def _find_side(skin: _BindSkin, side: str, inward: float, palm: float, foot: float) -> Side:
    """Landmarks of one side.

    Args:
        skin: The skin.
        side: "l" or "r".
        inward: Sign in y of the direction that the palm faces in the bind pose.
        palm: Wrist to knuckles [m].
        foot: Ankle to toe hinge [m].
    """
    hand = skin.local(side, _PALM, "wrist_deviation")
    middle = hand[(hand[:, 2] > -0.9 * palm) & (hand[:, 2] < -0.3 * palm)]
    palm_y = inward * np.quantile(inward * middle[:, 1], 0.97)
    knuckles = hand[(hand[:, 2] > -1.05 * palm) & (hand[:, 2] < -0.75 * palm)]
    grip_y = inward * np.quantile(inward * knuckles[:, 1], 0.9)
    tips = skin.local(side, _FINGERTIPS, "fingertips_flexion")
    feet = skin.local(side, _FOOT, "ankle_inversion")
    return Side(
        palm=np.array([np.median(middle[:, 0]), palm_y, -0.6 * palm]),
        grip=np.array([np.median(knuckles[:, 0]), grip_y, -0.95 * palm]),
        palm_normal=np.array([0.0, inward, 0.0]),
        fingertip=tips[tips[:, 2] < tips[:, 2].min() + 0.012].mean(axis=0),
        sole=np.array([0.35 * foot, 0.0, feet[:, 2].min()]),
        hand=skin.of(side, (*_PALM, *_FINGERS, *_THUMB)),
        palm_skin=skin.of(side, _PALM),
        finger_skin=skin.of(side, _FINGERS),
        thumb_skin=skin.of(side, _THUMB),
        forearm=skin.of(side, _FOREARM),
        foot=skin.of(side, _FOOT),
    )
