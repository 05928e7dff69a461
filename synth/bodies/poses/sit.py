"""Trunk, head and legs of a seated person."""

from dataclasses import astuple, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body, Pose
from synth.bodies.poses.crossed import cross_legs
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.landmarks import landmarks_of, mean_radius
from synth.bodies.poses.stand import SIGN, TRUNK_HINGES, draft_pitch, look_about
from synth.bodies.rig.ik import Goal

SEAT_DEPTH_SHARE = 0.72
"""Front edge of the seat, as a share of the thigh's length in front of the hip centres."""
SEAT_GIVES = 0.015
"""A foot comes down flat if the seat's front edge must give no more than this under the thigh [m]."""
OUT_OF_REACH = 0.04
"""Toes do not stretch for a floor that stays farther off than this [m]."""
CONTACT = 0.01
"""Skin this near the lowest touches the seat [m]."""
UNLIKE_SPREAD = 42.0
"""How much farther out one thigh may point than the other, where legs are unlike [degrees]."""
UNLIKE_STEP = 0.3
"""Standard deviation of how far each foot is before its knee, where legs are unlike, as a share of the shank."""
Range = tuple[float, float]


@dataclass(frozen=True)
class TrunkRanges:
    """Ranges of how a seated person holds trunk and head [degrees].

    Attributes:
        pelvis: Forward pitch of the pelvis, negative when it rolls back.
        lumbar: Lumbar flexion.
        thorax: Thoracic flexion.
        aside: Lateral lean of the trunk, to either side.
        look: Pitch of the face, down positive.
    """

    pelvis: Range = (-20.0, -6.0)
    lumbar: Range = (4.0, 14.0)
    thorax: Range = (0.0, 10.0)
    aside: Range = (0.0, 0.0)
    look: Range = (0.0, 10.0)


@dataclass(frozen=True)
class Sitting:
    """How the people of a family sit.

    Attributes:
        trunk: Ways to hold the trunk, all alike frequent.
        apart: Range of each thigh's bearing off straight ahead, outwards [degrees].
        forward: Range of how far the feet are before the knees, as a share of the shank.
        are_legs_crossed: Whether one leg is laid over the other, where the thighs let it.
        n_skipped: Random numbers passed over before `forward` is drawn; they keep the poses of a seed what they
            are.
        unlike: How much the legs differ from each other: 0 near copies, 1 as people sit at ease.
    """

    trunk: tuple[TrunkRanges, ...] = (TrunkRanges(),)
    apart: Range = (1.0, 16.0)
    forward: Range = (-0.18, 0.3)
    are_legs_crossed: bool = False
    n_skipped: int = 0
    unlike: float = 0.0


def seat_height_of(body: Body) -> float:
    """Seat height on which the body's thighs are level with the feet flat: about its knee height [m]."""
    marks = landmarks_of(body)
    return marks.leg - marks.thigh - mean_radius(body, "l_thigh", 0.75)


def seat_depth_of(body: Body) -> float:
    """How far in front of the root the seat may reach without touching the calves [m]."""
    return SEAT_DEPTH_SHARE * landmarks_of(body).thigh


def seat_contact(body: Body, pose: Pose) -> NDArray[np.float64]:
    """Where a seated body touches its seat.

    Args:
        body: The person.
        pose: A sitting pose in the person frame.

    Returns:
        (3,) middle of the skin within `CONTACT` of the lowest, with the lowest z: the height of the seat [m].
    """
    skin = seat_skin(Draft.of(body, pose))
    low = float(skin[:, 2].min())
    x, y, _ = skin[skin[:, 2] < low + CONTACT].mean(axis=0)
    return np.array([x, y, low])


