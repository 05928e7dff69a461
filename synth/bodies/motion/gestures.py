"""Draws gestures: what arms and head do for a while, out of the pose families, free of self-collisions on the way."""

from dataclasses import dataclass

import numpy as np

from synth.bodies.body import Body, Pose
from synth.bodies.motion.overlays import GESTURE_DOFS, Gesture
from synth.bodies.poses import arms
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.draw import draw_arms
from synth.bodies.poses.families import Arms, PoseFamily
from synth.bodies.poses.sit import Sitting
from synth.bodies.poses.stand import stand_upright
from synth.bodies.skeleton import DOF_IDX, N_DOFS

N_TRIES = 3
ON_THE_WAY = 0.012
"""Limbs come into each other by at most this while they move to a gesture [m]."""
MOVING = (0.6, 1.1)
"""Range of the time that it takes to get there [s]."""


@dataclass(frozen=True)
class GestureKind:
    """One way to gesture.

    Attributes:
        name: What it is called.
        weight: How often it is drawn.
        arms: What draws it.
        swing: By hinge without side, how far it swings to and fro [degrees].
        frequency: Range of how often it does [Hz].
        is_for_seated: Whether people who sit do it too.
    """

    name: str
    weight: float
    arms: Arms
    swing: dict[str, float]
    frequency: tuple[float, float] = (0.0, 0.0)
    is_for_seated: bool = True


KINDS: tuple[GestureKind, ...] = (
    GestureKind("wave", 1.0, arms.wave, {"shoulder_rotation": 16.0, "elbow_flexion": 7.0}, (1.2, 1.8)),
    GestureKind("point", 1.0, arms.point_out, {"shoulder_abduction": 3.0}, (0.4, 0.9)),
    GestureKind("reach", 1.5, arms.reach_out, {}),
    GestureKind("phone", 1.0, arms.use_phone, {}),
    GestureKind("hand_at_face", 1.0, arms.hand_to_face, {}),
    GestureKind("arms_crossed", 0.7, arms.cross_arms, {}, is_for_seated=False),
    GestureKind("hands_on_hips", 0.7, arms.hands_to_hips, {}, is_for_seated=False),
    GestureKind("carry", 0.5, arms.carry, {"elbow_flexion": 3.0}, (0.4, 0.8), is_for_seated=False),
)
"""All gestures."""


def draw_gesture(
    body: Body, base: Pose, begin: float, most: float, rng: np.random.Generator, is_seated: bool
) -> tuple[str, Gesture] | None:
    """Draws a gesture.

    Args:
        body: Who makes it.
        base: How they stand or sit, person frame.
        begin: When it begins [s].
        most: How long it may last [s].
        rng: Source of randomness.
        is_seated: Whether they sit.

    Returns:
        Its name and the gesture; None if there is no time for one, or none fits.
    """
    moving = float(rng.uniform(*MOVING))
    if most < 2.0 * moving + 0.3:
        return None
    kinds = [kind for kind in KINDS if kind.is_for_seated or not is_seated]
    weights = np.array([kind.weight for kind in kinds])
    for _ in range(N_TRIES):
        kind = kinds[int(rng.choice(len(kinds), p=weights / weights.sum()))]
        family = PoseFamily(kind.name, "none", 1.0, Sitting() if is_seated else stand_upright, kind.arms)
        pose = draw_arms(family, body, base, rng)
        if pose is None or not _is_free_on_the_way(body, base, pose):
            continue
        swing = np.zeros(N_DOFS)
        for side in "lr":
            own = [DOF_IDX[f"{side}_{name}"] for name in kind.swing]
            moved = [DOF_IDX[f"{side}_shoulder_flexion"], DOF_IDX[f"{side}_elbow_flexion"]]
            if np.abs(pose.angles[moved] - base.angles[moved]).max() > 0.2:
                swing[own] = np.radians(list(kind.swing.values()))
        lasting = float(rng.uniform(2.0 * moving + 0.3, max(min(most, 6.0), 2.0 * moving + 0.31)))
        frequency = float(rng.uniform(*kind.frequency))
        return kind.name, Gesture(begin, begin + lasting, moving, pose.angles, swing, frequency)
    return None


def _is_free_on_the_way(body: Body, base: Pose, pose: Pose) -> bool:
    draft = Draft.of(body, base)
    for share in (0.35, 0.6, 0.85):
        draft.angles = base.angles.copy()
        draft.angles[GESTURE_DOFS] += share * (pose.angles - base.angles)[GESTURE_DOFS]
        if draft.excess() > ON_THE_WAY:
            return False
    return True
