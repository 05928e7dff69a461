"""Puts a body on its itinerary: root, legs from the footfalls, trunk and arms that go with them, sits and gestures."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body, Pose
from synth.bodies.motion.curves import Array, bump, drift, smooth_below, smoothed
from synth.bodies.motion.foot import foot_shapes
from synth.bodies.motion.itinerary import Itinerary
from synth.bodies.motion.legs import LEG_DOFS, solve_legs
from synth.bodies.motion.overlays import (
    ABDUCTIONS,
    ELBOWS,
    HEAD_DOFS,
    ROTATIONS,
    SHOULDERS,
    TRUNK_DOFS,
    Gesture,
    Sit,
)
from synth.bodies.motion.record import Motion
from synth.bodies.motion.steps import FootTrack, track_foot
from synth.bodies.skeleton import DOF_IDX, LOWER, UPPER, Skeleton
from synth.vocabulary import CONTACT_NAMES

STRAIGHT = 0.99
"""Legs reach at most this share of their length: knees are never quite straight."""
HEIGHT_SIGMA = 0.045
"""The hips' height follows what the legs allow within about this time [s]."""
SWAY = 0.022
"""How far the hips are over the foot that carries [m]."""
SWAY_SIGMA = 0.13
"""Within about this time [s]."""
LIST = np.radians(3.0)
"""The pelvis sinks to the side of the foot in the air by this [rad]."""
PELVIS_TURN = 0.16
"""The pelvis turns with the foremost foot, for each metre that it is ahead [rad/m]."""
ARM_SWING = 0.56
"""The arms swing against the feet, for each metre that one foot is ahead of the other [rad/m]."""
ARM_BACK = np.radians(7.0)
"""The middle of the swing is behind where arms hang when standing, by this [rad]."""
ARM_OUT = np.radians(4.0)
"""A walker's arms hang farther out by this [rad]."""
LEAN = np.radians(7.5)
"""A walker's pelvis is bent forward by this at 1.2 m/s, so that the hips reach farther back [rad]."""
LOOK_AHEAD = 0.45
"""The head turns where the body will in so much time [s]."""
MOST_BENT = np.radians(15.0)
"""Heels come up before ankles bend more than this [rad]."""
N_ROLLS = 3
SIT_LEAN = np.radians(27.0)
"""The trunk bends forward by this on the way to a seat and from it, at the hips [rad]."""
ARMS_RAISED = 28.0
"""Shoulders and elbows bend by this more on the way to a seat and from it [degrees]."""
TRUNK_DRIFT = np.radians(0.7)
"""Trunk hinges wander by about this [rad]; the head by twice as much."""


@dataclass
class Plan:
    """What a person does: a way, sits and gestures.

    Attributes:
        body: Who.
        base: How they stand at ease: trunk, head and arms of a standing pose in the person frame.
        way: Where the body goes.
        sits: Times on seats.
        gestures: In order of time.
    """

    body: Body
    base: Pose
    way: Itinerary
    sits: list[Sit] = field(default_factory=list)
    gestures: list[Gesture] = field(default_factory=list)


def composed(plan: Plan, rng: np.random.Generator) -> Motion:
    """The motion of a plan.

    Args:
        plan: What the person does.
        rng: Draws what wanders aimlessly.

    Returns:
        The motion, world frame, at the rate of the plan's way.
    """
    rate = plan.way.rate
    place, heading = np.concatenate(plan.way.places), np.concatenate(plan.way.headings)
    n = len(place)
    seconds = np.arange(n) / rate
    shapes = foot_shapes(plan.body)
    feet = {s: track_foot(shapes[s], plan.way.start[s], plan.way.falls[s], n, rate) for s in "lr"}
    ahead = smoothed(_ahead(feet, place, heading), 0.05, rate)
    carries = smoothed(
        _carries(feet) + 0.5 * drift(n, rate, rng, 0.03, 0.12) * _stands(plan.way, n), SWAY_SIGMA, rate
    )
    speed = smoothed(np.hypot(*np.gradient(place, axis=0).T) * rate, 0.2, rate)
    T_root = _root(plan, place, heading, ahead, carries, speed)
    angles = np.tile(plan.base.angles, (n, 1))
    _set_upper(angles, ahead, carries, speed, heading, rate, rng)
    for sit in plan.sits:
        share = sit.share(seconds)[:, None]
        angles += share * (sit.pose.angles - angles)
        raised = np.radians(ARMS_RAISED) * bump(share)
        angles[:, SHOULDERS] += raised
        angles[:, ELBOWS] += raised
    for gesture in plan.gestures:
        gesture.blend(angles, seconds)
    T_root, feet = _on_legs(plan, T_root, feet, angles, seconds)
    for s in "lr":
        angles[:, DOF_IDX[f"{s}_toes_extension"]] = feet[s].toes()
    angles = np.clip(angles, LOWER, UPPER)
    return Motion(rate, angles, T_root, _contacts(plan, feet, seconds), tuple(plan.way.activity))


