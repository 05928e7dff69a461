"""Hands of a seated person on the own thighs or belly."""

import numpy as np

from synth.bodies.poses.draft import Draft
from synth.bodies.poses.hands import place_hand
from synth.bodies.poses.stand import SIGN, curl_fingers


def rest_on_thigh(
    draft: Draft,
    side: str,
    rng: np.random.Generator,
    share: float,
    spread: tuple[float, float] = (0.1, 0.5),
    swivels: bool = True,
) -> bool:
    """Lays a palm on the own thigh.

    Args:
        draft: Changed in place.
        side: "l" or "r".
        rng: Random draws.
        share: Where on the thigh, 0 at the hip, 1 at the knee.
        spread: Range of how far inward the fingers point, as a slope.
        swivels: Whether the elbow may be turned out of a collision.

    Returns:
        Whether the arm reached.
    """
    turn = -SIGN[side] * float(rng.uniform(-15, 25))
    target, normal = draft.surface(f"{side}_thigh", f"{side}_hip_rotation", 1.0 - share, turn)
    inward = -SIGN[side] * float(rng.uniform(*spread))
    draft.set(
        f"{side}_",
        shoulder_flexion=20,
        shoulder_abduction=float(rng.uniform(8, 25)),
        shoulder_rotation=20,
        elbow_flexion=60,
        forearm_pronation=50,
        wrist_flexion=0,
    )
    curl_fingers(draft, side, rng, 8, 10)
    fingers = (1.0, inward, -0.15)
    solution = place_hand(
        draft, side, target + 0.012 * normal, -normal, fingers, palm_weight=0.12, swivels=swivels
    )
    return solution.point_error < 0.015


def lay_hands_in_lap(draft: Draft, rng: np.random.Generator) -> None:
    """Lays the hands on the thighs without looking for a better place, for arms that will be moved."""
    share = float(rng.uniform(0.5, 0.8))
    for side in "lr":
        rest_on_thigh(draft, side, rng, share, swivels=False)


def relax_seated_arms(draft: Draft, rng: np.random.Generator, wild: float) -> None:
    """Lays the hands on the thighs, in the lap or near the knees; nearer the knees where the lap is taken."""
    common = float(rng.uniform(0.45, 0.85))
    for side in "lr":
        own = common + 0.05 * wild * float(rng.normal())
        for share, inward in ((own, 0.5), (0.75, 0.0), (0.6, -0.2)):
            reached = rest_on_thigh(draft, side, rng, share, (inward - 0.4, inward))
            if reached and draft.excess_of(side, "arm") <= 0.0:
                break
        else:
            _rest_on_belly(draft, side)


def _rest_on_belly(draft: Draft, side: str) -> None:
    """Lays a palm on the belly, for a lap that is taken."""
    target, normal = draft.surface("abdomen", "lumbar_rotation", 0.7, SIGN[side] * 25)
    draft.set(f"{side}_", shoulder_flexion=5, shoulder_abduction=22, shoulder_rotation=45, elbow_flexion=80)
    place_hand(draft, side, target + 0.02 * normal, -normal, (0.1, -SIGN[side], -0.1))
