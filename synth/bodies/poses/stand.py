"""Trunk, head and legs of a standing or walking person."""

import numpy as np

from synth.bodies.poses.draft import Draft
from synth.bodies.rig.ik import Goal

TRUNK_HINGES = (
    "lumbar_flexion", "lumbar_lateral", "lumbar_rotation", "thorax_flexion", "thorax_lateral", "thorax_rotation",
)  # fmt: skip
OTHER = {"l": "r", "r": "l"}
SIGN = {"l": 1.0, "r": -1.0}
FIST_SHARE, FLAT_SHARE = 0.25, 0.15
"""How often a hand that holds nothing is a fist or flat; the shares are ours."""
"""Side of the midline that is the person's left or right, in y."""

# Joint angles over one gait cycle at natural cadence, every tenth of the cycle from heel contact [degrees], after
# Winter (2009), Biomechanics and Motor Control of Human Movement, appendix A, rounded; flexion positive.
_GAIT_HIP = (20, 16, 8, -1, -8, -11, -4, 10, 19, 21, 20)
_GAIT_KNEE = (4, 17, 18, 10, 6, 12, 34, 61, 50, 18, 4)
_GAIT_ANKLE = (-1, -3, 3, 7, 9, 4, -16, -10, -1, 1, -1)
_GAIT_TOES = (8, 0, 0, 0, 6, 24, 18, 4, 4, 8, 8)


def plant_feet(draft: Draft, feet: dict[str, tuple[float, float, float]]) -> float:
    """Puts the soles flat on the floor, both to within a millimetre where the legs reach.

    Args:
        draft: Changed in place: legs, and the root's height.
        feet: By side: x and y of the ankle [m] and the direction of the toes, left positive [degrees].

    Returns:
        Height of the higher foot's lowest vertex above the floor [m].
    """
    height = dict.fromkeys(feet, 0.0)
    low = dict.fromkeys(feet, 0.0)
    for _ in range(3):
        for side, (x, y, toe_yaw) in feet.items():
            sole = (0.0, 0.0, draft.marks.side[side].sole[2])
            toes = (np.cos(np.radians(toe_yaw)), np.sin(np.radians(toe_yaw)), 0.0)
            goals = [
                Goal("ankle_inversion", sole, (x, y, height[side]), (0.7, 0.7, 1.5)),
                Goal("ankle_inversion", (0, 0, 1), (0, 0, 1), 0.3, is_point=False),
                Goal("ankle_inversion", (1, 0, 0), toes, 0.15, is_point=False),
            ]
            draft.solve(f"{side}_leg", goals, 0.004)
            low[side] = draft.lowest(draft.marks.side[side].foot)
            height[side] -= low[side]
        if max(abs(value) for value in low.values()) < 1e-3:
            break
    drop = min(low.values())
    draft.T_world_root[2, 3] -= drop
    return max(low.values()) - drop


def root_height(draft: Draft, feet: dict[str, tuple[float, float, float]], straightness: float) -> float:
    """Greatest height at which both legs reach their feet, bent by the given share of their length [m]."""
    heights = []
    for side, (x, y, _) in feet.items():
        hip = draft.point(f"{side}_hip_flexion") - draft.T_world_root[:3, 3]
        aside = (x - hip[0]) ** 2 + (y - hip[1]) ** 2
        bones = straightness * (draft.marks.thigh + draft.marks.shank)
        ankle = -draft.marks.side[side].sole[2]
        heights.append(np.sqrt(max(bones**2 - aside, 0.01)) + ankle - hip[2])
    return float(min(heights))


