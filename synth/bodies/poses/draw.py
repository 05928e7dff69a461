"""Procedural poses: a base (trunk, head, legs, relaxed arms) and then the arms for what the scene offers.

Person frame: the root stands over x = y = 0 and faces +x, y to the person's left, the floor is z = 0.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body, Pose
from synth.bodies.poses.arms import (
    bend_arms,
    carry,
    cross_arms,
    hand_to_face,
    hands_to_hips,
    keep_relaxed,
    point_out,
    reach_out,
    sit_idle,
    sit_leaning,
    stand_idle,
    use_phone,
    wave,
)
from synth.bodies.poses.draft import SEAT_DEPTH_SHARE, Draft, landmarks_of
from synth.bodies.poses.exercise import move_arms, stand_exercising
from synth.bodies.poses.families import FAMILIES, PoseFamily, family_named
from synth.bodies.poses.hands import HandTarget, HandTargets
from synth.bodies.poses.sit import lay_hands_in_lap, relax_seated_arms, seat_skin, sit
from synth.bodies.poses.stand import hang_arm, stand_bent, stand_leaning_to_push, stand_upright, walk
from synth.bodies.poses.table import (
    drink,
    eat,
    elbows_on_table,
    hands_on_table,
    push_both,
    push_one,
    type_keys,
    write,
)
from synth.bodies.rig.collision import SEGMENT_IDX, fit_of, self_collides

N_BASE_TRIES = 6
N_ARM_TRIES = 8

_BASES: dict[str, Callable[[Draft, np.random.Generator, float], None]] = {
    "walking": walk,
    "bending": stand_bent,
    "exercising": stand_exercising,
    "pushing_both_hands": stand_leaning_to_push,
    "pushing_one_hand": stand_leaning_to_push,
}
_ARMS: dict[str, Callable[[Draft, np.random.Generator, HandTargets | None], bool]] = {
    "standing": stand_idle,
    "walking": keep_relaxed,
    "bending": bend_arms,
    "reaching": reach_out,
    "arms_crossed": cross_arms,
    "hands_on_hips": hands_to_hips,
    "hand_at_face": hand_to_face,
    "phone": use_phone,
    "carrying": carry,
    "pointing": point_out,
    "waving": wave,
    "exercising": move_arms,
    "sitting_feet_down": sit_idle,
    "sitting_legs_crossed": sit_idle,
    "sitting_leaning": sit_leaning,
    "sitting_slouching": sit_idle,
    "table_hands": hands_on_table,
    "table_elbows": elbows_on_table,
    "table_writing": write,
    "table_eating": eat,
    "table_drinking": drink,
    "typing_table": type_keys,
    "typing_lap": type_keys,
    "pushing_both_hands": push_both,
    "pushing_one_hand": push_one,
}


def seat_height_of(body: Body) -> float:
    """Seat height on which the body's thighs are level with the feet flat: about its knee height [m]."""
    marks = landmarks_of(body)
    thigh = fit_of(body).profiles.radius[SEGMENT_IDX["l_thigh"]]
    return marks.leg - marks.thigh - float(thigh[round(0.75 * (len(thigh) - 1))].mean())


def seat_depth_of(body: Body) -> float:
    """How far in front of the root the seat may reach without touching the calves [m]."""
    return SEAT_DEPTH_SHARE * landmarks_of(body).thigh


def draw_base(
    family: str | PoseFamily, body: Body, rng: np.random.Generator, seat_height: float | None = None
) -> Pose:
    """Draws trunk, head, legs and relaxed arms.

    Standing: the lowest skin is at z = 0. Sitting: the lowest skin of buttocks and thighs over the seat is at
    seat_height. Draws whose limbs collide are drawn again, each time nearer the plain pose; the last is given out
    as it is, so a caller that must be sure asks `self_collides`.

    Args:
        family: A family or its name.
        body: The person.
        rng: Random draws.
        seat_height: Top of the seat above the floor [m]; sitting families only, by default `seat_height_of`.

    Returns:
        The pose in the person frame.
    """
    kind = family_named(family) if isinstance(family, str) else family
    if kind.posture == "standing" and seat_height is not None:
        raise ValueError(f"family {kind.name!r} stands, but seat_height={seat_height} was given")
    if seat_height is None:
        seat_height = seat_height_of(body)
    if not 0.05 <= seat_height <= 1.5:
        raise ValueError(f"seat_height={seat_height} must be in [0.05, 1.5] m")
    for attempt in range(N_BASE_TRIES):
        wild = 1.0 - attempt / N_BASE_TRIES
        draft = Draft(body)
        if kind.posture == "sitting":
            sit(draft, rng, wild, kind.name, seat_height)
            if kind.context == "none":
                relax_seated_arms(draft, rng, wild)
                _keep_arms_off_a_taken_lap(draft, rng)
            else:
                lay_hands_in_lap(draft, rng)
        else:
            _BASES.get(kind.name, stand_upright)(draft, rng, wild)
            for side in "lr":
                hang_arm(draft, side, rng, wild)
        pose = draft.pose(kind.name)
        # Arms that a table or a keyboard will move anyway may touch the lap.
        excess = draft.excess() if kind.context in ("none", "stroller") else _legs_excess(draft)
        if excess <= 0.0:
            break
    return pose


def _legs_excess(draft: Draft) -> float:
    return max(draft.excess_of(side, "leg") for side in "lr")


def _keep_arms_off_a_taken_lap(draft: Draft, rng: np.random.Generator) -> None:
    """Crosses the arms of a seated person whose hands find no room on the lap."""
    for _ in range(4):
        if draft.excess() <= 0.0:
            return
        cross_arms(draft, rng, None)


def draw_arms(
    family: str | PoseFamily,
    body: Body,
    base: Pose,
    rng: np.random.Generator,
    targets: HandTargets | None = None,
) -> Pose | None:
    """Solves the arms of a family on top of a base, free of self-collisions.

    Args:
        family: A family or its name.
        body: The person.
        base: From `draw_base` for the same family and body, still in the person frame.
        rng: Random draws.
        targets: What the scene offers the hands, person frame; needed by the families with a context.

    Returns:
        The finished pose, or None if the hands do not reach their targets without a collision.
    """
    kind = family_named(family) if isinstance(family, str) else family
    for _ in range(N_ARM_TRIES):
        draft = Draft.of(body, base)
        if not _ARMS[kind.name](draft, rng, targets):
            continue
        pose = draft.pose(kind.name)
        if not self_collides(body, pose):
            return pose
    return None


def seat_contact(body: Body, pose: Pose) -> NDArray[np.float64]:
    """Where a seated body touches its seat.

    Args:
        body: The person.
        pose: A sitting pose in the person frame.

    Returns:
        (3,) middle of the skin within 1 cm of the lowest, with the lowest z: the height of the seat [m].
    """
    skin = seat_skin(Draft.of(body, pose))
    low = float(skin[:, 2].min())
    touching = skin[skin[:, 2] < low + 0.01]
    x, y, _ = touching.mean(axis=0)
    return np.array([x, y, low])


__all__ = [
    "FAMILIES", "HandTarget", "HandTargets", "draw_arms", "draw_base", "seat_contact", "seat_depth_of",
    "seat_height_of",
]  # fmt: skip
