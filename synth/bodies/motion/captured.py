"""Puts a recorded motion on a body of any size: the hips go as recorded, feet that are down stay where they are."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body
from synth.bodies.mocap.capture import RecordedMotion, runs
from synth.bodies.motion.compose import MOST_BENT, N_ROLLS, angles_of, heights_allowed, turns
from synth.bodies.motion.curves import Array, bump, smooth_below, smoothed
from synth.bodies.motion.foot import FootShape, foot_shapes
from synth.bodies.motion.legs import LEG_DOFS, solve_legs
from synth.bodies.motion.overlays import ABDUCTIONS
from synth.bodies.motion.record import Motion
from synth.bodies.motion.steps import FootTrack
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, UPPER
from synth.vocabulary import CONTACT_NAMES

SMOOTHING = 0.03
"""Angles that were found frame by frame are smoothed over time by this [s]."""
HEIGHT_SIGMA = 0.04
"""The hips' height follows what the legs allow within about this time [s]."""
LEVEL = np.radians(5.0)
"""A foot pitched less than this stands flat; what markers say is no better."""
MOST_MISSED = 0.01
"""Feet of a motion that fits a body are nearer to their places than this, 98 times of 100 [m]."""
STAYS = (0.06, np.radians(18.0))
"""A foot that touches the floor and is farther than this from where it began to stand has been moved [m, rad]."""
MOVED_SECONDS = 0.1
"""It takes so long before and after that."""
MOVED_LIFT = 0.008
"""Such feet are lifted by this [m]."""
STANDS = 0.003
"""A foot that a limit holds farther than this from its place does not count as standing there [m]."""
ARMS_OUT = np.radians((0.0, 4.0, 8.0, 12.0))
"""Arms are held farther out by one of these, the first that keeps them out of the body [rad]."""
USUAL_EXCESS, MOST_EXCESS = 0.03, 0.06
"""Limbs are in each other by no more, nine times of ten and ever [m]."""
MOST_BELOW = 0.02
"""No skin is farther below the floor [m]."""
CHECKED_EVERY = 0.25
"""It is looked whether they are so often [s]."""


def captured(motion: RecordedMotion, body: Body, rate: float, activity: str = "recorded") -> Motion | None:
    """A recorded motion on a body, where it began at the origin with the body facing x.

    Lengths of the way are in proportion to the legs. Each foot is turned into a track like those of walkers: while heel
    or toes are down, its footing is one place and it rolls about what is down; in the air it moves as recorded,
    shifted so that it leaves and lands where it stands. The hips are as high as recorded, or as the legs allow.

    Args:
        motion: What was recorded.
        body: Who makes it.
        rate: Samples a second.
        activity: What it is called.

    Returns:
        The motion; None if the body's feet do not reach where they should, or limbs go through each other or the floor.
    """
    n = int(np.floor(motion.seconds * rate + 1e-6)) + 1
    at = np.minimum(np.arange(n) * (motion.fps / rate), len(motion.angles) - 1)
    angles = _sampled(motion.angles.astype(np.float64), at, rate)
    T_root = _root(motion, body, at, rate)
    touch = motion.contacts[np.rint(at).astype(int)]
    feet = _feet(body, angles, T_root, touch, rate)
    recorded_height = T_root[:, 2, 3].copy()
    missed = np.zeros((2, n))
    for trial in range(N_ROLLS + 1):
        placed = {s: feet[s].placed() for s in "lr"}
        allowed = heights_allowed(body.skeleton, T_root, placed)
        T_root[:, 2, 3] = smooth_below(np.minimum(allowed, recorded_height), HEIGHT_SIGMA, rate)
        for k, s in enumerate("lr"):
            solved, missed[k] = solve_legs(body.skeleton, s, T_root, placed[s], is_limited=trial == N_ROLLS)
            angles[:, LEG_DOFS[s]] = solved
            flexion = solved[:, LEG_DOFS[s].tolist().index(DOF_IDX[f"{s}_ankle_flexion"])]
            if trial < N_ROLLS:
                feet[s] = feet[s].rolled(np.maximum(flexion - MOST_BENT, 0.0))
    for s in "lr":
        angles[:, DOF_IDX[f"{s}_toes_extension"]] = feet[s].toes()
    angles = np.clip(angles, LOWER, UPPER)
    contacts = np.zeros((n, len(CONTACT_NAMES)), np.bool_)
    contacts[:, :4] = np.concatenate(
        [feet[s].is_down & (missed[k, :, None] < STANDS) for k, s in enumerate("lr")], axis=1
    )
    if float(np.percentile(missed, 98.0)) > MOST_MISSED:
        return None
    made = Motion(rate, angles, T_root, contacts, (activity,) * n)
    return _with_free_arms(made, body) if _is_above_floor(made, body) else None


def _sampled(values: Array, at: Array, rate: float) -> Array:
    """(n, m) values between frames, smoothed over time."""
    frames = np.arange(len(values))
    between = np.stack([np.interp(at, frames, column) for column in values.T], axis=1)
    return smoothed(between, SMOOTHING, rate)