def stand(
    draft: Draft, rng: np.random.Generator, wild: float, feet_forward: float = 0.0, bend: float = 0.0
) -> None:
    """Stands on both feet with the weight more on one.

    Args:
        draft: Root rotation and trunk are set; legs and root height are set here.
        rng: Random draws.
        wild: Scale of the variation, 1 as in life.
        feet_forward: x of the feet from the root [m].
        bend: How much the hips come down by bent knees, as a share of the leg.
    """
    marks = draft.marks
    stance = "l" if rng.random() < 0.5 else "r"
    half = abs(float(draft.point("l_hip_flexion")[1]))
    spread = half + wild * marks.leg * float(rng.uniform(-0.015, 0.1))
    shift = wild * marks.leg * float(rng.uniform(0.0, 0.045))
    step = wild * marks.leg * float(rng.normal(0.0, 0.06))
    feet = {}
    for side in "lr":
        is_stance = side == stance
        out = float(rng.uniform(0, 14 if is_stance else 24)) * min(wild, 1.0)
        x = feet_forward - 0.02 + (-0.3 * step if is_stance else step)
        y = SIGN[side] * spread - SIGN[stance] * shift
        feet[side] = (x, y, SIGN[side] * out)
        draft.set(f"{side}_", hip_flexion=5 + 90 * bend, knee_flexion=6 + 180 * bend, hip_rotation=-0.8 * out)
    straight = 1.0 - bend - float(rng.uniform(0.0005, 0.004))
    draft.T_world_root[2, 3] = root_height(draft, feet, straight)
    plant_feet(draft, feet)


