"""Poses out of a library, placed on a body of any size: feet on the floor or hips on a seat."""

from dataclasses import replace

import numpy as np

from synth.bodies.body import Body, Pose
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.lap import lay_hands_in_lap
from synth.bodies.poses.library import FOOT_DOWN, FOOT_FLAT, FOOT_UP, PoseLibrary
from synth.bodies.poses.sit import lower_onto_seat, put_foot_down
from synth.bodies.poses.stand import SIGN, curl_fingers, draft_pitch, hang_arm
from synth.bodies.rig.collision import self_collides
from synth.bodies.rig.ik import Goal, solve_limb
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.skeleton import LINK_IDX

ON_FLOOR = 0.006
"""Knees do not bend to bring the other foot nearer to the floor than this [m]."""
MAX_GAP = 0.01
"""Law: standing feet end within this of the floor, and no skin below it [m]."""
SPREADS = (-6.0, 38.0)
"""Bearing of a seated thigh off straight ahead, outwards [degrees]."""
CROSSED = 0.12
"""A foot this much higher than the other one is not put down when the person sits [m]."""
N_REPAIRS = 8
_AT_ANKLE = np.array([1.0, 1.0, 1.0, 1.0, 0.004, 0.004])
"""Pull to their angles of hip, knee and ankle, when only the ankle is to turn [m/rad]."""
# Small turns that may take an arm out of what it is in [degrees].
_ARM_TURNS = (
    ("shoulder_abduction", 4.0), ("shoulder_flexion", 4.0), ("shoulder_flexion", -4.0),
    ("shoulder_rotation", -6.0), ("elbow_flexion", -6.0),
)  # fmt: skip


def place_pose(
    library: PoseLibrary,
    row: int,
    body: Body,
    rng: np.random.Generator,
    seat_height: float | None = None,
    keeps_arms: bool = True,
) -> Pose | None:
    """Puts a library's pose on a body.

    Trunk, head and arms are the library's; legs are bent as little as it takes to put the feet on the floor,
    or the thighs along the seat.

    Args:
        library: The poses.
        row: Which one.
        body: The person.
        rng: Draws how the fingers are bent, and the arms if they are not kept.
        seat_height: Top of the seat above the floor [m], for a pose that sits.
        keeps_arms: False hangs the arms or lays them in the lap, for a table or a handle that will move them.

    Returns:
        The pose in the person frame with `source_id` set, or None if it does not fit this body.
    """
    if bool(library.is_sitting[row]) != (seat_height is not None):
        raise ValueError(f"pose {library.pose_id(row)}: a seat height is for poses that sit, and needed by them")
    draft = Draft(body, library.angles[row].astype(np.float64))
    draft.T_world_root[:3, :3] = library.root[row]
    for side in "lr":
        curl_fingers(draft, side, rng, 18, 22)
    is_placed = _stand(draft, library.feet[row]) if seat_height is None else _sit(draft, seat_height)
    if not is_placed:
        return None
    if not keeps_arms and seat_height is not None:
        lay_hands_in_lap(draft, rng)
    elif not keeps_arms:
        for side in "lr":
            draft.set(f"{side}_", shoulder_flexion=0.0)
            hang_arm(draft, side, rng, 1.0)
    else:
        _free_arms(draft)
    pose = replace(
        draft.pose("mocap_sitting" if seat_height else "mocap_standing"), source_id=library.pose_id(row)
    )
    return pose if _is_sound(body, pose, keeps_arms) else None


def _is_sound(body: Body, pose: Pose, keeps_arms: bool) -> bool:
    if float(pose_vertices(body, pose)[:, 2].min()) < -MAX_GAP:
        return False
    if keeps_arms:
        return not self_collides(body, pose)
    return max(Draft.of(body, pose).excess_of(side, "leg") for side in "lr") <= 0.0


def _free_arms(draft: Draft) -> None:
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


def _stand(draft: Draft, feet: np.ndarray) -> bool:
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
    return float(draft.skin(draft.marks.side[side].foot)[:, 2].min())


def _sit(draft: Draft, seat_height: float) -> bool:
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
