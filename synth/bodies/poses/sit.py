"""Trunk, head and legs of a seated person."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.poses.draft import SEAT_DEPTH_SHARE, Draft
from synth.bodies.poses.hands import place_hand
from synth.bodies.poses.stand import OTHER, SIGN, TRUNK_HINGES, curl_fingers, look_about
from synth.bodies.rig.collision import SEGMENT_IDX, fit_of
from synth.bodies.rig.ik import Goal
from synth.bodies.skeleton import LINK_IDX

SEAT_GIVES = 0.015
"""A foot comes down flat if the seat's front edge must give no more than this under the thigh [m]."""
OUT_OF_REACH = 0.04
"""Toes do not stretch for a floor that stays farther off than this [m]."""


@dataclass(frozen=True)
class Seat:
    """How a person sits, in degrees.

    Attributes:
        pelvis: Forward pitch of the pelvis, negative when it rolls back.
        lumbar: Lumbar flexion.
        thorax: Thoracic flexion.
        aside: Lateral lean of the trunk, to the right.
        look: Pitch of the face, down positive.
    """

    pelvis: float
    lumbar: float
    thorax: float
    aside: float = 0.0
    look: float = 5.0


# Ranges of the fields of `Seat` in degrees: pelvis, lumbar, thorax, aside (either side), look. One row is drawn.
_SEATS: dict[str, tuple[tuple[tuple[float, float], ...], ...]] = {
    "sitting_slouching": (((-38, -24), (14, 30), (8, 20), (0, 0), (0, 25)),),
    "sitting_leaning": (
        ((5, 20), (12, 28), (6, 18), (0, 0), (0, 30)),
        ((-30, -20), (0, 8), (-4, 5), (0, 0), (-5, 10)),
        ((-18, -6), (4, 12), (0, 10), (10, 24), (0, 15)),
    ),
    "table_elbows": (((0, 14), (14, 28), (8, 22), (0, 0), (-5, 15)),),
    "table_writing": (((-6, 8), (8, 20), (6, 18), (0, 0), (15, 40)),),
    "table_eating": (((-6, 8), (8, 20), (6, 18), (0, 0), (15, 40)),),
    "table_hands": (((-14, 0), (4, 15), (3, 14), (0, 0), (5, 28)),),
    "table_drinking": (((-14, 0), (4, 15), (3, 14), (0, 0), (0, 20)),),
    "typing_table": (((-14, 0), (4, 15), (3, 14), (0, 0), (8, 28)),),
    "typing_lap": (((-18, -4), (6, 18), (4, 16), (0, 0), (15, 35)),),
}
_UPRIGHT = (((-20.0, -6.0), (4.0, 14.0), (0.0, 10.0), (0.0, 0.0), (0.0, 10.0)),)


def draw_seat(family: str, rng: np.random.Generator) -> Seat:
    """How a person of a family holds the trunk."""
    rows = _SEATS.get(family, _UPRIGHT)
    low, high = np.array(rows[int(rng.integers(len(rows)))]).T
    pelvis, lumbar, thorax, aside, look = (float(value) for value in rng.uniform(low, high))
    return Seat(pelvis, lumbar, thorax, aside if rng.random() < 0.5 else -aside, look)


def sit(draft: Draft, rng: np.random.Generator, wild: float, family: str, seat_height: float) -> None:
    """Sits on a seat of a height with the feet on the floor, or hanging where the legs are too short."""
    seat = draw_seat(family, rng)
    draft.turn_root(pitch=seat.pelvis, roll=0.15 * seat.aside)
    draft.set(lumbar_flexion=seat.lumbar, thorax_flexion=seat.thorax)
    draft.set(lumbar_lateral=0.4 * seat.aside, thorax_lateral=0.45 * seat.aside)
    draft.jitter(rng, 2.0 * wild, TRUNK_HINGES)
    _legs(draft, rng, wild, family, seat_height)
    look_about(draft, rng, wild, pitch=seat.look)


