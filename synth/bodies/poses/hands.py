"""Where hands go: targets a scene can give, and the solves that put a palm, a fingertip or a fist on them."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.bodies.poses.draft import Draft
from synth.bodies.poses.stand import SIGN
from synth.bodies.rig.ik import Goal, Solution
from synth.bodies.skeleton import LINK_IDX

Grip = Literal["rest", "keyboard", "handle", "pen", "cup"]
SINK = 0.005
"""How far skin may go below a surface it rests on [m]."""
ELBOW_PUSHES = (0.25, 0.45)
"""How far an elbow is pushed out when the arm collides, one try after the other, as shares of the upper arm."""
GAP = 0.01
"""How far skin may stay off what it touches [m]."""
_ELBOW = "elbow_flexion"


@dataclass(frozen=True)
class HandTarget:
    """One thing for one hand to touch, in the person frame (root over x = y = 0, facing +x, floor z = 0).

    Attributes:
        position: (3,) [m]: "rest", "pen", "cup": on the surface under the palm; "keyboard": on the key under the
            fingertips; "handle": on the axis of the bar.
        grip: What the hand does.
        diameter: Of a bar [m].
    """

    position: tuple[float, float, float]
    grip: Grip = "rest"
    diameter: float = 0.03


@dataclass(frozen=True)
class HandTargets:
    """What a scene offers the hands, in the person frame.

    Attributes:
        surface_height: z of a table top [m], or None without a table.
        surface: x_min, x_max, y_min, y_max of that top [m]; x_min is the edge next to the person.
        left: Target of the left hand, or None: the hand chooses its place on the surface.
        right: Target of the right hand.
    """

    surface_height: float | None = None
    surface: tuple[float, float, float, float] | None = None
    left: HandTarget | None = None
    right: HandTarget | None = None

    def of(self, side: str) -> HandTarget | None:
        """Target of side "l" or "r"."""
        return self.left if side == "l" else self.right


def unit(vector: ArrayLike) -> NDArray[np.float64]:
    """The vector at length 1."""
    out = np.asarray(vector, dtype=np.float64)
    return out / np.linalg.norm(out)


def elbow_start(draft: Draft, side: str, **degrees: float) -> None:
    """Resets an arm to a plain bent one before it is solved; other hinges by name [degrees]."""
    plain = {
        "clavicle_elevation": 0.0,
        "clavicle_protraction": 0.0,
        "shoulder_flexion": 25.0,
        "shoulder_abduction": 15.0,
        "shoulder_rotation": 25.0,
        "elbow_flexion": 80.0,
        "forearm_pronation": 30.0,
        "wrist_flexion": 0.0,
        "wrist_deviation": 0.0,
    }
    draft.set(f"{side}_", **(plain | degrees))


def fingertip_in_hand(draft: Draft, side: str) -> NDArray[np.float64]:
    """(3,) finger ends in the hand's frame, with the fingers as bent as they are [m]."""
    T = draft.links()
    hand, tips = T[LINK_IDX[f"{side}_wrist_deviation"]], T[LINK_IDX[f"{side}_fingertips_flexion"]]
    world = tips[:3, :3] @ draft.marks.side[side].fingertip + tips[:3, 3]
    return hand[:3, :3].T @ (world - hand[:3, 3])


