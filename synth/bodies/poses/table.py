"""Arms of the families whose hands touch what the scene offers: a table, a laptop, a handle."""

import numpy as np
from numpy.typing import NDArray

from synth.bodies.poses.arms import lead_side
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.hands import (
    GAP,
    SINK,
    HandTarget,
    HandTargets,
    elbow_start,
    fingertip_in_hand,
    grip_bar,
    place_hand,
    rest_on_surface,
    unit,
)
from synth.bodies.poses.stand import OTHER, SIGN, curl_fingers
from synth.bodies.rig.ik import Goal

TOP_THICKNESS = 0.06
"""Room left for a table top and its frame above a hand in the lap [m]."""
_ENDLESS = (-10.0, 10.0, -10.0, 10.0)


def _table(targets: HandTargets | None) -> tuple[float, tuple[float, float, float, float]]:
    """Height and rectangle of the table's top [m]."""
    if targets is None or targets.surface_height is None or targets.surface is None:
        raise ValueError(f"hands at a table need targets with surface_height and surface; got {targets}")
    return targets.surface_height, targets.surface


def _spot(
    draft: Draft, side: str, rng: np.random.Generator, targets: HandTargets, reach: tuple[float, float],
    aside: tuple[float, float],
) -> tuple[float, float, float]:  # fmt: skip
    """Where a hand goes: the given target, or a place drawn in shares of the forearm from the table's edge."""
    given = targets.of(side)
    if given is not None:
        return given.position
    height, (x_min, x_max, y_min, y_max) = _table(targets)
    forearm = draft.marks.forearm
    x = min(x_min + forearm * float(rng.uniform(*reach)), x_max - 0.05)
    y = SIGN[side] * forearm * float(rng.uniform(*aside))
    return (x, min(max(y, y_min + 0.04), y_max - 0.04), height)


def _flat_hand(draft: Draft, side: str, rng: np.random.Generator, targets: HandTargets) -> bool:
    """A hand flat on the table, or loosely curled on its little finger's side."""
    _, rect = _table(targets)
    spot = _spot(draft, side, rng, targets, (0.25, 0.95), (0.1, 0.75))
    elbow_start(draft, side, shoulder_flexion=35, shoulder_abduction=20, elbow_flexion=75, forearm_pronation=60)
    if rng.random() < 0.7:
        curl_fingers(draft, side, rng, 6, 10)
        palm = np.array([0.0, -SIGN[side] * float(rng.uniform(0.0, 0.25)), -1.0])
    else:
        curl_fingers(draft, side, rng, 35, 40)
        palm = np.array([-0.1, -SIGN[side], -0.5])
    fingers = (1.0, -SIGN[side] * float(rng.uniform(0.1, 0.9)), -0.02)
    return rest_on_surface(draft, side, spot, rect, palm, fingers)


