"""Arms of the families whose hands touch nothing, or the person's own body."""

import numpy as np

from synth.bodies.poses.draft import Draft
from synth.bodies.poses.hands import HandTargets, elbow_start, fingertip_in_hand, place_hand, unit
from synth.bodies.poses.lap import rest_on_thigh
from synth.bodies.poses.stand import OTHER, SIGN, curl_fingers
from synth.bodies.rig.collision import SEGMENT_IDX, fit_of
from synth.bodies.skeleton import LINK_IDX

ON_SKIN = 0.012
"""How near the skin a self-contact must end [m]."""


def lead_side(rng: np.random.Generator) -> str:
    """The hand that does it: "l" or "r"."""
    return "l" if rng.random() < 0.5 else "r"


def keep_relaxed(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Leaves the arms as the base has them."""
    return True


def stand_idle(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Arms hanging, or now and then hands clasped in front."""
    return _clasp(draft, rng) if rng.random() < 0.2 else True


def _clasp(draft: Draft, rng: np.random.Generator) -> bool:
    """One hand over the other in front of the belly."""
    lead = lead_side(rng)
    height = float(rng.uniform(0.0, 0.9))
    segment, link = ("pelvis", "root") if height < 0.35 else ("abdomen", "lumbar_rotation")
    target, normal = draft.surface(segment, link, height, 0.0)
    thickness = 2.0 * abs(float(draft.marks.side[lead].palm[1]))
    for side, off in ((OTHER[lead], 0.012), (lead, 0.016 + thickness)):
        elbow_start(draft, side, shoulder_rotation=45, elbow_flexion=70)
        aim = target + off * normal + np.array([0, SIGN[side] * 0.02, 0])
        fingers = (0.25, -SIGN[side], -0.35)
        if place_hand(draft, side, aim, -normal, fingers).point_error > ON_SKIN:
            return False
        curl_fingers(draft, side, rng, 20, 25)
    return True


def bend_arms(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Bent forward: hands on the thighs, one or two hands reaching down, or arms hanging."""
    kind = rng.random()
    if kind < 0.4:
        share = float(rng.uniform(0.55, 0.9))
        return all(rest_on_thigh(draft, side, rng, share + float(rng.normal(0, 0.03))) for side in "lr")
    sides = "lr" if kind < 0.6 else lead_side(rng) if kind < 0.85 else ""
    reach = draft.marks.upper_arm + draft.marks.forearm
    for side in sides:
        shoulder = draft.point(f"{side}_shoulder_flexion")
        way = unit((float(rng.uniform(0.2, 0.9)), SIGN[side] * float(rng.uniform(-0.15, 0.2)), -1.0))
        target = shoulder + reach * float(rng.uniform(0.85, 1.0)) * way
        target[2] = max(target[2], 0.05)
        elbow_start(draft, side, shoulder_flexion=80, elbow_flexion=20, shoulder_rotation=10)
        place_hand(draft, side, target, (0.2, -SIGN[side], -0.2), way, fingers_weight=0.03)
        curl_fingers(draft, side, rng, 25, 25)
    return True


def reach_out(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """One or both hands reach to a place in front, above, below or aside."""
    lead = lead_side(rng)
    elevation = np.radians(float(rng.uniform(-50, 75)))
    both = rng.random() < 0.3
    azimuth = np.radians(float(rng.uniform(-25, 90 if not both else 25)))
    for side in "lr" if both else lead:
        shoulder = draft.point(f"{side}_shoulder_flexion")
        way = np.array(
            [
                np.cos(elevation) * np.cos(azimuth),
                SIGN[side] * np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            ]
        )
        length = (draft.marks.upper_arm + draft.marks.forearm + draft.marks.palm) * float(rng.uniform(0.75, 1.0))
        elbow_start(
            draft,
            side,
            shoulder_flexion=60 + np.degrees(elevation),
            shoulder_rotation=10,
            elbow_flexion=30,
            clavicle_elevation=max(0.0, 20 * float(np.sin(elevation))),
            clavicle_protraction=15,
        )
        palm = (0.2, -SIGN[side] * float(rng.uniform(0.2, 1.0)), -float(rng.uniform(0.0, 0.8)))
        place_hand(draft, side, shoulder + length * way, palm, way, palm_weight=0.03, fingers_weight=0.04)
        curl_fingers(draft, side, rng, float(rng.uniform(5, 35)), 20)
    if rng.random() < 0.8:
        draft.look(-0.7 * float(np.degrees(elevation)), 0.6 * SIGN[lead] * float(np.degrees(azimuth)))
    return True


def cross_arms(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """One forearm lies on the other before the chest; the hands are at the other elbows."""
    upper = lead_side(rng)
    girth = float(fit_of(draft.body).profiles.radius[SEGMENT_IDX["l_forearm"]].mean())
    level = draft.marks.upper_arm * float(rng.uniform(0.78, 0.98))
    apart, out, ahead = rng.uniform((1.4, 1.6, 0.0), (2.1, 2.4, 0.5))
    past, back = rng.uniform((0.05, -0.2), (0.45, 0.1))
    elbow_ahead, elbow_aside = rng.uniform((0.3, 0.2), (0.6, 0.45))
    for side, layer in ((OTHER[upper], -apart), (upper, apart)):
        shoulder = draft.point(f"{side}_shoulder_flexion")
        z = float(shoulder[2]) - level
        x = _front_at(draft, z) + girth * (out + ahead * layer)
        y = -SIGN[side] * past * abs(float(shoulder[1] - draft.T_world_root[1, 3]))
        elbow = shoulder + draft.marks.upper_arm * unit((elbow_ahead, SIGN[side] * elbow_aside, -0.9))
        curl_fingers(draft, side, rng, 10, 14)
        elbow_start(
            draft, side, shoulder_flexion=25, shoulder_rotation=60, elbow_flexion=100, forearm_pronation=40
        )
        tilt = float(rng.uniform(-0.9, 0.1) if side == upper else rng.uniform(-0.1, 0.8))
        wrist, across = np.array([x, y, z + layer * girth]), (back, -SIGN[side], 0.03 * layer)
        solution = place_hand(draft, side, wrist, (-0.9, 0.0, tilt), across, np.zeros(3), elbow, palm_weight=0.04)
        if solution.point_error > 0.03:
            return False
    return True


def _front_at(draft: Draft, z: float) -> float:
    """World x of the trunk's front at a height [m]."""
    rows = [("abdomen", "lumbar_rotation"), ("thorax", "thorax_rotation")]
    points = [draft.surface(segment, link, h, 0.0)[0] for segment, link in rows for h in (0.0, 0.3, 0.6, 0.9)]
    near = [point[0] for point in points if abs(point[2] - z) < 0.08]
    return float(max(near)) if near else float(max(point[0] for point in points))


def hands_to_hips(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Palms on the iliac crests, elbows out; now and then one hand only."""
    sides = "lr" if rng.random() < 0.8 else lead_side(rng)
    turn = float(rng.uniform(70, 100))
    for side in sides:
        height = float(rng.uniform(0.05, 0.4))
        target, normal = draft.surface("abdomen", "lumbar_rotation", height, SIGN[side] * turn)
        forward = SIGN[side] * np.cross(normal, (0.0, 0.0, 1.0))
        shoulder = draft.point(f"{side}_shoulder_flexion")
        elbow = shoulder + draft.marks.upper_arm * unit((-0.25, SIGN[side] * 0.75, -0.8))
        elbow_start(
            draft, side, shoulder_flexion=-15, shoulder_abduction=40, shoulder_rotation=30, elbow_flexion=95
        )
        solution = place_hand(
            draft, side, target + 0.008 * normal, -normal, forward - np.array([0, 0, 0.35]), elbow=elbow
        )
        if solution.point_error > ON_SKIN:
            return False
        curl_fingers(draft, side, rng, 12, 15, thumb=0)
    return True


def _face_goal(
    draft: Draft, side: str, rng: np.random.Generator, height: float, turn: float, by_tips: bool, off: float
) -> bool:
    """Brings fingers or palm of a hand to a place on the head."""
    target, normal = draft.surface("head", "head_rotation", height, SIGN[side] * turn)
    shoulder = draft.point(f"{side}_shoulder_flexion")
    elbow = shoulder + draft.marks.upper_arm * unit((0.55, SIGN[side] * float(rng.uniform(0.0, 0.45)), -0.8))
    elbow_start(draft, side, shoulder_flexion=45, shoulder_rotation=30, elbow_flexion=130, forearm_pronation=0)
    local = fingertip_in_hand(draft, side) if by_tips else None
    palm = -normal - np.array([0.0, 0.0, 0.2])
    fingers = np.array([-0.15, -SIGN[side] * 0.2, 1.0])
    solution = place_hand(draft, side, target + off * normal, palm, fingers, local, elbow)
    return solution.point_error < ON_SKIN


def hand_to_face(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Fingers at chin, mouth, cheek or temple, or the cheek in the palm."""
    side = lead_side(rng)
    places = ((0.1, 15.0, True), (0.2, 20.0, True), (0.3, 50.0, False), (0.6, 60.0, True), (0.35, 60.0, True))
    height, turn, by_tips = places[int(rng.integers(len(places)))]
    curl_fingers(draft, side, rng, 30 if by_tips else 15, 35 if by_tips else 20)
    return _face_goal(draft, side, rng, height, turn + float(rng.normal(0, 6)), by_tips, 0.006)


def use_phone(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """A phone at the ear, or held in front in one hand or both, the eyes on it."""
    side = lead_side(rng)
    if rng.random() < 0.45:
        curl_fingers(draft, side, rng, 30, 35, thumb=30)
        return _face_goal(draft, side, rng, float(rng.uniform(0.35, 0.5)), 80.0, False, 0.018)
    head = draft.point("head_rotation", (0.0, 0.0, 0.06))
    far = draft.marks.forearm * float(rng.uniform(1.0, 1.5))
    pitch = float(rng.uniform(25, 55))
    away = np.array([np.cos(np.radians(pitch)), 0.0, -np.sin(np.radians(pitch))])
    screen = head + far * away
    sides = "lr" if rng.random() < 0.4 else side
    for own in sides:
        apart = 0.05 if len(sides) == 2 else 0.01
        target = screen + np.array([0.02, SIGN[own] * apart, -0.02])
        elbow_start(draft, own, shoulder_rotation=35, elbow_flexion=100, forearm_pronation=-30)
        palm = -away + np.array([0.0, -SIGN[own] * (0.9 if len(sides) == 2 else 0.4), 0.3])
        if (
            place_hand(draft, own, target, palm, (0.35, -0.2 * SIGN[own], 0.9), palm_weight=0.06).point_error
            > 0.03
        ):
            return False
        curl_fingers(draft, own, rng, 45, 40, thumb=25)
    draft.look(pitch, 0.0)
    return True


def carry(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """A box between the palms, or a tray on them, before the belly or the chest."""
    belly = max(draft.surface("abdomen", "lumbar_rotation", 0.5, 0.0)[0][0], draft.T_world_root[0, 3] + 0.08)
    hips = float(draft.T_world_root[2, 3])
    width = draft.marks.upper_arm * float(rng.uniform(0.45, 1.5))
    z = hips + draft.marks.trunk * float(rng.uniform(0.0, 0.65))
    x = belly + draft.marks.forearm * float(rng.uniform(0.35, 0.75))
    is_tray = rng.random() < 0.35
    for side in "lr":
        elbow_start(draft, side, elbow_flexion=80, forearm_pronation=-20 if is_tray else 0, shoulder_rotation=20)
        palm = (0.0, -SIGN[side] * 0.35, 1.0) if is_tray else (-0.1, -SIGN[side], 0.35)
        target = (x, SIGN[side] * 0.5 * width, z)
        shoulder = draft.point(f"{side}_shoulder_flexion")
        elbow = shoulder + draft.marks.upper_arm * unit((0.05, SIGN[side] * 0.25, -1.0))
        solution = place_hand(draft, side, target, palm, (1.0, -0.1 * SIGN[side], -0.1), elbow=elbow)
        if solution.point_error > 0.03:
            return False
        curl_fingers(draft, side, rng, 20, 20, thumb=5)
    draft.look(float(rng.uniform(0, 30)), float(rng.normal(0, 8)))
    return True


def point_out(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """A straight arm points at something; the head mostly follows."""
    side = lead_side(rng)
    azimuth = np.radians(float(rng.uniform(-15, 85)))
    elevation = np.radians(float(rng.uniform(-20, 35)))
    flat = np.cos(elevation)
    way = np.array([flat * np.cos(azimuth), SIGN[side] * flat * np.sin(azimuth), np.sin(elevation)])
    shoulder = draft.point(f"{side}_shoulder_flexion")
    length = (draft.marks.upper_arm + draft.marks.forearm) * float(rng.uniform(0.93, 1.0))
    elbow_start(draft, side, shoulder_flexion=80, elbow_flexion=12, shoulder_rotation=0)
    palm = (0.0, -SIGN[side] * float(rng.uniform(0, 1)), -1.0)
    place_hand(draft, side, shoulder + length * way, palm, way, np.zeros(3), palm_weight=0.03, fingers_weight=0.08)
    draft.set(f"{side}_", fingers_flexion=4, fingertips_flexion=8, thumb_flexion=35)
    if rng.random() < 0.75:
        draft.look(-0.6 * float(np.degrees(elevation)), 0.7 * SIGN[side] * float(np.degrees(azimuth)))
    return True


def wave(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """A raised open hand, palm forward."""
    side = lead_side(rng)
    shoulder = draft.point(f"{side}_shoulder_flexion")
    reach = draft.marks.upper_arm
    out = SIGN[side] * reach * float(rng.uniform(0.3, 1.1))
    target = shoulder + np.array(
        [reach * float(rng.uniform(0.3, 0.9)), out, reach * float(rng.uniform(0.35, 1.0))]
    )
    elbow = shoulder + reach * unit((0.4, SIGN[side] * 0.7, -0.45))
    elbow_start(draft, side, shoulder_abduction=50, shoulder_rotation=-40, elbow_flexion=110, forearm_pronation=50)
    lean = float(rng.normal(0.15, 0.25))
    place_hand(draft, side, target, (1.0, 0.0, 0.0), (0.0, SIGN[side] * lean, 1.0), elbow=elbow, palm_weight=0.06)
    draft.set(f"{side}_", fingers_flexion=0, fingertips_flexion=float(rng.uniform(3, 15)), thumb_flexion=-15)
    return True


def sit_idle(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Hands on the thighs or in the lap (as the base has them), arms crossed, or a hand at the face."""
    kind = rng.random()
    if kind < 0.12:
        return cross_arms(draft, rng, targets)
    if kind < 0.24:
        return hand_to_face(draft, rng, targets)
    return True


def sit_leaning(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Leaning forward, forearms on the thighs and hands between the knees; else as `sit_idle`."""
    forward = draft.links()[LINK_IDX["thorax_rotation"]][0, 2]
    if forward < 0.4:
        return sit_idle(draft, rng, targets)
    knees = 0.5 * (draft.point("l_knee_flexion") + draft.point("r_knee_flexion"))
    for side in "lr":
        top, up = draft.surface(f"{side}_thigh", f"{side}_hip_rotation", 0.4, -SIGN[side] * 10)
        elbow_start(draft, side, shoulder_flexion=40, elbow_flexion=60, shoulder_rotation=40)
        target = knees + np.array([float(rng.uniform(0.0, 0.06)), SIGN[side] * 0.035, 0.08])
        elbow = top + 0.05 * up
        if (
            place_hand(
                draft, side, target, (0, -SIGN[side], -0.3), (1, -0.3 * SIGN[side], -0.3), elbow=elbow
            ).point_error
            > 0.05
        ):
            return False
        curl_fingers(draft, side, rng, 40, 40)
    return True