def place_hand(
    draft: Draft,
    side: str,
    target: ArrayLike,
    palm_towards: ArrayLike | None = None,
    fingers_towards: ArrayLike | None = None,
    local: NDArray[np.float64] | None = None,
    elbow: ArrayLike | None = None,
    extra: tuple[Goal, ...] = (),
    palm_weight: float = 0.1,
    fingers_weight: float = 0.05,
    elbow_weight: float = 0.06,
    swivels: bool = True,
) -> Solution:
    """Moves a hand so that a point of it, by default the palm, comes to a target.

    Args:
        draft: Changed in place.
        side: "l" or "r".
        target: (3,) world [m].
        palm_towards: Direction that the palm should face, if it matters.
        fingers_towards: Direction that the knuckles should point, if it matters.
        local: (3,) point of the hand's frame [m].
        elbow: Where the elbow would best be, world [m].
        extra: Further goals.
        palm_weight: [m/rad].
        fingers_weight: [m/rad].
        elbow_weight: Relative to the target's 1.
        swivels: Whether the elbow may be turned out of a collision.
    """
    marks = draft.marks.side[side]
    goals = [Goal("wrist_deviation", marks.palm if local is None else local, target, 1.0)]
    if palm_towards is not None:
        goals.append(Goal("wrist_deviation", marks.palm_normal, unit(palm_towards), palm_weight, is_point=False))
    if fingers_towards is not None:
        goals.append(Goal("wrist_deviation", (0, 0, -1), unit(fingers_towards), fingers_weight, is_point=False))
    goals += extra
    start = draft.angles.copy()
    best = _solve_arm(draft, side, goals, None if elbow is None else Goal(_ELBOW, (0, 0, 0), elbow, elbow_weight))
    return _swivel_elbow(draft, side, goals, start, best) if swivels and best.point_error < 0.05 else best


def _solve_arm(draft: Draft, side: str, goals: list[Goal], elbow: Goal | None) -> Solution:
    """Moves an arm to its goals; the error told is that of the first, without the elbow's share."""
    solution = draft.solve(f"{side}_arm", goals if elbow is None else [*goals, elbow], 0.012)
    return replace(solution, point_error=_first_error(draft, goals[0], side))


def _swivel_elbow(
    draft: Draft, side: str, goals: list[Goal], start: NDArray[np.float64], best: Solution
) -> Solution:
    """Swivels the elbow of an arm that collides out of the trunk, about the line from shoulder to hand.

    Args:
        draft: Changed in place: the better of the solutions found.
        side: "l" or "r".
        goals: Of the hand.
        start: (n_dofs,) angles that each solve starts from [rad].
        best: The solution so far, which the draft is in.
    """
    excess = draft.excess_of(side, "arm")
    for push in ELBOW_PUSHES:
        if excess <= 0.0:
            break
        away = draft.marks.upper_arm * push * np.array([0.5, SIGN[side] * 0.9, 0.3])
        aside = draft.point(f"{side}_elbow_flexion") + away
        draft.angles = start.copy()
        other = _solve_arm(draft, side, goals, Goal(_ELBOW, (0, 0, 0), aside, 0.25))
        other_excess = draft.excess_of(side, "arm")
        if other_excess + other.point_error < excess + best.point_error:
            best, excess = other, other_excess
    draft.angles = best.angles
    return best


def _first_error(draft: Draft, goal: Goal, side: str) -> float:
    """Distance of a point goal from its target [m]."""
    return float(np.linalg.norm(draft.point(f"{side}_{goal.link}", goal.local) - np.asarray(goal.target)))


def _lowest_over(draft: Draft, side: str, height: float, rect: tuple[float, float, float, float]) -> float:
    """Height over a surface of the arm's lowest skin within a rectangle [m]; +inf if none is."""
    marks = draft.marks.side[side]
    skin = draft.skin(np.concatenate([marks.hand, marks.forearm]))
    x_min, x_max, y_min, y_max = rect
    over = skin[(skin[:, 0] > x_min) & (skin[:, 0] < x_max) & (skin[:, 1] > y_min) & (skin[:, 1] < y_max)]
    return float(over[:, 2].min()) - height if len(over) else np.inf