def _root(motion: RecordedMotion, body: Body, at: Array, rate: float) -> Array:
    """(n, 4, 4) the root as recorded, in proportion to the body's legs."""
    yaw, pitch, roll = angles_of(motion.root.astype(np.float64))
    turned = np.stack([np.unwrap(yaw) - yaw[0], pitch, roll], axis=1)
    c, s = np.cos(yaw[0]), np.sin(yaw[0])
    hips = motion.hips.astype(np.float64) - motion.hips[0] * (1.0, 1.0, 0.0)
    hips[:, :2] = hips[:, :2] @ np.array([[c, -s], [s, c]])
    places = _sampled(hips * landmarks_of(body).leg, at, rate)
    T = np.tile(np.eye(4), (len(at), 1, 1))
    T[:, :3, :3] = turns(*_sampled(turned, at, rate).T)
    middle = np.mean([body.skeleton.offsets[DOF_IDX[f"{s}_hip_flexion"]] for s in "lr"], axis=0)
    T[:, :3, 3] = places - T[:, :3, :3] @ middle
    return T


def _feet(body: Body, angles: Array, T_root: Array, touch: NDArray[np.bool_], rate: float) -> dict[str, FootTrack]:
    """Both feet as the recorded angles place them, on the floor where they touch it."""
    links = np.array([link_transforms(body.skeleton, a, T) for a, T in zip(angles, T_root, strict=True)])
    shapes = foot_shapes(body)
    return {
        s: _foot(shapes[s], links[:, LINK_IDX[f"{s}_ankle_inversion"]], touch[:, k], rate)
        for k, s in enumerate("lr")
    }


def _foot(shape: FootShape, T: Array, touch: NDArray[np.bool_], rate: float) -> FootTrack:
    """A foot's track.

    Args:
        shape: The foot.
        T: (n, 4, 4) where the recorded angles place the link behind the ankle, world.
        touch: (n, 2) whether heel and toes are down.
        rate: Samples a second.
    """
    n = len(T)
    pitch = np.arcsin(np.clip(-T[:, 2, 0], -1.0, 1.0))
    pitch = smoothed(np.sign(pitch) * np.maximum(np.abs(pitch) - LEVEL, 0.0), SMOOTHING, rate)
    heading = np.unwrap(np.arctan2(T[:, 1, 0], T[:, 0, 0]))
    rolled = shape.placed(np.zeros((n, 3)), pitch, shape.lift_at(pitch))
    c, s = np.cos(heading), np.sin(heading)
    footing = np.stack([T[:, 0, 3] - c * rolled[:, 0, 3], T[:, 1, 3] - s * rolled[:, 0, 3], heading], axis=1)
    high = T[:, 2, 3] - rolled[:, 2, 3]
    wanted = np.concatenate([footing, high[:, None]], axis=1)
    swing, shift = np.full(n, -1.0), np.full((n, 4), np.nan)
    is_down = np.zeros(n, np.bool_)
    for first, last in _standing(footing, np.asarray(touch.any(axis=1)), rate):
        own = slice(first, last)
        is_down[own] = True
        shift[own] = np.append(np.median(footing[own], axis=0), 0.0) - wanted[own]
    if not is_down.any():
        shift[:] = 0.0
    at, known = np.arange(n), np.flatnonzero(np.isfinite(shift[:, 0]))
    shift = np.stack([np.interp(at, known, column[known]) for column in shift.T], axis=1)
    lift = np.zeros(n)
    for first, last in runs(~is_down):
        swing[first:last] = (np.arange(first, last) - first + 1.0) / (last - first + 1.0)
        lift[first:last] = MOVED_LIFT * bump(swing[first:last])
    wanted += shift
    clearance = np.maximum(wanted[:, 3], lift) * ~is_down
    return FootTrack(shape, wanted[:, :3], pitch, swing, smoothed(clearance, SMOOTHING / 2.0, rate), rate)


def _standing(footing: Array, touch: NDArray[np.bool_], rate: float) -> list[tuple[int, int]]:
    """Stretches of time in which a foot stands at one place: first sample and one after the last.

    Args:
        footing: (n, 3) x, y [m] and heading [rad].
        touch: (n,) whether the foot touches the floor.
        rate: Samples a second.
    """
    pause = round(MOVED_SECONDS * rate)
    out = []
    for first, last in runs(touch):
        begin = first
        while begin < last:
            way = footing[begin:last] - footing[begin]
            is_away = (np.hypot(way[:, 0], way[:, 1]) > STAYS[0]) | (np.abs(way[:, 2]) > STAYS[1])
            away = np.flatnonzero(is_away)
            end = last if not len(away) else begin + max(int(away[0]) - pause, 1)
            out.append((begin, end))
            begin = last if not len(away) else begin + int(away[0]) + pause
    return out


def _checked(motion: Motion) -> range:
    """Samples at which a motion is checked."""
    return range(0, len(motion), max(1, round(CHECKED_EVERY * motion.rate)))


def _is_above_floor(motion: Motion, body: Body) -> bool:
    return all(float(pose_vertices(body, motion.pose(k))[:, 2].min()) >= -MOST_BELOW for k in _checked(motion))


def _with_free_arms(motion: Motion, body: Body) -> Motion | None:
    """The motion with its arms as far out as keeps limbs out of each other; None if nothing does."""
    for out in ARMS_OUT:
        angles = motion.angles.copy()
        angles[:, ABDUCTIONS] = np.minimum(angles[:, ABDUCTIONS] + out, UPPER[ABDUCTIONS])
        moved = replace(motion, angles=angles)
        excess = [Draft.of(body, moved.pose(k)).excess() for k in _checked(moved)]
        if max(excess) <= MOST_EXCESS and np.percentile(excess, 90.0) <= USUAL_EXCESS:
            return moved
    return None
