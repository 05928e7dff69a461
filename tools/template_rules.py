"""Which part label and which skin weights a point of the bind-pose surface gets; used by `make_template.py`.

All rules are for the left half; distances are in units of stature unless they say otherwise. Landmarks are the
positions of the links of the bind pose.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.skeleton import LINK_IDX
from synth.vocabulary import PART

Array = NDArray[np.float64]


def smoothstep(x: Array, low: float, high: float) -> Array:
    """0 below low, 1 above high, 3t^2 - 2t^3 between."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def unit(v: Array) -> Array:
    """The vector over its length."""
    return v / np.linalg.norm(v)


@dataclass(frozen=True)
class Membership:
    """Whose surface a point is, apart from where along it.

    Attributes:
        arm: (n,) 1 on the arm (shoulder joint to fingertips), 0 on trunk and legs.
        leg: (n,) 1 on the leg below the groin.
        head: (n,) 1 on the head, above the jaw line.
        thumb: (n,) 1 on the thumb.
    """

    arm: Array
    leg: Array
    head: Array
    thumb: Array


class Landmarks:
    """Link positions of the bind pose by name.

    Args:
        T_root_link: (n_links, 4, 4).
        stature: [m].
    """

    def __init__(self, T_root_link: Array, stature: float) -> None:
        self.T = T_root_link
        self.stature = stature

    def __call__(self, name: str) -> Array:
        """(3,) a link's origin."""
        return self.T[LINK_IDX[name], :3, 3]

    def crossing(self, p: Array, name: str, normal: Array, half_width: float, shift: float = 0.0) -> Array:
        """Smooth step through the plane at a link's origin, 1 on the normal's side; widths in statures."""
        h = (p - self(name)) @ unit(normal) - shift * self.stature
        return smoothstep(h, -half_width * self.stature, half_width * self.stature)


def weights_of(p: Array, mark: Landmarks, member: Membership) -> dict[str, Array]:
    """Skin weights of points of the left half, before the blend across the midline.

    Args:
        p: (n, 3) bind pose, root frame [m].
        mark: Landmarks.
        member: Whose surface each point is.

    Returns:
        (n,) weight by link name; they sum to 1.
    """
    shoulder, elbow = mark("l_shoulder_flexion"), mark("l_elbow_flexion")
    wrist, knuckle = mark("l_wrist_flexion"), mark("l_fingers_flexion")
    hip, knee, ankle = mark("l_hip_flexion"), mark("l_knee_flexion"), mark("l_ankle_flexion")
    upper, fore = unit(elbow - shoulder), unit(wrist - elbow)
    hand, thigh, shank = unit(knuckle - wrist), unit(knee - hip), unit(ankle - knee)

    arm = member.arm * mark.crossing(p, "l_shoulder_flexion", unit(upper + np.array([0.0, 0.7, 0.1])), 0.048)
    past_elbow = mark.crossing(p, "l_elbow_flexion", upper + fore, 0.024)
    past_wrist = mark.crossing(p, "l_wrist_flexion", fore + hand, 0.018)
    past_knuckle = mark.crossing(p, "l_fingers_flexion", hand, 0.008) * (1.0 - member.thumb)
    past_middle = mark.crossing(p, "l_fingertips_flexion", hand, 0.006) * (1.0 - member.thumb)
    twist_upper = smoothstep((p - shoulder) @ upper / np.linalg.norm(elbow - shoulder), 0.1, 0.9)
    twist_fore = smoothstep((p - elbow) @ fore / np.linalg.norm(wrist - elbow), 0.1, 0.95)

    # The groin rises to the side; behind, the buttock follows the thigh over a longer stretch.
    back = smoothstep(-(p[:, 0] - hip[0]), 0.0, 0.05 * mark.stature)
    height = (p - hip) @ unit(thigh - (0.0, 0.35, 0.0)) / mark.stature
    leg = smoothstep(height + 0.012 - 0.004 * back, -0.034 - 0.012 * back, 0.034 + 0.012 * back)
    leg = np.maximum(leg, 0.0) * (1.0 - member.arm)
    past_knee = mark.crossing(p, "l_knee_flexion", thigh + shank, 0.030)
    past_ankle = mark.crossing(p, "l_ankle_flexion", np.array([0.4, 0.0, -0.9]), 0.014)
    past_toes = mark.crossing(p, "l_toes_extension", np.array([1.0, 0.0, 0.0]), 0.010)
    twist_thigh = smoothstep((p - hip) @ thigh / np.linalg.norm(knee - hip), 0.1, 0.9)

    rest = (1.0 - arm) * (1.0 - leg)
    clavicle = smoothstep(p[:, 1], 0.25 * shoulder[1], 0.85 * shoulder[1])
    clavicle *= smoothstep(p[:, 2], shoulder[2] - 0.075 * mark.stature, shoulder[2] + 0.015 * mark.stature)
    up = np.array([0.0, 0.0, 1.0])
    past_lumbar = mark.crossing(p, "lumbar_flexion", up, 0.035)
    past_thorax = mark.crossing(p, "thorax_flexion", up, 0.050)
    past_neck = mark.crossing(p, "neck_flexion", np.array([-0.25, 0.0, 1.0]), 0.022, 0.006)
    past_head = np.maximum(mark.crossing(p, "head_flexion", np.array([-0.5, 0.0, 1.0]), 0.020), member.head)
    past_neck *= 1.0 - smoothstep(p[:, 1], 0.045 * mark.stature, 0.075 * mark.stature) * (1 - member.head)
    clavicle *= 1.0 - past_neck
    past_neck, past_head = np.maximum(past_neck, member.head), past_head * np.maximum(past_neck, member.head)
    trunk = rest * (1.0 - clavicle)
    hand_all = arm * past_elbow * past_wrist
    foot = leg * past_knee * past_ankle
    return {
        "root": trunk * (1 - past_lumbar),
        "lumbar_rotation": trunk * past_lumbar * (1 - past_thorax),
        "thorax_rotation": trunk * past_lumbar * past_thorax * (1 - past_neck),
        "neck_rotation": trunk * past_lumbar * past_thorax * past_neck * (1 - past_head),
        "head_rotation": trunk * past_lumbar * past_thorax * past_neck * past_head,
        "l_clavicle_protraction": rest * clavicle,
        "l_shoulder_abduction": arm * (1 - past_elbow) * (1 - twist_upper),
        "l_shoulder_rotation": arm * (1 - past_elbow) * twist_upper,
        "l_elbow_flexion": arm * past_elbow * (1 - past_wrist) * (1 - twist_fore),
        "l_forearm_pronation": arm * past_elbow * (1 - past_wrist) * twist_fore,
        "l_wrist_deviation": hand_all * (1 - past_knuckle) * (1 - member.thumb),
        "l_fingers_flexion": hand_all * past_knuckle * (1 - past_middle) * (1 - member.thumb),
        "l_fingertips_flexion": hand_all * past_knuckle * past_middle * (1 - member.thumb),
        "l_thumb_flexion": hand_all * member.thumb,
        "l_hip_abduction": leg * (1 - past_knee) * (1 - twist_thigh),
        "l_hip_rotation": leg * (1 - past_knee) * twist_thigh,
        "l_knee_flexion": leg * past_knee * (1 - past_ankle),
        "l_ankle_inversion": foot * (1 - past_toes),
        "l_toes_extension": foot * past_toes,
    }