def upright_trunk(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """Pelvis, spine and head of a person at ease, with the spine making up for the pelvis' list."""
    roll = wild * float(rng.normal(0, 2.0))
    draft.turn_root(roll=roll, pitch=float(rng.normal(1, 2.5)) * wild, yaw=0.0)
    draft.set(lumbar_flexion=float(rng.normal(1, 4)) * wild, thorax_flexion=float(rng.normal(2, 5)) * wild)
    draft.set(lumbar_lateral=-0.6 * roll, thorax_lateral=-0.4 * roll)
    draft.jitter(rng, 2.5 * wild, TRUNK_HINGES)
    draft.set(thorax_rotation=draft.get("thorax_rotation") + wild * float(rng.normal(0, 4)))


def look_about(draft: Draft, rng: np.random.Generator, wild: float, pitch: float = 3.0, yaw: float = 0.0) -> None:
    """Turns the head roughly to where the person looks [degrees]."""
    draft.look(pitch + wild * float(rng.normal(0, 7)), yaw + wild * float(rng.normal(0, 16)))
    draft.set(neck_lateral=wild * float(rng.normal(0, 4)))


def stand_upright(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """Base of the standing families."""
    upright_trunk(draft, rng, wild)
    stand(draft, rng, wild)
    look_about(draft, rng, wild)


def stand_bent(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """Bends forward from hips and spine, knees straight or bent, the feet under the centre of mass."""
    much = float(rng.uniform(0.25, 1.0))
    pitch = 8 + 50 * much
    draft.turn_root(roll=wild * float(rng.normal(0, 2)), pitch=pitch)
    draft.set(lumbar_flexion=8 + 28 * much, thorax_flexion=6 + 18 * much)
    draft.jitter(rng, 3 * wild, TRUNK_HINGES)
    top = draft.point("neck_flexion") - draft.T_world_root[:3, 3]
    knees = float(rng.uniform(0.005, 0.14)) * (0.4 + much)
    stand(draft, rng, wild, feet_forward=0.3 * float(top[0]), bend=knees)
    look_about(draft, rng, wild, pitch=10 + 55 * much)


def stand_leaning_to_push(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """Leans a little into what is pushed; stands, or walks in two of three draws."""
    if rng.random() < 0.67:
        walk(draft, rng, wild)
    else:
        stand_upright(draft, rng, wild)
    lean = float(rng.uniform(2, 9))
    draft.set(thorax_flexion=draft.get("thorax_flexion") + 0.6 * lean)
    draft.look(8 + float(rng.normal(4, 6)), wild * float(rng.normal(0, 10)))


def _at_phase(table: tuple[int, ...], phase: float) -> float:
    return float(np.interp(phase % 1.0, np.linspace(0, 1, len(table)), table))


def walk(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """One moment of a gait cycle; arms swing against the legs."""
    phase = float(rng.random())
    vigour = float(rng.uniform(0.75, 1.2))
    turn = 5.0 * vigour * float(np.cos(2 * np.pi * phase))
    roll = 3.0 * vigour * float(np.sin(2 * np.pi * phase))
    draft.turn_root(roll=roll, pitch=float(rng.uniform(0, 5)), yaw=-turn)
    draft.set(lumbar_flexion=float(rng.normal(2, 3)), thorax_flexion=float(rng.normal(2, 3)))
    draft.set(lumbar_lateral=-0.7 * roll, lumbar_rotation=0.6 * turn, thorax_rotation=1.2 * turn)
    draft.jitter(rng, 2.0 * wild, TRUNK_HINGES)
    toe_out = float(rng.uniform(0, 10))
    for side, own in (("l", phase), ("r", phase + 0.5)):
        draft.set(
            f"{side}_",
            hip_flexion=vigour * _at_phase(_GAIT_HIP, own) + draft_pitch(draft),
            hip_abduction=float(rng.normal(0.5, 1.5)),
            hip_rotation=-toe_out + SIGN[side] * turn,
            knee_flexion=vigour * _at_phase(_GAIT_KNEE, own) + 1,
            ankle_flexion=vigour * _at_phase(_GAIT_ANKLE, own),
            toes_extension=vigour * _at_phase(_GAIT_TOES, own),
        )
        swing = -vigour * 22 * float(np.cos(2 * np.pi * own))
        draft.set(f"{side}_", shoulder_flexion=3 + swing, elbow_flexion=18 + max(0.0, 0.7 * swing))
    feet = np.concatenate([draft.marks.side[side].foot for side in "lr"])
    draft.T_world_root[2, 3] -= draft.lowest(feet)
    look_about(draft, rng, wild)


def draft_pitch(draft: Draft) -> float:
    """How far the root leans forward [degrees]."""
    return float(-np.degrees(np.arcsin(draft.T_world_root[2, 0])))


def hang_arm(draft: Draft, side: str, rng: np.random.Generator, wild: float) -> None:
    """Lets an arm hang by the side, as far out as the trunk, hips and clothes ask for, and above the floor.

    The shoulder keeps a flexion that walking has set.
    """
    if draft.get(f"{side}_shoulder_flexion") == 0.0:
        pitch = draft_pitch(draft) + draft.get("lumbar_flexion") + draft.get("thorax_flexion")
        draft.set(f"{side}_", shoulder_flexion=0.9 * pitch + wild * float(rng.normal(2, 7)))
        draft.set(f"{side}_", elbow_flexion=float(rng.uniform(6, 24)))
    draft.set(
        f"{side}_",
        clavicle_elevation=wild * float(rng.normal(0, 2)),
        shoulder_rotation=wild * float(rng.normal(12, 9)),
        forearm_pronation=float(rng.normal(15, 12)),
        wrist_flexion=float(rng.normal(4, 6)),
        wrist_deviation=float(rng.normal(0, 4)),
    )
    curl_fingers(draft, side, rng, 22, 28)
    for abduction in np.arange(float(rng.uniform(3, 9)), 40, 3.0):
        draft.set(f"{side}_", shoulder_abduction=float(abduction))
        if draft.excess_of(side, "arm") <= 0.0:
            break
    hand = draft.marks.side[side].hand
    for _ in range(8):
        if draft.lowest(hand) >= 0.0:
            break
        draft.set(f"{side}_", elbow_flexion=draft.get(f"{side}_elbow_flexion") + 12.0)


def shape_hand(draft: Draft, side: str, rng: np.random.Generator) -> None:
    """Makes a fist, lays the fingers straight, or curls them by any amount, as hands are that hold nothing."""
    kind = rng.random()
    if kind < FIST_SHARE:
        curl_fingers(draft, side, rng, 76, 86, thumb=40)
    elif kind < FIST_SHARE + FLAT_SHARE:
        curl_fingers(draft, side, rng, 6, 8)
    else:
        curl_fingers(draft, side, rng, float(rng.uniform(0, 60)), float(rng.uniform(5, 50)))


def curl_fingers(
    draft: Draft, side: str, rng: np.random.Generator, knuckles: float, tips: float, thumb: float = 12.0
) -> None:
    """Bends the fingers to about the given angles [degrees]; both rows together, as tendons do."""
    common = float(rng.normal(0, 5))
    draft.set(
        f"{side}_",
        fingers_flexion=knuckles + common,
        fingertips_flexion=tips + common + float(rng.normal(0, 3)),
        thumb_flexion=thumb + float(rng.normal(0, 5)),
    )
