"""Tables pushed up to a person, and what stands on them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synth.geometry import inverse, transform_points, translation
from synth.occluders.model import Anchor
from synth.scene.draw import FOREARMS, Person, SceneDraw
from synth.scene.placement import PlacedObject, advance, pose_on_floor

TABLE_KINDS: tuple[str, ...] = ("table", "table", "desk")
"""Kinds that people sit at, in turn."""
START = 2.5
"""Objects that come up to a person start this far away [m]."""


def push_table_up(draw: SceneDraw, person: Person, are_arms_on_it: bool = True) -> PlacedObject | None:
    """Pushes a table towards a person from the front until the gap to their body is as drawn.

    Args:
        draw: The attempt.
        person: Who sits or stands there.
        are_arms_on_it: Whether forearms and hands do not count, because they are put on the table afterwards.
    """
    touching = FOREARMS if are_arms_on_it else frozenset[int]()
    start = pose_on_floor(START, float(draw.rng.normal(0.0, 0.12)), float(draw.rng.normal(0.0, 0.03)))
    table = replace(draw.place("table", start, TABLE_KINDS), contact_parts=touching)
    pushed = advance((table,), (-1.0, 0.0, 0.0), person.points_without(touching), draw.gap())
    return None if pushed is None else pushed[0]


def edge_depth(table: PlacedObject, y: float) -> float:
    """Distance of the table top's near edge before its centre, at y in the top's frame [m]."""
    top = table.occluder.anchor("top")
    half_x, half_y = 0.5 * top.size[0], 0.5 * top.size[1]
    if top.shape == "ellipse":
        share = np.clip(y / half_y, -0.95, 0.95)
        return float(half_x * np.sqrt(1.0 - share * share))
    return half_x


def stand_on_table(
    draw: SceneDraw,
    class_name: str,
    table: PlacedObject,
    table_idx: int,
    depth: tuple[float, float] = (0.05, 0.4),
    y: float = 0.0,
) -> PlacedObject | None:
    """Stands an object on a table, turned to who sits at it.

    Args:
        draw: The attempt.
        class_name: "laptop", "monitor" or "other".
        table: The table.
        table_idx: Its index among the scene's objects.
        depth: Range of the distance between the table's near edge and the object's [m].
        y: Where the object's middle is along the edge, in the top's frame [m].

    Returns:
        The object, or None if it would stick out over the table's border.
    """
    drawn = draw.place(class_name, np.eye(4))
    base, top = _base_of(drawn), table.occluder.anchor("top")
    x = -edge_depth(table, y) + float(draw.rng.uniform(*depth)) + 0.5 * base.size[0]
    T_top_base = pose_on_floor(x, y, float(draw.rng.normal(0.0, 0.05)))
    T_world_object = table.T_world_object @ top.T_object_anchor @ T_top_base @ inverse(base.T_object_anchor)
    placed = replace(drawn, T_world_object=T_world_object, contact_parts=FOREARMS, stands_on=table_idx)
    return placed if _is_carried(T_top_base, base, top) else None


def _base_of(item: PlacedObject) -> Anchor:
    """The underside of an object; of one without such an anchor, the rectangle round all of it."""
    if any(anchor.name == "base" for anchor in item.occluder.anchors):
        return item.occluder.anchor("base")
    low, high = item.surface[:, :2].min(axis=0), item.surface[:, :2].max(axis=0)
    x, y = 0.5 * (low + high)
    return Anchor("base", translation(float(x), float(y), 0.0), (float(high[0] - low[0]), float(high[1] - low[1])))


def _is_carried(T_top_base: NDArray[np.float64], base: Anchor, top: Anchor) -> bool:
    """Whether the corners of an object's base lie on the table's top."""
    half = 0.5 * np.array(base.size)
    corners = np.array([(sx * half[0], sy * half[1], 0.0) for sx in (-1, 1) for sy in (-1, 1)])
    on_top = transform_points(T_top_base, corners)[:, :2] / (0.5 * np.array(top.size))
    norms = np.linalg.norm(on_top, axis=1) if top.shape == "ellipse" else np.abs(on_top).max(axis=1)
    return bool((norms <= 1.0).all())