def labels_of(p: Array, mark: Landmarks, member: Membership, weights: dict[str, Array]) -> NDArray[np.uint8]:
    """Part labels (left side) of points of the left half.

    Bands after Shotton et al. 2011 (fig. 2): wrists, elbows, knees and ankles are short stretches about the joint,
    the shoulder a cap about its own, head and trunk quadrants about their centres.

    Args:
        p: (n, 3) bind pose, root frame [m].
        mark: Landmarks.
        member: Whose surface each point is.
        weights: From `weights_of`.

    Returns:
        (n,) labels.
    """
    s = mark.stature
    shoulder, elbow = mark("l_shoulder_flexion"), mark("l_elbow_flexion")
    wrist, knuckle = mark("l_wrist_flexion"), mark("l_fingers_flexion")
    hip, knee, ankle = mark("l_hip_flexion"), mark("l_knee_flexion"), mark("l_ankle_flexion")
    mid_height = 0.5 * (mark("lumbar_flexion")[2] + mark("thorax_flexion")[2]) + 0.02 * s
    out = np.where(p[:, 2] > mid_height, PART["lu_torso"], PART["lw_torso"]).astype(np.uint8)

    neck_share = weights["neck_rotation"] + weights["head_rotation"]
    out[neck_share > 0.35] = PART["neck"]
    centre = mark("head_flexion") + np.array([0.0, 0.0, 0.045 * s])
    is_head = member.head > 0.5
    out[is_head] = np.where(p[is_head, 2] > centre[2], PART["lu_head"], PART["lw_head"])

    arm = (member.arm > 0.5) & ((p - shoulder) @ unit(elbow - shoulder + (0, 0.05 * s, 0)) > 0.0)
    along = (p - shoulder) @ unit(elbow - shoulder)
    on_arm = np.full(len(p), PART["lu_arm"], dtype=np.uint8)
    h_elbow = (p - elbow) @ unit(unit(elbow - shoulder) + unit(wrist - elbow))
    h_wrist = (p - wrist) @ unit(unit(wrist - elbow) + unit(knuckle - wrist))
    on_arm[along < 0.042 * s] = PART["l_shoulder"]
    on_arm[h_elbow > -0.024 * s] = PART["l_elbow"]
    on_arm[h_elbow > 0.024 * s] = PART["lw_arm"]
    on_arm[h_wrist > -0.018 * s] = PART["l_wrist"]
    on_arm[h_wrist > 0.010 * s] = PART["l_hand"]
    out[arm] = on_arm[arm]
    near = (np.linalg.norm(p - shoulder, axis=1) < 0.062 * s) & ~arm & (neck_share <= 0.35)
    out[near & (p[:, 1] > 0.6 * shoulder[1])] = PART["l_shoulder"]

    thigh, shank = unit(knee - hip), unit(ankle - knee)
    leg = sum(weights[f"l_{n}"] for n in ("hip_abduction", "hip_rotation", "knee_flexion", "ankle_inversion"))
    leg = leg + weights["l_toes_extension"]
    on_leg = np.full(len(p), PART["lu_leg"], dtype=np.uint8)
    h_knee = (p - knee) @ unit(thigh + shank)
    h_ankle = (p - ankle) @ unit(np.array([0.35, 0.0, -0.94]))
    on_leg[h_knee > -0.034 * s] = PART["l_knee"]
    on_leg[h_knee > 0.034 * s] = PART["lw_leg"]
    on_leg[h_ankle > -0.030 * s] = PART["l_ankle"]
    on_leg[h_ankle > 0.006 * s] = PART["l_foot"]
    out[(leg > 0.5) & (member.arm < 0.5)] = on_leg[(leg > 0.5) & (member.arm < 0.5)]
    return out