def seat_skin(draft: Draft) -> NDArray[np.float32]:
    """(m, 3) skin of pelvis and thighs that is over the seat, world [m]."""
    skin = draft.skin(draft.marks.seat)
    front = draft.T_world_root[0, 3] + SEAT_DEPTH_SHARE * draft.marks.thigh
    return skin[skin[:, 0] < front]


def lower_onto_seat(draft: Draft, seat_height: float) -> None:
    """Moves the root so that the lowest skin over the seat is at the seat's height."""
    draft.T_world_root[2, 3] += seat_height - float(seat_skin(draft)[:, 2].min())


def _legs(draft: Draft, rng: np.random.Generator, wild: float, family: str, seat_height: float) -> None:
    marks = draft.marks
    pelvis = -float(np.degrees(np.arcsin(draft.T_world_root[2, 0])))
    apart = float(rng.uniform(1, 16)) if family != "sitting_legs_crossed" else float(rng.uniform(0, 5))
    forward = float(rng.uniform(-0.18, 0.3)) if not family.startswith("ta") else float(rng.uniform(-0.2, 0.15))
    if family == "sitting_legs_crossed":
        forward = float(rng.uniform(-0.25, 0.1))
    if family == "sitting_slouching":
        forward = float(rng.uniform(0.15, 0.55))
    yaws = {side: SIGN[side] * float(rng.uniform(-2, 1.2 * apart + 4)) for side in "lr"}
    steps = {side: forward + 0.1 * wild * float(rng.normal(0, 0.7)) for side in "lr"}
    spreads = {side: apart + wild * float(rng.normal(0, 2.5)) for side in "lr"}
    for side in "lr":
        draft.set(f"{side}_", hip_flexion=90 + pelvis, hip_abduction=spreads[side], knee_flexion=85)
    for _ in range(2):
        lower_onto_seat(draft, seat_height)
        for side in "lr":
            put_foot_down(
                draft, side, seat_height, spreads[side], steps[side] * marks.shank, yaws[side], n_steps=1
            )
    for more in (4.0, 6.0, 8.0, 10.0):
        if max(draft.excess_of(side, "leg") for side in "lr") <= 0.0:
            break
        # Thick thighs sit further apart.
        for side in "lr":
            spreads[side] += more
            put_foot_down(
                draft, side, seat_height, spreads[side], steps[side] * marks.shank, yaws[side], n_steps=1
            )
    crossing = _cross_legs(draft, rng) if family == "sitting_legs_crossed" else None
    lower_onto_seat(draft, seat_height)
    for side in "lr":
        if side != crossing:
            spread = draft.get(f"{side}_hip_abduction") if crossing else spreads[side]
            put_foot_down(draft, side, seat_height, spread, steps[side] * marks.shank, yaws[side])
    lower_onto_seat(draft, seat_height)


def put_foot_down(
    draft: Draft, side: str, seat_height: float, spread: float, forward: float, toe_yaw: float, n_steps: int = 4
) -> None:
    """Solves one leg: thigh along the seat, foot flat on the floor in front of or behind the knee, or hanging."""
    marks = draft.marks
    hip = draft.point(f"{side}_hip_flexion")
    azimuth = SIGN[side] * np.radians(spread)
    knee = hip + marks.thigh * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    # How far the knee may be below the hip before the thigh rests on the seat's front edge alone.
    drop = (hip[2] - seat_height - _radius(draft, f"{side}_thigh", 1.0 - SEAT_DEPTH_SHARE)) / SEAT_DEPTH_SHARE
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
        off = float(draft.skin(marks.side[side].foot)[:, 2].min())
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
        low = float(draft.skin(draft.marks.side[side].foot)[:, 2].min())
        if low > OUT_OF_REACH:
            draft.set(f"{side}_", ankle_flexion=-18)
        if low >= 0.0:
            return True
    return False


