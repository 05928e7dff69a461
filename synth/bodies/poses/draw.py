"""Procedural poses: a base (trunk, head, legs, relaxed arms) and then the arms for what the scene offers.

Person frame: the root stands over x = y = 0 and faces +x, y to the person's left, the floor is z = 0.
"""

import numpy as np

from synth.bodies.body import Body, Pose
from synth.bodies.poses.arms import cross_arms
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.families import PoseFamily, family_named
from synth.bodies.poses.hands import HandTargets
from synth.bodies.poses.lap import lay_hands_in_lap, relax_seated_arms
from synth.bodies.poses.recorded import Recorded, pose_as_recorded
from synth.bodies.poses.sit import Sitting, seat_height_of, sit
from synth.bodies.poses.stand import hang_arm, stand_upright
from synth.bodies.rig.collision import self_collides

N_BASE_TRIES = 6
N_ARM_TRIES = 8
N_RECORDED_TRIES = 12
"""Draws from the model of recorded life before a plain pose is taken."""
N_CROSSED_TRIES = 4
"""Tries at crossed arms for hands that find no room on the lap."""
SEAT_HEIGHTS = (0.05, 1.5)
"""Lowest and highest seat that people are drawn on [m]."""


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

    Raises:
        ValueError: The family is unknown, or the seat is not one that its people sit on.
    """
    kind = family_named(family) if isinstance(family, str) else family
    height = _checked_seat(kind, body, seat_height)
    if isinstance(kind.base, Recorded):
        return _recorded_base(kind, kind.base, body, rng, height)
    for attempt in range(N_BASE_TRIES):
        draft = Draft(body)
        _set_base(draft, rng, 1.0 - attempt / N_BASE_TRIES, kind, height)
        pose = draft.pose(kind.name)
        # Arms that a table or a keyboard will move anyway may touch the lap.
        excess = draft.excess() if kind.context in ("none", "stroller") else _legs_excess(draft)
        if excess <= 0.0:
            break
    return pose


def _recorded_base(
    kind: PoseFamily, base: Recorded, body: Body, rng: np.random.Generator, seat_height: float
) -> Pose:
    """A pose out of the model, or a plain one with relaxed arms if none of the draws can be put down."""
    seat = seat_height if base.posture == "sitting" else None
    for attempt in range(N_RECORDED_TRIES):
        draft = Draft(body)
        is_placed = pose_as_recorded(draft, rng, 1.0 - 0.7 * attempt / N_RECORDED_TRIES, base, seat)
        if is_placed and draft.excess() <= 0.0:
            return draft.pose(kind.name)
    plain = PoseFamily(kind.name, "none", 1.0, Sitting() if seat else stand_upright, kind.arms)
    return draw_base(plain, body, rng, seat)


def _checked_seat(kind: PoseFamily, body: Body, seat_height: float | None) -> float:
    """The seat's height; the one that fits the legs where none is given [m]."""
    if kind.posture == "standing" and seat_height is not None:
        raise ValueError(f"family {kind.name!r} stands, but seat_height={seat_height} was given")
    height = seat_height_of(body) if seat_height is None else seat_height
    if not SEAT_HEIGHTS[0] <= height <= SEAT_HEIGHTS[1]:
        raise ValueError(f"seat_height={height} must be in [{SEAT_HEIGHTS[0]}, {SEAT_HEIGHTS[1]}] m")
    return height


def _set_base(draft: Draft, rng: np.random.Generator, wild: float, kind: PoseFamily, seat_height: float) -> None:
    assert not isinstance(kind.base, Recorded)
    if not isinstance(kind.base, Sitting):
        kind.base(draft, rng, wild)
        for side in "lr":
            hang_arm(draft, side, rng, wild)
        return
    sit(draft, rng, wild, kind.base, seat_height)
    if kind.context == "none":
        relax_seated_arms(draft, rng, wild)
        _keep_arms_off_a_taken_lap(draft, rng)
    else:
        lay_hands_in_lap(draft, rng)


def _legs_excess(draft: Draft) -> float:
    return max(draft.excess_of(side, "leg") for side in "lr")


def _keep_arms_off_a_taken_lap(draft: Draft, rng: np.random.Generator) -> None:
    """Crosses the arms of a seated person whose hands find no room on the lap."""
    for _ in range(N_CROSSED_TRIES):
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

    Raises:
        ValueError: The family is unknown, or the targets do not hold what its hands touch.
    """
    kind = family_named(family) if isinstance(family, str) else family
    for _ in range(N_ARM_TRIES):
        draft = Draft.of(body, base)
        if not kind.arms(draft, rng, targets):
            continue
        pose = draft.pose(kind.name)
        if not self_collides(body, pose):
            return pose
    return None