def hands_on_table(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Both hands on the table; now and then one stays in the lap."""
    height, rect = _table(targets)
    assert targets is not None
    sides = "lr" if rng.random() < 0.8 or targets.left or targets.right else lead_side(rng)
    if len(sides) == 1 and not _under(draft, OTHER[sides], rect, height):
        return False
    return all(_flat_hand(draft, side, rng, targets) for side in sides)


def _under(draft: Draft, side: str, rect: tuple[float, float, float, float], height: float) -> bool:
    """Whether all of an arm that is within a table's outline lies under its top."""
    marks = draft.marks.side[side]
    skin = draft.skin(np.concatenate([marks.hand, marks.forearm]))
    return not np.any(skin[_within(skin, rect), 2] > height - TOP_THICKNESS)


def _within(skin: NDArray[np.float32], rect: tuple[float, float, float, float]) -> NDArray[np.bool_]:
    x_min, x_max, y_min, y_max = rect
    return (skin[:, 0] > x_min) & (skin[:, 0] < x_max) & (skin[:, 1] > y_min) & (skin[:, 1] < y_max)


def write(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """One hand holds a pen on the table, the other keeps the paper."""
    _, rect = _table(targets)
    assert targets is not None
    lead = "r" if rng.random() < 0.85 else "l"
    spot = _spot(draft, lead, rng, targets, (0.4, 0.9), (0.05, 0.4))
    elbow_start(draft, lead, shoulder_flexion=35, shoulder_abduction=22, elbow_flexion=80, forearm_pronation=35)
    draft.set(f"{lead}_", fingers_flexion=50, fingertips_flexion=50, thumb_flexion=35)
    palm = (-0.2, -SIGN[lead] * 0.8, -0.6)
    if not rest_on_surface(draft, lead, spot, rect, palm, (0.9, -SIGN[lead] * 0.5, -0.1)):
        return False
    return _flat_hand(draft, OTHER[lead], rng, targets)


def eat(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """One hand with a fork or spoon between plate and mouth, the other on the table."""
    _, rect = _table(targets)
    assert targets is not None
    lead = "r" if rng.random() < 0.85 else "l"
    mouth, normal = draft.surface("head", "head_rotation", 0.15, 0.0)
    plate = np.asarray(_spot(draft, lead, rng, targets, (0.4, 0.7), (0.0, 0.2))) + np.array([0.0, 0.0, 0.1])
    share = float(rng.uniform(0.0, 0.95))
    target = (1 - share) * plate + share * (mouth + 0.09 * normal + np.array([0, SIGN[lead] * 0.05, -0.03]))
    elbow_start(draft, lead, shoulder_flexion=35, shoulder_abduction=20, elbow_flexion=100, forearm_pronation=30)
    draft.set(f"{lead}_", fingers_flexion=60, fingertips_flexion=60, thumb_flexion=40)
    shoulder = draft.point(f"{lead}_shoulder_flexion")
    elbow = shoulder + draft.marks.upper_arm * unit((0.5, SIGN[lead] * 0.5, -0.8))
    fingers = (0.3 - share, -SIGN[lead] * 0.7, 0.3 * share)
    if (
        place_hand(draft, lead, target, (-0.5, -SIGN[lead] * 0.4, -0.5 + share), fingers, elbow=elbow).point_error
        > 0.02
    ):
        return False
    return _clear_of(draft, lead, rect, plate[2] - 0.1) and _flat_hand(draft, OTHER[lead], rng, targets)


def drink(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """One hand around a cup, on the table or at the mouth; the other on the table."""
    height, rect = _table(targets)
    assert targets is not None
    lead = lead_side(rng)
    draft.set(f"{lead}_", fingers_flexion=45, fingertips_flexion=50, thumb_flexion=35)
    elbow_start(draft, lead, shoulder_flexion=40, shoulder_abduction=18, elbow_flexion=90, forearm_pronation=0)
    if rng.random() < 0.5:
        spot = _spot(draft, lead, rng, targets, (0.4, 0.95), (0.1, 0.5))
        palm = (-0.1, -SIGN[lead], 0.0)
        ok = rest_on_surface(draft, lead, spot, rect, palm, (0.9, -SIGN[lead] * 0.3, 0.05))
    else:
        mouth, normal = draft.surface("head", "head_rotation", 0.15, 0.0)
        target = mouth + 0.05 * normal + np.array([0.0, SIGN[lead] * 0.045, -0.03])
        shoulder = draft.point(f"{lead}_shoulder_flexion")
        elbow = shoulder + draft.marks.upper_arm * unit((0.7, SIGN[lead] * 0.4, -0.6))
        solution = place_hand(
            draft, lead, target, (0.0, -SIGN[lead], 0.2), (-0.3, -SIGN[lead] * 0.5, 0.6), elbow=elbow
        )
        ok = solution.point_error < 0.02 and _clear_of(draft, lead, rect, height)
    return ok and _flat_hand(draft, OTHER[lead], rng, targets)


def _clear_of(draft: Draft, side: str, rect: tuple[float, float, float, float], height: float) -> bool:
    """Whether an arm is not inside the slab under a surface."""
    marks = draft.marks.side[side]
    skin = draft.skin(np.concatenate([marks.hand, marks.forearm]))
    return not np.any(skin[_within(skin, rect), 2] < height - SINK)


def elbows_on_table(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Elbows on the table, hands folded, at the chin or at the cheeks."""
    height, rect = _table(targets)
    kind = rng.random()
    apart = draft.marks.upper_arm * float(rng.uniform(0.35, 0.75))
    x = rect[0] + float(rng.uniform(0.05, 0.14))
    mouth, normal = draft.surface("head", "head_rotation", 0.05, 0.0)
    for side in "lr":
        curl_fingers(draft, side, rng, 45 if kind < 0.6 else 20, 50 if kind < 0.6 else 25)
        if kind < 0.6:
            hands = mouth + normal * float(rng.uniform(0.06, 0.2)) + np.array([0, SIGN[side] * 0.035, -0.04])
            palm, fingers = (-0.2, -SIGN[side], 0.0), (0.1, -0.35 * SIGN[side], 1.0)
        else:
            cheek, out = draft.surface("head", "head_rotation", 0.25, SIGN[side] * 55)
            hands = cheek + 0.006 * out
            palm, fingers = tuple(-out), (-0.2, SIGN[side] * 0.1, 1.0)
        if not _plant_elbow(draft, side, (x, SIGN[side] * apart, height), rect, hands, palm, fingers):
            return False
    return True


def _plant_elbow(
    draft: Draft, side: str, spot: tuple[float, float, float], rect: tuple[float, float, float, float],
    hand: np.ndarray, palm: tuple[float, ...], fingers: tuple[float, ...],
) -> bool:  # fmt: skip
    """Puts an elbow's skin on the table and the palm near a place."""
    marks = draft.marks.side[side]
    elbow_start(draft, side, shoulder_flexion=60, shoulder_rotation=30, elbow_flexion=125, forearm_pronation=0)
    lift = 0.045
    for _ in range(4):
        elbow = Goal("elbow_flexion", (0, 0, 0), (spot[0], spot[1], spot[2] + lift), (0.5, 0.5, 1.5))
        goals = [
            Goal("wrist_deviation", marks.palm, hand, (0.15, 0.4, 0.15)),
            elbow,
            Goal("wrist_deviation", marks.palm_normal, unit(palm), 0.04, is_point=False),
            Goal("wrist_deviation", (0, 0, -1), unit(fingers), 0.03, is_point=False),
        ]
        if draft.solve(f"{side}_arm", goals, 0.01).point_error > 0.05:
            return False
        skin = draft.skin(marks.forearm)
        over = skin[(skin[:, 0] > rect[0]) & (skin[:, 0] < rect[1])]
        if not len(over):
            return False
        low = float(over[:, 2].min()) - spot[2]
        if -0.4 * SINK <= low <= 0.5 * GAP:
            return _clear_of(draft, side, rect, spot[2])
        lift += 0.001 - low
    return False


def type_keys(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Finger ends on the keys, palms just above."""
    if targets is None or targets.left is None or targets.right is None:
        raise ValueError(f"typing hands need targets for both sides; got {targets}")
    for side in "lr":
        given = targets.of(side)
        assert given is not None
        draft.set(f"{side}_", fingers_flexion=float(rng.uniform(22, 35)), thumb_flexion=float(rng.uniform(5, 20)))
        draft.set(f"{side}_", fingertips_flexion=float(rng.uniform(22, 38)))
        out = float(rng.uniform(8, 25))
        elbow_start(
            draft, side, shoulder_flexion=20, shoulder_abduction=out, elbow_flexion=85, forearm_pronation=70
        )
        local = fingertip_in_hand(draft, side)
        spot = np.asarray(given.position)
        rect = _ENDLESS if targets.surface is None else targets.surface
        palm = (0.05, -SIGN[side] * 0.15, -1.0)
        fingers = (1.0, -SIGN[side] * float(rng.uniform(0.05, 0.45)), 0.05)
        if not rest_on_surface(
            draft, side, tuple(spot), rect, palm, fingers, local, float(rng.uniform(-0.05, 0.15))
        ):
            return False
    return True


def push_with(draft: Draft, rng: np.random.Generator, targets: HandTargets | None, sides: str) -> bool:
    """Fists around a handle; an arm without a target hangs."""
    for side in "lr":
        given: HandTarget | None = None if targets is None else targets.of(side)
        if given is None:
            continue
        if side in sides:
            elbow_start(
                draft, side, shoulder_flexion=15, shoulder_abduction=14, elbow_flexion=60, forearm_pronation=65
            )
            if not grip_bar(draft, side, given, float(rng.uniform(30, 75))):
                return False
    return True


def push_both(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """Both hands on a handle."""
    if targets is None or targets.left is None or targets.right is None:
        raise ValueError(f"pushing with both hands needs targets for both; got {targets}")
    return push_with(draft, rng, targets, "lr")


def push_one(draft: Draft, rng: np.random.Generator, targets: HandTargets | None) -> bool:
    """One hand on a handle, by chance where both have a target; the other swings, or holds a phone at the ear."""
    if targets is None or (targets.left is None and targets.right is None):
        raise ValueError(f"pushing with one hand needs a target for a hand; got {targets}")
    side = lead_side(rng)
    if targets.of(side) is None:
        side = OTHER[side]
    return push_with(draft, rng, targets, side)
