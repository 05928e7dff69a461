"""Standing people in motion for its own sake: wide stances, squats, lunges, raised legs, arms anywhere."""

import numpy as np

from synth.bodies.poses.draft import Draft
from synth.bodies.poses.hands import HandTargets
from synth.bodies.poses.stand import OTHER, SIGN, TRUNK_HINGES, look_about, plant_feet, root_height, shape_hand

ON_ONE_LEG_SHARE = 0.3
LONG_STEP_SHARE = 0.5
"""How often those on both feet take a step of up to nine tenths of the leg, straight on or askew, the weight on
either foot."""
HANGING_SHARE = 0.15
"""How often an arm stays by the side."""
EVEN_SHARE = 0.35
"""How often both arms do the same."""
CLEARANCE = 0.03
"""Least height of a raised foot above the floor [m]."""


def stand_exercising(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """Base of the family: the trunk leans and twists, feet stand wide or apart, or one leg is raised."""
    draft.turn_root(
        roll=wild * float(rng.normal(0, 5)),
        pitch=wild * float(rng.normal(6, 12)),
        yaw=wild * float(rng.normal(0, 12)),
    )
    draft.set(lumbar_flexion=wild * float(rng.normal(3, 8)), thorax_flexion=wild * float(rng.normal(3, 8)))
    draft.jitter(rng, 7 * wild, TRUNK_HINGES)
    if rng.random() < ON_ONE_LEG_SHARE:
        _stand_on_one_leg(draft, rng, wild)
    else:
        _stand_wide(draft, rng, wild)
    look_about(draft, rng, 1.3 * wild)


def stand_stooped(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """Bends down far or a little, twisted, with one foot before the other and the knees straight to deeply bent."""
    much = float(rng.uniform(0.2, 1.0))
    draft.turn_root(roll=wild * float(rng.normal(0, 5)), pitch=10 + 65 * much, yaw=wild * float(rng.normal(0, 6)))
    draft.set(lumbar_flexion=5 + 35 * much, thorax_flexion=float(rng.uniform(0, 30)) * much)
    draft.jitter(rng, 6 * wild, TRUNK_HINGES)
    top = draft.point("neck_flexion") - draft.T_world_root[:3, 3]
    _plant_apart(draft, rng, wild, 0.35 * float(top[0]), 0.1, float(rng.beta(0.8, 2.0)) * 0.45)
    look_about(draft, rng, 1.3 * wild, pitch=float(rng.uniform(0, 70)))


def squat(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """Knees deeply bent, the soles on the floor, the trunk leaning forward for balance."""
    bend = float(rng.uniform(0.15, 0.45))
    draft.turn_root(roll=wild * float(rng.normal(0, 3)), pitch=30 * bend + float(rng.uniform(5, 30)))
    draft.set(lumbar_flexion=float(rng.uniform(0, 30)), thorax_flexion=float(rng.uniform(0, 20)))
    draft.jitter(rng, 5 * wild, TRUNK_HINGES)
    _plant_apart(draft, rng, wild, float(rng.uniform(0.0, 0.2)) * draft.marks.leg * bend, 0.12, bend)
    look_about(draft, rng, 1.3 * wild, pitch=float(rng.uniform(-5, 30)))


def _plant_apart(
    draft: Draft, rng: np.random.Generator, wild: float, forward: float, wide: float, bend: float
) -> None:
    """Puts both soles on the floor, each at a place of its own.

    Args:
        draft: Root rotation and trunk are set.
        rng: Random draws.
        wild: Scale of the variation.
        forward: x of the feet from the root [m].
        wide: Mean of how much farther apart than the hips each foot is, as a share of the leg.
        bend: How much the hips come down by bent knees, as a share of the leg.
    """
    leg, half = draft.marks.leg, abs(float(draft.point("l_hip_flexion")[1]))
    feet = {}
    for side in "lr":
        out = float(rng.uniform(0, 30)) * wild
        y = half + wild * leg * wide * float(rng.uniform(-0.3, 2.0))
        feet[side] = (forward + wild * leg * float(rng.normal(0, 0.09)), SIGN[side] * y, SIGN[side] * out)
        draft.set(f"{side}_", hip_flexion=5 + 90 * bend, knee_flexion=6 + 180 * bend, hip_rotation=-0.8 * out)
    draft.T_world_root[2, 3] = root_height(draft, feet, 1.0 - bend - float(rng.uniform(0.0005, 0.004)))
    plant_feet(draft, feet)


def _stand_wide(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """Both soles on the floor, apart to the sides or one before the other; knees straight to deeply bent."""
    leg = draft.marks.leg
    half = abs(float(draft.point("l_hip_flexion")[1]))
    apart = half + wild * leg * float(rng.beta(1.0, 2.5)) * 0.4
    is_long = rng.random() < LONG_STEP_SHARE
    step = wild * leg * float(rng.uniform(-0.45, 0.45) if is_long else rng.normal(0.0, 0.16))
    askew = np.radians(wild * float(rng.uniform(-50, 50))) if is_long else 0.0
    middle = float(rng.uniform(-0.7, 0.7)) * abs(step)
    bend = wild * float(rng.beta(0.7, 2.5)) * 0.4
    feet = {}
    for side, along in (("l", middle + step), ("r", middle - step)):
        out = float(rng.uniform(0, 25)) * wild
        x, y = along * np.cos(askew), along * np.sin(askew)
        feet[side] = (x + 0.25 * leg * bend - 0.02, y + SIGN[side] * apart, SIGN[side] * out)
        draft.set(f"{side}_", hip_flexion=5 + 90 * bend, knee_flexion=6 + 180 * bend, hip_rotation=-0.8 * out)
    draft.T_world_root[2, 3] = root_height(draft, feet, 1.0 - bend - float(rng.uniform(0.0005, 0.004)))
    plant_feet(draft, feet)


def _stand_on_one_leg(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """One sole on the floor, the other leg forward, back or aside, straight as in a kick or bent."""
    stance = "l" if rng.random() < 0.5 else "r"
    bend = wild * float(rng.uniform(0.0, 0.06))
    draft.set(f"{stance}_", hip_flexion=5 + 90 * bend, knee_flexion=6 + 180 * bend)
    feet = {stance: (-0.02, SIGN[stance] * 0.35 * abs(float(draft.point("l_hip_flexion")[1])), 0.0)}
    draft.T_world_root[2, 3] = root_height(draft, feet, 1.0 - bend - 0.002)
    plant_feet(draft, feet)
    raised = OTHER[stance]
    flexion, knee = float(rng.uniform(-20, 95)), float(rng.beta(0.8, 1.2)) * 110
    for _ in range(12):
        draft.set(
            f"{raised}_",
            hip_flexion=flexion,
            hip_abduction=float(rng.uniform(0, 35)),
            hip_rotation=float(rng.uniform(-25, 15)),
            knee_flexion=knee,
            ankle_flexion=float(rng.uniform(-25, 10)),
        )
        if draft.lowest(draft.marks.side[raised].foot) >= CLEARANCE:
            return
        flexion, knee = flexion + 8.0, min(knee + 8.0, 120.0)


def move_arms(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Upper arms point anywhere that shoulders allow, elbows straight to fully bent; both alike in every third.

    False if a hand would be below the floor.
    """
    angles = _draw_arm(rng)
    is_even = rng.random() < EVEN_SHARE
    for side in "lr":
        if not is_even:
            angles = _draw_arm(rng)
            if rng.random() < HANGING_SHARE:
                continue
        draft.set(f"{side}_", **angles)
        shape_hand(draft, side, rng)
    hands = np.concatenate([draft.marks.side[side].hand for side in "lr"])
    return draft.lowest(hands) >= 0.0


def _draw_arm(rng: np.random.Generator) -> dict[str, float]:
    """Angles of one arm [degrees]; the shoulder blade follows a raised arm."""
    flexion, abduction = float(rng.uniform(-35, 165)), float(rng.uniform(-5, 90))
    raised = max(flexion, abduction) / 90.0
    return {
        "clavicle_elevation": float(np.clip(10 * (raised - 0.6), 0, 18)),
        "clavicle_protraction": float(rng.uniform(-5, 10)),
        "shoulder_flexion": flexion,
        "shoulder_abduction": abduction,
        "shoulder_rotation": float(rng.uniform(-60, 80)),
        "elbow_flexion": float(rng.beta(0.7, 1.3)) * 130,
        "forearm_pronation": float(rng.uniform(-40, 60)),
        "wrist_flexion": float(rng.normal(0, 15)),
    }
