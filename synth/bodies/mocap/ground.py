"""What carries a captured person: floor level, feet on it, standing or sitting."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.rest import SIDES
from synth.bodies.mocap.retarget import heading_of
from synth.bodies.mocap.seats import resting, seat_like
from synth.bodies.mocap.source import Source

HEEL = (-0.05, 0.12)
"""Heel and ball of the foot before the ankle, along the sole [m]."""
STILL = 0.15
"""A foot slower than this stands [m/s]."""
ALONG = 0.4
"""What of a foot is on the floor and moves no faster than this stands there, while the foot may roll [m/s]."""
ON_FLOOR = 0.035
"""A foot no higher than this stands on the floor [m]."""
FLAT = np.radians(15.0)
"""A sole tilted less than this stands flat."""
RAISED = np.radians(40.0)
"""Thighs that are on average this far from hanging straight down are raised."""
STEADY = 0.05
"""Thighs raised with the centre of mass less than this before the heels: on the way to a seat [m]."""
UNEVEN = 0.06
"""Floor levels under the two feet that differ by less than this are one floor, measured badly [m]."""
LOW_HIPS = 0.2
"""Hip joints lower than this above the floor lie or sit on it [m]."""
LOW_KNEE = 0.14
"""A knee lower than this kneels [m]."""
LOW_ELBOW = 0.12
LOW_NECK = 0.3
LOW_WRIST = 0.2
"""Wrists lower than this with the centre of mass more than `ON_HANDS` before the toes: on hands and feet [m]."""
ON_HANDS = 0.1
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
        is_on_floor: (n,) lying, kneeling, crawling or sitting on the floor.
        is_down: (n, 2) by side: the foot is on the floor.
        is_flat: (n, 2) and its sole is level.
    """

    is_standing: NDArray[np.bool_]
    is_sitting: NDArray[np.bool_]
    is_on_floor: NDArray[np.bool_]
    is_down: NDArray[np.bool_]
    is_flat: NDArray[np.bool_]


def find_support(source: Source, frame_time: float) -> Support:
    """Tells standing, sitting, being on the floor and none of them (in the air, on the way to a seat) apart.

    A person sits whose hips rest for a while at a seat's height, whose trunk is upright, whose thighs lie, and who
    would fall backwards on the feet alone. Nobody stands or sits who has hips, knees, elbows or neck on the floor.

    Args:
        source: The motion.
        frame_time: [s].
    """
    heights, tilt = _foot_heights(source)
    foot_speed = np.stack([_speed(source.at(f"{s}_ankle"), frame_time) for s in SIDES], axis=1)
    stands = (foot_speed < STILL) & ~source.is_t_pose[:, None]
    floors = _floors(source, heights, stands)
    floor = float(floors.min())
    is_down = heights < floors + ON_FLOOR
    flexion = np.arccos(np.clip(-source.limb[:, :, 2, 2], -1.0, 1.0)).mean(axis=1)
    balance, lead = _balance(source, is_down)
    is_raised = flexion > RAISED
    is_on_floor = _is_on_floor(source, floor, lead)
    may_sit = seat_like(source, floor) & (balance < 0.0) & ~is_on_floor & ~source.is_t_pose
    is_sitting = resting(source, may_sit, frame_time)
    is_standing = is_down.any(axis=1) & ~(is_raised & (balance < STEADY)) & ~is_on_floor
    return Support(is_standing, is_sitting, is_on_floor, is_down, is_down & (tilt < FLAT))


def foot_contacts(source: Source, frame_time: float) -> tuple[NDArray[np.bool_], float]:
    """What of the feet touches the floor: what is as low as where the foot stands, and does not move along.

    Args:
        source: The motion.
        frame_time: [s].

    Returns:
        (n, 2, 2) by side, heel and toes; and the floor's level [m].
    """
    ankles = np.stack([source.at(f"{s}_ankle") for s in SIDES], axis=1)
    heights, _ = _foot_heights(source)
    stands = np.stack([_speed(source.at(f"{s}_ankle"), frame_time) for s in SIDES], axis=1) < STILL
    floors = _floors(source, heights, stands & ~source.is_t_pose[:, None])
    out = np.zeros((len(ankles), 2, 2), np.bool_)
    for k, way in enumerate(HEEL):
        point = ankles + way * source.toes - 0.07 * source.sole
        for side in range(2):
            is_low = point[:, side, 2] < floors[side] + ON_FLOOR
            out[:, side, k] = is_low & (_speed(point[:, side], frame_time) < ALONG)
    return out, float(floors.min())


def _is_on_floor(source: Source, floor: float, lead: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) whether more than the feet is on the floor."""

    def lowest(role: str) -> NDArray[np.float64]:
        return np.minimum(source.at(f"l_{role}")[:, 2], source.at(f"r_{role}")[:, 2]) - floor

    is_on_hands = (lowest("wrist") < LOW_WRIST) & (lead > ON_HANDS)
    is_down = (lowest("hip") < LOW_HIPS) | (lowest("knee") < LOW_KNEE) | (lowest("elbow") < LOW_ELBOW)
    return is_down | (source.at("neck")[:, 2] - floor < LOW_NECK) | is_on_hands


def _floors(source: Source, heights: NDArray[np.float64], stands: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(2,) level of the floor under each foot: low among the heights at which it stands still [m].

    Of somebody whose feet are never on the floor, what else is lowest tells it.
    """
    own = [h[s] if s.any() else h for h, s in zip(heights.T, stands.T, strict=True)]
    levels = np.array([np.percentile(h, 10.0) for h in own])
    levels = levels if np.ptp(levels) < UNEVEN else np.full(2, levels.min())
    others = [k for role, k in source.joints.items() if role[2:] not in ("ankle", "toe")]
    lowest = float(np.percentile(source.position[:, others, 2].min(axis=1), 2.0))
    return np.minimum(levels, lowest)


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


def _balance(source: Source, is_down: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far the centre of mass is before the feet that are on the floor, along the heading [m].

    Returns:
        (n,) before the rear heel, -inf if no foot is down, and (n,) before the foremost toes, -inf likewise.
    """
    heading = heading_of(source.pelvis)
    ahead = np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1)
    ankles = np.stack([source.at(f"{s}_ankle") for s in SIDES], axis=1)
    heels, balls = (np.einsum("nsk,nk->ns", ankles + way * source.toes, ahead) for way in HEEL)
    centre = (centre_of_mass(source) * ahead).sum(axis=1)
    is_any_down = is_down.any(axis=1)
    rear = np.where(is_down, heels, np.inf).min(axis=1)
    front = np.where(is_down, balls, -np.inf).max(axis=1)
    return np.where(is_any_down, centre - rear, -np.inf), np.where(is_any_down, centre - front, -np.inf)


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
