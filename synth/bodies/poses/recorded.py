"""Poses as recordings have them: drawn from the model of recorded life, and put on a floor or a seat."""

from dataclasses import dataclass

import numpy as np

from synth.bodies.life.model import SPREAD, Posture, life_model
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.library import FOOT_DOWN, FOOT_FLAT, FOOT_UP
from synth.bodies.poses.sit import lower_onto_seat, put_foot_down
from synth.bodies.poses.stand import SIGN, draft_pitch, shape_hand
from synth.bodies.rig.ik import Goal, solve_limb
from synth.bodies.rig.skinning import ALL_VERTICES
from synth.bodies.skeleton import LINK_IDX

ON_FLOOR = 0.006
"""Knees do not bend to bring the other foot nearer to the floor than this [m]."""
MAX_GAP = 0.01
"""Law: standing feet end within this of the floor, and no skin below it [m]."""
SPREADS = (-6.0, 38.0)
"""Bearing of a seated thigh off straight ahead, outwards [degrees]."""
CROSSED = 0.12
"""A foot this much higher than the other one is not put down when the person sits [m]."""
MAX_BELOW = 0.001
"""No skin of a drawn pose is farther below the floor [m]."""
N_REPAIRS = 8
_AT_ANKLE = np.array([1.0, 1.0, 1.0, 1.0, 0.004, 0.004])
"""Pull to their angles of hip, knee and ankle, when only the ankle is to turn [m/rad]."""
# Small turns that may take an arm out of what it is in [degrees].
_ARM_TURNS = (
    ("shoulder_abduction", 4.0), ("shoulder_flexion", 4.0), ("shoulder_flexion", -4.0),
    ("shoulder_rotation", -6.0), ("elbow_flexion", -6.0),
)  # fmt: skip


@dataclass(frozen=True)
class Recorded:
    """A base whose trunk, head, arms and legs are drawn together from the model of recorded life.

    Attributes:
        posture: Which of the model's poses.
    """

    posture: Posture


def pose_as_recorded(
    draft: Draft, rng: np.random.Generator, wild: float, recorded: Recorded, seat_height: float | None
) -> bool:
    """Draws a pose from the model and puts it on the floor or on the seat.

    Args:
        draft: Changed in place.
        rng: Random draws.
        wild: Scale of the variation, 1 as in the model.
        recorded: Which poses.
        seat_height: Top of the seat above the floor, for those who sit [m].

    Returns:
        Whether the body stands or sits as it should, with no skin below the floor.
    """
    drawn = life_model().draw(recorded.posture, rng, SPREAD * wild)
    draft.angles = drawn.angles
    draft.T_world_root[:3, :3] = drawn.R_world_root
    for side in "lr":
        shape_hand(draft, side, rng)
    is_placed = (
        stand_on_feet(draft, np.array(drawn.feet)) if seat_height is None else sit_on_seat(draft, seat_height)
    )
    if not is_placed:
        return False
    free_arms(draft)
    return draft.lowest(ALL_VERTICES) >= -MAX_BELOW


def free_arms(draft: Draft) -> None:
    """Turns each arm a little, the way that helps most, while it is in something."""
    for side in "lr":
        depth = draft.excess_of(side, "arm")
        for _ in range(N_REPAIRS):
            if depth <= 0.0:
                break
            start, best = draft.angles, draft.angles
            for name, step in _ARM_TURNS:
                draft.angles = start.copy()
                draft.set(f"{side}_", **{name: draft.get(f"{side}_{name}") + step})
                trial = draft.excess_of(side, "arm")
                if trial < depth:
                    depth, best = trial, draft.angles
            draft.angles = best
            if best is start:
                break


def stand_on_feet(draft: Draft, feet: np.ndarray) -> bool:
    """Puts the feet on the floor as the library says; legs that are in each other are spread."""
    state = dict(zip("lr", (int(f) for f in feet), strict=True))
    for side, how in state.items():
        if how == FOOT_DOWN:
            pitch = -np.degrees(np.arcsin(draft.links()[LINK_IDX[f"{side}_ankle_inversion"], 2, 0]))
            draft.set(f"{side}_", toes_extension=max(0.0, pitch - 10.0))
    for _ in range(5):
        gap = _plant(draft, state)
        colliding = [side for side in "lr" if draft.excess_of(side, "leg") > 0.0]
        if not colliding:
            return gap <= MAX_GAP
        for side in colliding:
            draft.set(f"{side}_", hip_abduction=draft.get(f"{side}_hip_abduction") + 2.5)
    return False