def _on_legs(
    plan: Plan, T_root: Array, feet: dict[str, FootTrack], angles: Array, seconds: Array
) -> tuple[Array, dict[str, FootTrack]]:
    """Sets the root's height and the angles of the legs; heels come up where the ankles would bend too far.

    Returns:
        (n, 4, 4) the root, and the feet as they are then.
    """
    flexion = LEG_DOFS["l"].tolist().index(DOF_IDX["l_ankle_flexion"])
    for trial in range(N_ROLLS + 1):
        placed = {s: feet[s].placed() for s in "lr"}
        T = T_root.copy()
        T[:, 2, 3] = smooth_below(heights_allowed(plan.body.skeleton, T, placed), HEIGHT_SIGMA, plan.way.rate)
        for sit in plan.sits:
            _sit_down(T, sit, seconds)
        for s in "lr":
            solved, _ = solve_legs(plan.body.skeleton, s, T, placed[s], is_limited=trial == N_ROLLS)
            angles[:, LEG_DOFS[s]] = solved
            if trial < N_ROLLS:
                feet[s] = feet[s].rolled(np.maximum(solved[:, flexion] - MOST_BENT, 0.0))
    return T, feet


def _ahead(feet: dict[str, FootTrack], place: Array, heading: Array) -> Array:
    """(n, 2) how far the left and the right foot are before the body, along its heading [m]."""
    c, s = np.cos(heading), np.sin(heading)
    ways = [feet[side].footing[:, :2] - place for side in "lr"]
    return np.stack([c * way[:, 0] + s * way[:, 1] for way in ways], axis=1)


def _carries(feet: dict[str, FootTrack]) -> Array:
    """(n,) 1 where the left foot alone carries, -1 where the right one does, 0 where both do."""
    down = {side: feet[side].is_down.any(axis=1) for side in "lr"}
    return np.asarray(down["l"].astype(np.float64) - down["r"].astype(np.float64))


def _stands(way: Itinerary, n: int) -> Array:
    """(n,) 1 while the person stands, 0 while they go."""
    return np.array([float(name not in ("walk", "turn")) for name in way.activity])


def _root(plan: Plan, place: Array, heading: Array, ahead: Array, carries: Array, speed: Array) -> Array:
    """(n, 4, 4) the root over the way, its height still missing."""
    yaw = heading - PELVIS_TURN * (ahead[:, 0] - ahead[:, 1])
    base = plan.base.T_world_root
    pitch = float(np.arcsin(-base[2, 0])) + LEAN * np.minimum(speed / 1.2, 1.3)
    roll = LIST * carries * np.minimum(speed / 0.8, 1.0)
    T = np.tile(np.eye(4), (len(place), 1, 1))
    T[:, :3, :3] = turns(yaw, pitch, roll)
    side = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    T[:, :2, 3] = place + SWAY * carries[:, None] * side
    return T


def turns(yaw: Array, pitch: Array, roll: Array) -> Array:
    """(n, 3, 3) rotations: turned left, bent forward, leaning to the right."""
    cy, sy, cp, sp, cr, sr = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    return np.stack(
        [
            np.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], axis=-1),
            np.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], axis=-1),
            np.stack([-sp, cp * sr, cp * cr], axis=-1),
        ],
        axis=-2,
    )


