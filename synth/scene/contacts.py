"""What hands touch: tables, keyboards, handles; a laptop lowered on the lap, a stroller put at arm's reach."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.poses.hands import HandTarget, HandTargets
from synth.bodies.skeleton import JOINT_IDX
from synth.geometry import inverse, rotation_about
from synth.occluders import registry
from synth.scene.bases import draw_arms_pose
from synth.scene.draw import FOREARMS, THIGHS, TORSO, UPPER_ARMS, Person, SceneDraw
from synth.scene.placement import PlacedObject, advance, pose_on_floor

LAP_PARTS = FOREARMS | THIGHS
"""Labels that touch a laptop on the lap."""
LAP_TOUCH = 0.002
"""Gap at which a laptop counts as standing on the thighs [m]."""
MAX_BEYOND_KNEES = 0.12
"""A laptop on the lap sticks out at most this far over the knee joints [m]."""
STROLLER_REACH = (0.55, 0.90)
"""Range of the horizontal way from the shoulders to a stroller's handle over the arm's length."""


def table_targets(table: PlacedObject) -> HandTargets:
    """A table's top, for hands that choose their place on it; the table stands nearly unturned."""
    top = table.occluder.anchor("top")
    centre = (table.T_world_object @ top.T_object_anchor)[:3, 3]
    half_x, half_y = 0.5 * top.size[0], 0.5 * top.size[1]
    if top.shape == "ellipse":
        half_x, half_y = 0.97 * half_x, 0.6 * half_y
    x, y, z = map(float, centre)
    return HandTargets(surface_height=z, surface=(x - half_x, x + half_x, y - half_y, y + half_y))


def key_targets(laptop: PlacedObject, table: PlacedObject | None) -> HandTargets:
    """A laptop's keys for both hands, on a table's top or the lap."""
    left, right = (_target(laptop, f"keyboard_{side}", "keyboard") for side in ("left", "right"))
    if table is None:
        return HandTargets(left=left, right=right)
    return replace(table_targets(table), left=left, right=right)


def lower_on_lap(draw: SceneDraw, person: Person) -> PlacedObject | None:
    """Lowers a laptop on the thighs, tilted as they are, at the drawn gap before the belly."""
    laptop = draw.place("laptop", np.eye(4))
    base = laptop.occluder.anchor("base")
    thighs, trunk = person.points_of(THIGHS), person.points_of(TORSO)
    top = float(thighs[:, 2].max())
    belly = trunk[(trunk[:, 2] > top - 0.1) & (trunk[:, 2] < top + 0.3), 0].max(initial=0.0)
    x = float(belly) + draw.gap() + 0.5 * base.size[0]
    knees = person.joints()[[JOINT_IDX["l_knee"], JOINT_IDX["r_knee"]]]
    if x + 0.5 * base.size[0] > knees[:, 0].min() + MAX_BEYOND_KNEES:
        return None
    tilt = _slope(thighs, x, base.size)
    T_world_base = pose_on_floor(x, float(draw.rng.normal(0.0, 0.015)), 0.0) @ rotation_about((0, 1, 0), -tilt)
    T_world_base[2, 3] = top + 0.3
    T_world_object = T_world_base @ inverse(base.T_object_anchor)
    lowered = _lowered(replace(laptop, T_world_object=T_world_object, contact_parts=LAP_PARTS), thighs)
    others = person.points_without(LAP_PARTS | UPPER_ARMS)
    return lowered if lowered is not None and not lowered.is_nearer(others, 0.0) else None


def _lowered(item: PlacedObject, points: NDArray[np.float64]) -> PlacedObject | None:
    """An object let down on points until it touches one."""
    met = advance((item,), (0.0, 0.0, -1.0), points, LAP_TOUCH)
    return None if met is None else met[0]


def _slope(thighs: NDArray[np.float64], x: float, size: tuple[float, float]) -> float:
    """Upward slope of the thighs' tops from the back to the front edge of a base [rad]."""
    tops = []
    for edge in (x - 0.4 * size[0], x + 0.4 * size[0]):
        near = thighs[np.abs(thighs[:, 0] - edge) < 0.03]
        tops.append(float(near[:, 2].max()) if len(near) else np.nan)
    slope = np.arctan2(tops[1] - tops[0], 0.8 * size[0])
    return float(np.clip(np.nan_to_num(slope), -0.35, 0.35))


def push_stroller(draw: SceneDraw, person: Person, pose_family: str) -> tuple[Person, PlacedObject] | None:
    """Puts a stroller's handle within reach before the person, then the hands on it."""
    drawn = draw.place("stroller", np.eye(4), registry.KINDS["stroller"])
    handle = drawn.occluder.anchor("handle_left").T_object_anchor[:3, 3]
    shoulders, arm = _shoulders_and_arm(person)
    reach = float(draw.rng.uniform(*STROLLER_REACH)) * arm
    T = pose_on_floor(shoulders[0] + reach - handle[0], shoulders[1], 0.0)
    stroller = replace(drawn, T_world_object=T, contact_parts=FOREARMS)
    if stroller.is_nearer(person.points_without(FOREARMS | UPPER_ARMS), draw.config.clearance[0]):
        return None
    targets = HandTargets(
        left=_target(stroller, "handle_left", "handle"), right=_target(stroller, "handle_right", "handle")
    )
    arms = draw_arms_pose(draw, pose_family, person.subject.body, person.pose, targets)
    return None if arms is None else (Person.in_pose(person.subject, arms), stroller)


def _shoulders_and_arm(person: Person) -> tuple[NDArray[np.float64], float]:
    """(3,) midpoint of the shoulders and length of the arm from shoulder to hand [m]."""
    joints = person.joints()
    shoulder, elbow, hand = (joints[JOINT_IDX[f"l_{name}"]] for name in ("shoulder", "elbow", "hand"))
    middle = joints[[JOINT_IDX["r_shoulder"], JOINT_IDX["l_shoulder"]]].mean(axis=0)
    return middle, float(np.linalg.norm(elbow - shoulder) + np.linalg.norm(hand - elbow))


def _target(item: PlacedObject, anchor_name: str, grip: str) -> HandTarget:
    anchor = item.occluder.anchor(anchor_name)
    x, y, z = (item.T_world_object @ anchor.T_object_anchor)[:3, 3]
    diameter = {"diameter": float(anchor.size[0])} if grip == "handle" else {}
    return HandTarget((float(x), float(y), float(z)), grip, **diameter)  # type: ignore[arg-type]