def _plant(draft: Draft, state: dict[str, int]) -> float:
    """Moves root and legs until the feet that are down touch the floor.

    Returns:
        Height of the foot farthest off the floor it should stand on [m].
    """
    for side in (s for s in "lr" if state[s] == FOOT_FLAT):
        _level_foot(draft, side)
    low = {side: _lowest(draft, side) for side in "lr"}
    standing = [side for side in "lr" if state[side] != FOOT_UP]
    draft.T_world_root[2, 3] -= min(low[side] for side in standing)
    gap = 0.0
    for _ in range(3):
        for side in "lr":
            _put_down(draft, side, state[side])
        heights = [_lowest(draft, side) for side in standing]
        gap = max(abs(height) for height in heights)
        missing = max(heights) - ON_FLOOR
        if missing <= 0.0:
            break
        # A leg is too short to reach: come down by what is missing, the other leg bends.
        draft.T_world_root[2, 3] -= missing
    return gap


def _level_foot(draft: Draft, side: str) -> None:
    """Turns a foot level at the ankle, so that leg and root need not make up for its tilt."""
    T = draft.links()[LINK_IDX[f"{side}_ankle_inversion"]]
    goals = [
        Goal("ankle_inversion", (0, 0, 1), (0, 0, 1), 0.3, is_point=False),
        Goal("ankle_inversion", (1, 0, 0), (*unit_or_forward(T[0, 0], T[1, 0]), 0.0), 0.15, is_point=False),
    ]
    draft.angles = solve_limb(
        draft.body.skeleton, f"{side}_leg", draft.links(), draft.angles, goals, _AT_ANKLE
    ).angles


def _put_down(draft: Draft, side: str, state: int) -> None:
    """Solves one leg so that its foot's lowest skin is on the floor; a foot in the air only must not be below."""
    sole = (0.0, 0.0, draft.marks.side[side].sole[2])
    link = f"{side}_ankle_inversion"
    T = draft.links()[LINK_IDX[link]]
    x, y, _ = draft.point(link)
    z = float(draft.point(link, sole)[2])
    heading = unit_or_forward(T[0, 0], T[1, 0])
    toes, up = (
        (T[:3, 0], T[:3, 2]) if state != FOOT_FLAT else (np.array([*heading, 0.0]), np.array([0.0, 0.0, 1.0]))
    )
    for _ in range(4):
        low = _lowest(draft, side)
        if state == FOOT_UP and low >= 0.0:
            return
        is_level = state != FOOT_FLAT or draft.links()[LINK_IDX[link], 2, 2] > 0.9998
        if abs(low) < 0.001 and is_level:
            return
        z -= low if is_level or abs(low) > 0.02 else 0.0
        goals = [
            Goal("ankle_inversion", sole, (0.0, 0.0, z), (0.0, 0.0, 1.5)),
            Goal("ankle_inversion", (0, 0, 0), (x, y, 0.0), (0.7, 0.7, 0.0)),
            Goal("ankle_inversion", (0, 0, 1), up, 0.3, is_point=False),
            Goal("ankle_inversion", (1, 0, 0), toes, 0.15, is_point=False),
        ]
        draft.solve(f"{side}_leg", goals, 0.004)


def unit_or_forward(x: float, y: float) -> tuple[float, float]:
    """A horizontal direction, straight ahead where there is none."""
    norm = float(np.hypot(x, y))
    return (x / norm, y / norm) if norm > 1e-6 else (1.0, 0.0)


def _lowest(draft: Draft, side: str) -> float:
    """Height of a foot's lowest skin [m]."""
    return draft.lowest(draft.marks.side[side].foot)


def sit_on_seat(draft: Draft, seat_height: float) -> bool:
    """Lays the thighs along the seat and puts the feet down where the library has them beside the knees."""
    knee = {side: draft.point(f"{side}_knee_flexion") for side in "lr"}
    ankle = {side: draft.point(f"{side}_ankle_flexion") for side in "lr"}
    links = draft.links()
    plans = {}
    for side in "lr":
        thigh = -links[LINK_IDX[f"{side}_hip_rotation"], :3, 2]
        spread = float(np.degrees(np.arctan2(SIGN[side] * thigh[1], thigh[0])))
        x, y = unit_or_forward(*links[LINK_IDX[f"{side}_ankle_inversion"], :2, 0])
        forward = float(ankle[side][0] - knee[side][0]) + 0.02
        plans[side] = (float(np.clip(spread, *SPREADS)), forward, float(np.degrees(np.arctan2(y, x))))
    crossed = [s for s, o in (("l", "r"), ("r", "l")) if ankle[s][2] > ankle[o][2] + CROSSED]
    pitch = draft_pitch(draft)
    for side in (s for s in "lr" if s not in crossed):
        draft.set(f"{side}_", hip_flexion=90 + pitch, hip_abduction=plans[side][0], knee_flexion=85)
    for wider in (0.0, 4.0, 8.0, 14.0, 20.0):
        for n_steps in (1, 4):
            lower_onto_seat(draft, seat_height)
            for side in (s for s in "lr" if s not in crossed):
                spread, forward, yaw = plans[side]
                put_foot_down(draft, side, seat_height, spread + wider, forward, yaw, n_steps)
        lower_onto_seat(draft, seat_height)
        if max(draft.excess_of(side, "leg") for side in "lr") <= 0.0:
            return True
    return False