def _set_upper(
    angles: Array,
    ahead: Array,
    carries: Array,
    speed: Array,
    heading: Array,
    rate: float,
    rng: np.random.Generator,
) -> None:
    """Trunk, head and arms that go with the legs."""
    n = len(angles)
    stride = ahead[:, 0] - ahead[:, 1]
    twist = PELVIS_TURN * stride
    moving = np.minimum(speed / 0.8, 1.0)
    for k in TRUNK_DOFS:
        angles[:, k] += TRUNK_DRIFT * drift(n, rate, rng)
    for k in HEAD_DOFS:
        angles[:, k] += 2.0 * TRUNK_DRIFT * drift(n, rate, rng)
    # The trunk makes up for the pelvis: it stays upright, and the shoulders turn against the hips.
    angles[:, DOF_IDX["lumbar_rotation"]] += 0.6 * twist
    angles[:, DOF_IDX["thorax_rotation"]] += 1.2 * twist
    angles[:, DOF_IDX["lumbar_lateral"]] -= 0.7 * LIST * carries * moving
    angles[:, DOF_IDX["lumbar_flexion"]] -= 0.55 * LEAN * np.minimum(speed / 1.2, 1.3)
    angles[:, DOF_IDX["neck_rotation"]] -= 0.4 * twist
    angles[:, DOF_IDX["head_rotation"]] -= 0.4 * twist
    later = np.minimum(np.arange(n) + round(LOOK_AHEAD * rate), n - 1)
    look = smoothed(np.clip(heading[later] - heading, -0.8, 0.8), 0.12, rate)
    for name, share in (("thorax_rotation", 0.2), ("neck_rotation", 0.35), ("head_rotation", 0.35)):
        angles[:, DOF_IDX[name]] += share * look
    swing = smoothed(ARM_SWING * stride, 0.04, rate)
    for k, way in ((0, -swing), (1, swing)):
        angles[:, SHOULDERS[k]] += way - ARM_BACK * moving
        bend = 0.275 * (way + np.sqrt(way**2 + 0.01)) + 0.1 * moving
        angles[:, ELBOWS[k]] += bend
        angles[:, ABDUCTIONS[k]] += ARM_OUT * moving
        angles[:, ROTATIONS[k]] -= 0.8 * bend


def heights_allowed(skeleton: Skeleton, T_root: Array, placed: dict[str, Array]) -> Array:
    """(n,) greatest height of the root at which both feet reach where they are [m].

    Args:
        skeleton: The person's hinges.
        T_root: (n, 4, 4) the root over the floor; its height does not matter.
        placed: (n, 4, 4) of the links behind the ankles, by side.
    """
    most = np.full(len(T_root), np.inf)
    for s in "lr":
        dofs = LEG_DOFS[s]
        hip = T_root[:, :3, :3] @ skeleton.offsets[dofs[0]]
        length = STRAIGHT * -float(skeleton.offsets[dofs[3]][2] + skeleton.offsets[dofs[4]][2])
        ankle = placed[s][:, :3, 3]
        aside = (ankle[:, :2] - T_root[:, :2, 3] - hip[:, :2]) ** 2
        most = np.minimum(most, ankle[:, 2] + np.sqrt(np.maximum(length**2 - aside.sum(axis=1), 0.01)) - hip[:, 2])
    return most


def _sit_down(T_root: Array, sit: Sit, seconds: Array) -> None:
    """Moves the root onto a seat and off it: back first, then down, the trunk bent forward on the way."""
    share = sit.share(seconds)
    is_any = share > 0.0
    u, T = share[is_any], T_root[is_any]
    goal = sit.pose.T_world_root
    T[:, :2, 3] += (u**0.85)[:, None] * (goal[:2, 3] - T[:, :2, 3])
    T[:, 2, 3] += (u**1.25) * (goal[2, 3] - T[:, 2, 3])
    yaw, pitch, roll = angles_of(T[:, :3, :3])
    to = angles_of(goal[None, :3, :3])
    yaw += u * (np.remainder(to[0] - yaw + np.pi, 2.0 * np.pi) - np.pi)
    pitch += u * (to[1] - pitch) + SIT_LEAN * bump(u)
    roll += u * (to[2] - roll)
    T[:, :3, :3] = turns(yaw, pitch, roll)
    T_root[is_any] = T


def angles_of(R: Array) -> tuple[Array, Array, Array]:
    """Undoes `turns`."""
    return (
        np.arctan2(R[:, 1, 0], R[:, 0, 0]),
        np.arcsin(np.clip(-R[:, 2, 0], -1.0, 1.0)),
        np.arctan2(R[:, 2, 1], R[:, 2, 2]),
    )


def _contacts(plan: Plan, feet: dict[str, FootTrack], seconds: Array) -> NDArray[np.bool_]:
    """(n, n_contacts) bool."""
    out = np.zeros((len(seconds), len(CONTACT_NAMES)), np.bool_)
    for k, s in enumerate("lr"):
        out[:, 2 * k : 2 * k + 2] = feet[s].is_down
    for sit in plan.sits:
        out[:, CONTACT_NAMES.index("seat")] |= sit.sits(seconds)
    return out