def rest_on_surface(
    draft: Draft,
    side: str,
    position: tuple[float, float, float],
    rect: tuple[float, float, float, float],
    palm_towards: ArrayLike,
    fingers_towards: ArrayLike,
    local: NDArray[np.float64] | None = None,
    forearm_fall: float = 0.03,
) -> bool:
    """Lays a hand on a level surface so that its skin, or the forearm's, touches it and does not go in.

    Args:
        draft: Changed in place; the arm's angles are the rest pose.
        side: "l" or "r".
        position: Where on the surface the point goes [m].
        rect: x_min, x_max, y_min, y_max of the surface.
        palm_towards: Direction that the palm faces.
        fingers_towards: Direction that the knuckles point.
        local: (3,) point of the hand's frame; the palm by default.
        forearm_fall: How much the forearm falls towards the hand, as a share of its length.

    Returns:
        Whether the hand touches within `GAP` and `SINK`, and within 3 cm of where it should.
    """
    height = position[2]
    lift = 0.0
    level = Goal("elbow_flexion", (0, 0, -1), (0.0, 0.0, -forearm_fall), (0.0, 0.0, 0.1), is_point=False)
    for _ in range(4):
        target = (position[0], position[1], height + lift)
        solution = place_hand(
            draft, side, target, palm_towards, fingers_towards, local, extra=(level,), palm_weight=0.15
        )
        if solution.point_error > 0.03:
            return False
        low = _lowest_over(draft, side, height, rect)
        if -0.4 * SINK <= low <= 0.5 * GAP:
            return True
        if not np.isfinite(low):
            return False
        lift += 0.001 - low
    return -SINK <= low <= GAP


def grip_bar(draft: Draft, side: str, target: HandTarget, palm_pitch: float) -> bool:
    """Closes a fist around a bar along y.

    Args:
        draft: Changed in place; the arm's angles are the rest pose.
        side: "l" or "r".
        target: Bar's axis and diameter.
        palm_pitch: How far the palm faces down rather than forward [degrees].

    Returns:
        Whether the skin touches the bar within `GAP`.
    """
    own = draft.marks.side[side]
    radius = 0.5 * target.diameter
    off = radius
    towards = (np.cos(np.radians(palm_pitch)), 0.0, -np.sin(np.radians(palm_pitch)))
    across = Goal("wrist_deviation", (1, 0, 0), (0.0, -SIGN[side], 0.0), 0.12, is_point=False)
    for _ in range(3):
        local = own.grip + off * own.palm_normal
        solution = place_hand(
            draft, side, target.position, towards, None, local, extra=(across,), palm_weight=0.03
        )
        if solution.point_error > 0.01:
            return False
        distance = _distance_to_bar(draft, own.palm_skin, target)
        # A little off the palm, because the thumb cannot leave the bar's way altogether.
        short = radius + 0.4 * GAP - distance
        if abs(short) < 0.2 * GAP:
            break
        off += short
    # The fingers close until they touch: first the knuckles, then the middle joints.
    draft.set(f"{side}_", fingers_flexion=0, fingertips_flexion=20)
    for hinge, start, end in (("fingers_flexion", 10, 85), ("fingertips_flexion", 25, 100)):
        for bend in range(start, end, 10):
            draft.set(f"{side}_", **{hinge: bend})
            if _distance_to_bar(draft, own.finger_skin, target) < radius - 0.5 * SINK:
                draft.set(f"{side}_", **{hinge: bend - 10})
                break
    room = {}
    for thumb in (60, 40, 20, 0, -20):
        draft.set(f"{side}_", thumb_flexion=thumb)
        room[thumb] = _distance_to_bar(draft, own.thumb_skin, target)
    draft.set(f"{side}_", thumb_flexion=max(room, key=lambda thumb: min(room[thumb], radius)))
    return abs(distance - radius) < GAP


def _distance_to_bar(draft: Draft, chosen: NDArray[np.int64], target: HandTarget) -> float:
    """Distance of the nearest of the chosen skin vertices from the bar's axis [m]."""
    skin = draft.skin(chosen) - np.asarray(target.position)
    return float(np.hypot(skin[:, 0], skin[:, 2]).min())