def sit(draft: Draft, rng: np.random.Generator, wild: float, sitting: Sitting, seat_height: float) -> None:
    """Sits on a seat of a height with the feet on the floor, or hanging where the legs are too short."""
    low, high = np.array(astuple(sitting.trunk[int(rng.integers(len(sitting.trunk)))])).T
    pelvis, lumbar, thorax, aside, look = (float(value) for value in rng.uniform(low, high))
    aside = aside if rng.random() < 0.5 else -aside
    draft.turn_root(pitch=pelvis, roll=0.15 * aside)
    draft.set(lumbar_flexion=lumbar, thorax_flexion=thorax)
    draft.set(lumbar_lateral=0.4 * aside, thorax_lateral=0.45 * aside)
    draft.jitter(rng, 2.0 * wild, TRUNK_HINGES)
    _set_legs(draft, rng, wild, sitting, seat_height)
    look_about(draft, rng, wild, pitch=look)


def seat_skin(draft: Draft) -> NDArray[np.float32]:
    """(m, 3) skin of pelvis and thighs that is over the seat, world [m]."""
    skin = draft.skin(draft.marks.seat)
    return skin[skin[:, 0] < _seat_front(draft)]


def _seat_front(draft: Draft) -> float:
    """World x of the seat's front edge [m]."""
    return float(draft.T_world_root[0, 3] + SEAT_DEPTH_SHARE * draft.marks.thigh)


def lower_onto_seat(draft: Draft, seat_height: float) -> None:
    """Moves the root so that the lowest skin over the seat is at the seat's height."""
    draft.T_world_root[2, 3] += seat_height - draft.lowest(draft.marks.seat, _seat_front(draft))


@dataclass(frozen=True)
class _Foot:
    """Where one foot of a seated person goes.

    Attributes:
        spread: Bearing of the thigh off straight ahead, outwards [degrees].
        forward: How far the ankle is before the knee [m].
        toe_yaw: Direction of the toes, left positive [degrees].
    """

    spread: float
    forward: float
    toe_yaw: float


def _set_legs(draft: Draft, rng: np.random.Generator, wild: float, sitting: Sitting, seat_height: float) -> None:
    """Lays the thighs along the seat, crosses the legs of who does, and puts the feet down."""
    feet = _draw_feet(draft, rng, wild, sitting)
    pelvis = draft_pitch(draft)
    for side, foot in feet.items():
        draft.set(f"{side}_", hip_flexion=90 + pelvis, hip_abduction=foot.spread, knee_flexion=85)
    for _ in range(2):
        lower_onto_seat(draft, seat_height)
        for side, foot in feet.items():
            put_foot_down(draft, side, seat_height, foot.spread, foot.forward, foot.toe_yaw, n_steps=1)
    feet = _spread_thighs(draft, feet, seat_height)
    crossing = cross_legs(draft, rng) if sitting.are_legs_crossed else None
    lower_onto_seat(draft, seat_height)
    for side, foot in feet.items():
        if side != crossing:
            spread = draft.get(f"{side}_hip_abduction") if crossing else foot.spread
            put_foot_down(draft, side, seat_height, spread, foot.forward, foot.toe_yaw)
    lower_onto_seat(draft, seat_height)


def _draw_feet(draft: Draft, rng: np.random.Generator, wild: float, sitting: Sitting) -> dict[str, _Foot]:
    """Draws by side where the feet go."""
    apart = float(rng.uniform(*sitting.apart))
    rng.random(sitting.n_skipped)
    forward = float(rng.uniform(*sitting.forward))
    yaws = {side: SIGN[side] * float(rng.uniform(-2, 1.2 * apart + 4)) for side in "lr"}
    steps = {side: forward + 0.1 * wild * float(rng.normal(0, 0.7)) for side in "lr"}
    spreads = {side: apart + wild * float(rng.normal(0, 2.5)) for side in "lr"}
    if sitting.unlike > 0.0:
        for side in "lr":
            more = sitting.unlike * wild * UNLIKE_SPREAD * float(rng.beta(0.6, 2.2))
            spreads[side], yaws[side] = spreads[side] + more, yaws[side] + SIGN[side] * more
            steps[side] += sitting.unlike * wild * UNLIKE_STEP * float(rng.normal())
    return {side: _Foot(spreads[side], steps[side] * draft.marks.shank, yaws[side]) for side in "lr"}