def _radius(draft: Draft, segment: str, height: float) -> float:
    radius = fit_of(draft.body).profiles.radius[SEGMENT_IDX[segment]]
    return float(radius[round(height * (len(radius) - 1))].mean())


def _cross_legs(draft: Draft, rng: np.random.Generator) -> str | None:
    """Crosses the legs in one of two ways, tried a few times; thighs too thick for it stay side by side.

    Returns:
        Side of the upper leg, or None.
    """
    uncrossed = draft.angles.copy()
    for _ in range(10):
        lead = "l" if rng.random() < 0.5 else "r"
        draft.angles = uncrossed.copy()
        cross = _cross_knees if rng.random() < 0.55 else _cross_ankle_on_knee
        cross(draft, lead, rng)
        draft.set(f"{lead}_", toes_extension=0)
        if max(draft.excess_of(side, "leg") for side in "lr") <= 0.0:
            return lead
    draft.angles = uncrossed
    return None


def _cross_knees(draft: Draft, lead: str, rng: np.random.Generator) -> None:
    """Lays one thigh over the other knee; its shank hangs beside the other shank."""
    other = OTHER[lead]
    draft.set(f"{other}_", hip_abduction=float(rng.uniform(-10, 3)))
    carrying = draft.point(f"{other}_knee_flexion")
    lift = _radius(draft, f"{lead}_thigh", 0.3) + _radius(draft, f"{other}_thigh", 0.15)
    lift *= float(rng.uniform(1.05, 1.4))
    ahead, inward = float(rng.uniform(0.03, 0.12)), float(rng.uniform(0.01, 0.05))
    knee = carrying + np.array([ahead, SIGN[lead] * inward, lift])
    T = draft.links()[LINK_IDX[f"{other}_knee_flexion"]]
    shank = -T[:3, 2] + np.array(
        [float(rng.uniform(0.7, 1.3)), SIGN[other] * float(rng.uniform(-0.15, 0.12)), 0.0]
    )
    goals = [
        Goal("knee_flexion", (0, 0, 0), knee, 1.0),
        Goal("knee_flexion", (0, 0, -1), shank / np.linalg.norm(shank), 0.15, is_point=False),
    ]
    draft.set(f"{lead}_", hip_flexion=105, hip_abduction=-10, hip_rotation=0, knee_flexion=80)
    draft.solve(f"{lead}_leg", goals, 0.01)
    draft.set(f"{lead}_", ankle_flexion=float(rng.uniform(-35, -8)), ankle_inversion=float(rng.uniform(0, 12)))


def _cross_ankle_on_knee(draft: Draft, lead: str, rng: np.random.Generator) -> None:
    """Lays one ankle on the other thigh just above the knee, the knee falling outwards."""
    other = OTHER[lead]
    marks = draft.marks
    T = draft.links()[LINK_IDX[f"{other}_hip_rotation"]]
    lift = (
        _radius(draft, f"{other}_thigh", 0.25)
        + _radius(draft, f"{lead}_shank", 0.15)
        + float(rng.uniform(0.01, 0.04))
    )
    below = -marks.thigh * float(rng.uniform(0.78, 0.88))
    target = T[:3, :3] @ np.array([lift, 0.0, below]) + T[:3, 3]
    shank = np.array([float(rng.uniform(0.0, 0.3)), SIGN[other], float(rng.uniform(-0.15, 0.1))])
    goals = [
        Goal("knee_flexion", (0, 0, -0.82 * marks.shank), target, 1.0),
        Goal("knee_flexion", (0, 0, -1), shank / np.linalg.norm(shank), 0.06, is_point=False),
    ]
    draft.set(f"{lead}_", hip_flexion=95, hip_abduction=35, hip_rotation=-45, knee_flexion=100)
    draft.solve(f"{lead}_leg", goals, 0.01)
    draft.set(f"{lead}_", ankle_flexion=float(rng.uniform(-10, 10)), ankle_inversion=float(rng.uniform(0, 15)))


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
