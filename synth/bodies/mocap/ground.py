"""What carries a captured person: floor level, feet on it, standing or sitting."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.rest import SIDES
from synth.bodies.mocap.retarget import heading_of
from synth.bodies.mocap.source import Source

HEEL = (-0.05, 0.12)
"""Heel and ball of the foot before the ankle, along the sole [m]."""
STILL = 0.15
"""A foot slower than this stands [m/s]."""
ON_FLOOR = 0.035
"""A foot no higher than this stands on the floor [m]."""
FLAT = np.radians(15.0)
"""A sole tilted less than this stands flat."""
SEATED_SPEED = 0.35
"""Hips of people who sit are slower than this [m/s]."""
SEATED_FLEXION = np.radians(40.0)
"""Thighs of people who sit lie at least this far from upright."""
STEADY = 0.05
"""Thighs raised like that with the centre of mass less than this before the heels: on the way to a seat [m]."""
UNEVEN = 0.06
"""Floor levels under the two feet that differ by less than this are one floor, measured badly [m]."""
# Masses over the body's and where they are along the segment, after Winter (2009, table 4.1).
_MASSES = (
    ("hips_neck", 0.497, 0.5), ("head", 0.081, 0.0), ("shoulder_elbow", 0.028, 0.436), ("elbow_wrist", 0.022, 0.6),
    ("hip_knee", 0.100, 0.433), ("knee_ankle", 0.0465, 0.433), ("ankle_toe", 0.0145, 0.5),
)  # fmt: skip


@dataclass(frozen=True)
class Support:
    """What carries the person, frame by frame.

    Attributes:
        is_standing: (n,) on a foot or two.
        is_sitting: (n,) on a seat.
        is_down: (n, 2) by side: the foot is on the floor.
        is_flat: (n, 2) and its sole is level.
    """

    is_standing: NDArray[np.bool_]
    is_sitting: NDArray[np.bool_]
    is_down: NDArray[np.bool_]
    is_flat: NDArray[np.bool_]


def find_support(source: Source, frame_time: float) -> Support:
    """Tells standing, sitting and neither (in the air, on the way to a seat) apart.

    A person sits whose hips rest, whose thighs are raised and who would fall backwards on the feet alone.

    Args:
        source: The motion.
        frame_time: [s].
    """
    heights, tilt = _foot_heights(source)
    foot_speed = np.stack([_speed(source.at(f"{s}_ankle"), frame_time) for s in SIDES], axis=1)
    stands = (foot_speed < STILL) & ~source.is_t_pose[:, None]
    is_down = heights < _floors(heights, stands) + ON_FLOOR
    hips = 0.5 * (source.at("l_hip") + source.at("r_hip"))
    flexion = np.arccos(np.clip(-source.limb[:, :, 2, 2], -1.0, 1.0)).mean(axis=1)
    balance = np.where(is_down.any(axis=1), _balance(source, is_down), -np.inf)
    is_raised = flexion > SEATED_FLEXION
    is_sitting = is_raised & (balance < 0.0) & (_speed(hips, frame_time) < SEATED_SPEED)
    is_standing = is_down.any(axis=1) & ~(is_raised & (balance < STEADY))
    return Support(is_standing, is_sitting, is_down, is_down & (tilt < FLAT))


def _floors(heights: NDArray[np.float64], stands: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(2,) level of the floor under each foot: low among the heights at which it stands still [m]."""
    own = [h[s] if s.any() else h for h, s in zip(heights.T, stands.T, strict=True)]
    levels = np.array([np.percentile(h, 10.0) for h in own])
    return levels if np.ptp(levels) < UNEVEN else np.full(2, levels.min())


def _foot_heights(source: Source) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n, 2) height of the lower of heel and ball, up to a constant [m], and tilt of the sole [rad]."""
    ankles = np.stack([source.at(f"{s}_ankle")[:, 2] for s in SIDES], axis=1)
    low = np.minimum(HEEL[0] * source.toes[:, :, 2], HEEL[1] * source.toes[:, :, 2])
    drop = 0.07 * source.sole[:, :, 2]
    return ankles + low - drop, np.arccos(np.clip(source.sole[:, :, 2], -1.0, 1.0))


def _speed(points: NDArray[np.float64], frame_time: float) -> NDArray[np.float64]:
    """(n,) [m/s] over two frames on either side."""
    if len(points) < 2:
        return np.zeros(len(points))
    before = np.maximum(np.arange(len(points)) - 2, 0)
    after = np.minimum(np.arange(len(points)) + 2, len(points) - 1)
    way = np.linalg.norm(points[after] - points[before], axis=1)
    return way / (np.maximum(after - before, 1) * frame_time)


def _balance(source: Source, is_down: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(n,) how far the centre of mass is before the rear heel that is on the floor, along the heading [m]."""
    heading = heading_of(source.pelvis)
    ahead = np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1)
    heels = np.stack([source.at(f"{s}_ankle") + HEEL[0] * source.toes[:, k] for k, s in enumerate(SIDES)], axis=1)
    rear = np.where(is_down, np.einsum("nsk,nk->ns", heels, ahead), np.inf).min(axis=1)
    return (centre_of_mass(source) * ahead).sum(axis=1) - rear


def centre_of_mass(source: Source) -> NDArray[np.float64]:
    """(n, 3) centre of mass, world [m]."""
    hips = 0.5 * (source.at("l_hip") + source.at("r_hip"))
    total = np.zeros_like(hips)
    for name, mass, share in _MASSES:
        if name == "hips_neck":
            total += mass * ((1.0 - share) * hips + share * source.at("neck"))
        elif name == "head":
            total += mass * source.at("head")
        else:
            start, end = name.split("_")
            for s in SIDES:
                total += mass * ((1.0 - share) * source.at(f"{s}_{start}") + share * source.at(f"{s}_{end}"))
    return total