def _spread_thighs(draft: Draft, feet: dict[str, _Foot], seat_height: float) -> dict[str, _Foot]:
    """Moves the legs apart while they are in each other: thick thighs sit further apart."""
    for more in (4.0, 6.0, 8.0, 10.0):
        if max(draft.excess_of(side, "leg") for side in "lr") <= 0.0:
            break
        feet = {side: replace(foot, spread=foot.spread + more) for side, foot in feet.items()}
        for side, foot in feet.items():
            put_foot_down(draft, side, seat_height, foot.spread, foot.forward, foot.toe_yaw, n_steps=1)
    return feet


def put_foot_down(
    draft: Draft, side: str, seat_height: float, spread: float, forward: float, toe_yaw: float, n_steps: int = 4
) -> None:
    """Solves one leg: thigh along the seat, foot flat on the floor in front of or behind the knee, or hanging."""
    marks = draft.marks
    hip = draft.point(f"{side}_hip_flexion")
    azimuth = SIGN[side] * np.radians(spread)
    knee = hip + marks.thigh * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    # How far the knee may be below the hip before the thigh rests on the seat's front edge alone.
    thickness = mean_radius(draft.body, f"{side}_thigh", 1.0 - SEAT_DEPTH_SHARE)
    drop = (hip[2] - seat_height - thickness) / SEAT_DEPTH_SHARE
    drop = float(np.clip(drop, 0.0, 0.2 * marks.thigh))
    if marks.leg - marks.thigh < hip[2] - drop - SEAT_GIVES:
        draft.solve(f"{side}_leg", [Goal("knee_flexion", (0, 0, 0), knee - (0.0, 0.0, drop), 1.0)], 0.004)
        if _hang_foot(draft, side, forward):
            return
    sole = (0.0, 0.0, draft.marks.side[side].sole[2])
    length = marks.leg - marks.thigh
    # A shank that is longer than the knee is high stretches out or tucks in, as far as needed.
    slant = np.sqrt(max(length**2 - knee[2] ** 2, 0.0))
    reach = np.sign(forward or 1.0) * max(abs(forward), 0.75 * slant)
    reach = float(np.clip(reach, -0.35 * marks.shank, 0.75 * marks.shank))
    low = 0.0
    off = 0.0
    for _ in range(n_steps):
        target = (knee[0] + reach - 0.02, knee[1] + 0.1 * reach * np.sin(azimuth), -low)
        toes = (np.cos(np.radians(toe_yaw)), np.sin(np.radians(toe_yaw)), 0.0)
        goals = [
            Goal("ankle_inversion", sole, target, (0.25, 0.25, 1.5)),
            Goal("knee_flexion", (0, 0, 0), knee, (0.1, 0.4, 0.6)),
            Goal("ankle_inversion", (0, 0, 1), (0, 0, 1), 0.3, is_point=False),
            Goal("ankle_inversion", (1, 0, 0), toes, 0.04, is_point=False),
        ]
        draft.solve(f"{side}_leg", goals, 0.004)
        off = draft.lowest(marks.side[side].foot)
        if abs(off) < 0.001:
            break
        low += off
    if n_steps > 1 and off > 0.006:
        _hang_foot(draft, side, forward)


def _hang_foot(draft: Draft, side: str, forward: float) -> bool:
    """A leg too short for a flat foot: shank hanging, toes down to the floor if it is near, else loose.

    Returns:
        Whether the foot is above the floor.
    """
    swing = float(np.clip(40 * forward, -15, 15))
    draft.set(f"{side}_", knee_flexion=84 - swing, hip_rotation=0.0, ankle_inversion=4)
    for ankle in (-40, -29, -18, -8, 2, 12):
        draft.set(f"{side}_", ankle_flexion=ankle)
        low = draft.lowest(draft.marks.side[side].foot)
        if low > OUT_OF_REACH:
            draft.set(f"{side}_", ankle_flexion=-18)
        if low >= 0.0:
            return True
    return False
