"""Turns an upright mesh of each class to its user and finds what they touch: tops, seats, keys, undersides."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.geometry import translation
from synth.occluders.furniture.laptop import KEY_PITCH
from synth.occluders.imported.levels import Level, find_level
from synth.occluders.imported.shape import MeshError, Triangles, sampled
from synth.occluders.imported.sizes import SIZES
from synth.occluders.model import Anchor

Array = NDArray[np.float64]

OBSTACLE = "obstacle"
"""Role of a model that nobody uses: it only stands in the way."""
SPACING = 0.004
"""Distance between the points that stand for a surface here [m]."""
KNEE_ROOM = (0.30, 0.22, 0.14, 0.58)
"""Free way from a table's edge, to either side of the middle, above and below these heights [m]."""
SEAT_AT_TABLE = (0.8, 1.0)
"""Seats that are deeper or wider than this as a whole are not for tables [m]."""
_DIRECTIONS = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
_DIAGONAL = np.sqrt(0.5) * np.array([[1.0, -1.0], [1.0, 1.0]])
"""An eighth of a turn."""


@dataclass(frozen=True)
class Fitted:
    """A mesh in the frame of an `Occluder`.

    Attributes:
        mesh: It, floor at z = 0, its user looking along x.
        role: The kind of procedural object that it can stand in for, or `OBSTACLE`.
        anchors: What people and things touch.
    """

    mesh: Triangles
    role: str
    anchors: tuple[Anchor, ...] = ()


def fitted(mesh: Triangles, class_name: str, forward: Array | None) -> Fitted:
    """Turns and shifts an upright mesh in metres as its class wants it.

    Args:
        mesh: z up.
        class_name: Its class.
        forward: (3,) direction that its user looks in; None to find it.

    Raises:
        MeshError: What the class needs is not there.
    """
    x, y = (0.5 * (mesh.vertices[:, k].min() + mesh.vertices[:, k].max()) for k in range(2))
    centred = mesh.shifted(-x, -y, -mesh.vertices[:, 2].min())
    given = None if forward is None else forward[:2] / np.linalg.norm(forward[:2])
    return _FITS[class_name](centred, given)


def _table(mesh: Triangles, forward: Array | None) -> Fitted:
    tries = [item for d in _directions(forward) if (item := _table_seen_along(mesh, d)) is not None]
    if not tries:
        return _thing(mesh, forward)
    if forward is None and all(item.role != "table" for item in tries) and tries[0].anchors[0].shape == "ellipse":
        diagonal = [_table_seen_along(mesh, _DIAGONAL @ d) for d in _directions(None)]
        tries += [item for item in diagonal if item is not None]
    return max(tries, key=lambda item: (item.role == "table", item.anchors[0].size[1] > item.anchors[0].size[0]))


def _table_seen_along(mesh: Triangles, forward: Array) -> Fitted | None:
    """A table whose user looks in a direction; None if it has no level top of 0.25 m a side."""
    turned = _facing(mesh, forward)
    level = _level(turned, "table", 0.012)
    if level is None or min(level.size) < 0.25:
        return None
    moved = turned.shifted(-level.centre[0], -level.centre[1], 0.0)
    height = float(level.centre[2])
    anchor = Anchor("top", translation(0.0, 0.0, height), level.size, level.shape)
    is_for_people = 0.62 <= height <= 0.85 and level.size[0] >= 0.4 and level.size[1] >= 0.55
    return Fitted(moved, "table" if is_for_people and _has_knee_room(moved, anchor) else OBSTACLE, (anchor,))


def _has_knee_room(mesh: Triangles, top: Anchor) -> bool:
    """Whether knees fit under a table's near edge, and its top reaches to that edge."""
    depth, half, low, high = KNEE_ROOM
    edge = -0.5 * top.size[0]
    points = sampled(mesh, 2.0 * SPACING)
    is_middle = (np.abs(points[:, 1]) < half) & (points[:, 2] > low)
    is_under = is_middle & (points[:, 0] < edge + depth) & (points[:, 2] < high)
    is_before = is_middle & (points[:, 0] < edge - 0.1)
    return not (is_under | is_before).any()


def _chair(mesh: Triangles, forward: Array | None) -> Fitted:
    level = _level(mesh, "chair", 0.045)
    if level is None or min(level.size) < 0.2:
        return _thing(mesh, forward)
    if forward is None:
        points = sampled(mesh, 2.0 * SPACING)
        above = points[points[:, 2] > level.centre[2] + 0.15]
        back = above[:, :2].mean(axis=0) - level.middle if len(above) else np.zeros(2)
        is_wide = level.size[0] > level.size[1]
        without_back = np.array((0.0, -1.0) if is_wide else (1.0, 0.0))
        forward = _nearest_axis(-back) if np.abs(back).max() > 0.04 else without_back
    turned = _facing(mesh, forward)
    level = _level(turned, "chair", 0.045)
    if level is None:
        raise MeshError("has no seat")  # cannot be: it was found before the turn
    is_for_tables = bool((np.ptp(turned.vertices[:, :2], axis=0) <= SEAT_AT_TABLE).all())
    anchor = Anchor("seat", translation(*level.centre), level.size)
    return Fitted(turned, "dining_chair" if is_for_tables else "sofa", (anchor,))


def _laptop(mesh: Triangles, forward: Array | None) -> Fitted:
    if forward is None:
        points = sampled(mesh, SPACING)
        height = float(points[:, 2].max())
        lean = points[points[:, 2] > 0.5 * height, :2].mean(axis=0) - points[points[:, 2] < 0.2 * height, :2].mean(
            axis=0
        )
        forward = _nearest_axis(lean)
    turned = _facing(mesh, forward)
    level = _level(turned, "laptop", 0.01)
    if level is None or level.size[0] < 0.12 or level.size[1] < 0.18:
        raise MeshError(f"has no level deck of 0.12 x 0.18 m between {_span('laptop')} m up")
    base, moved = _on_base(turned)
    x, y, z = level.centre + moved.vertices[0] - turned.vertices[0]
    x += 0.5 * level.size[0] - 0.035 - 2.5 * KEY_PITCH
    reach = 3.0 * KEY_PITCH * min(1.0, level.size[1] / 0.28)
    patch = (3.0 * KEY_PITCH, 4.0 * KEY_PITCH)
    keys = [
        Anchor(f"keyboard_{side}", translation(x, y + sign * reach, z), patch)
        for side, sign in (("left", 1.0), ("right", -1.0))
    ]
    return Fitted(moved, "laptop", (base, *keys))


def _monitor(mesh: Triangles, forward: Array | None) -> Fitted:
    if forward is None:
        points = sampled(mesh, SPACING)
        upper = points[points[:, 2] > 0.35 * points[:, 2].max()]
        is_deep = np.ptp(upper[:, 0]) > np.ptp(upper[:, 1])
        along = np.array((0.0, 1.0) if is_deep else (1.0, 0.0))
        forward = _screen_direction(points, upper, along)
    base, moved = _on_base(_facing(mesh, forward))
    if base.size[0] < 0.12 * moved.vertices[:, 2].max():
        raise MeshError(f"does not stand: its foot is only {base.size[0]:.2f} m deep")
    return Fitted(moved, "monitor", (base,))


def _screen_direction(points: Array, panel: Array, along: Array) -> Array:
    """Direction, along or against an axis, in which one looks at a screen: to its neck, or to its flatter side."""
    height = points[:, 2].max()
    neck = points[(points[:, 2] > 0.12 * height) & (points[:, 2] < 0.3 * height)]
    offset = float((neck[:, :2].mean(axis=0) - panel[:, :2].mean(axis=0)) @ along) if len(neck) else 0.0
    if abs(offset) > 0.02:
        return along if offset > 0.0 else -along
    return along if _flatness(panel, along) >= _flatness(panel, -along) else -along


def _flatness(points: Array, forward: Array) -> float:
    """Area [cells] of the flattest 1 cm of what is seen looking along a direction."""
    across = np.array((-forward[1], forward[0]))
    depth = points[:, :2] @ forward
    cells = np.floor(np.column_stack([points[:, :2] @ across, points[:, 2]]) / 0.01).astype(np.int64)
    cells -= cells.min(axis=0)
    front = np.full(cells.max(axis=0) + 1, np.inf)
    np.minimum.at(front, (cells[:, 0], cells[:, 1]), depth)
    seen = np.sort(front[np.isfinite(front)])
    within = np.searchsorted(seen, seen + 0.01, side="right") - np.arange(len(seen))
    return float(within.max())


def _on_base(mesh: Triangles) -> tuple[Anchor, Triangles]:
    """The underside that a thing stands on, and the mesh with its middle at the origin."""
    points = sampled(mesh, SPACING)
    foot = points[points[:, 2] < 0.012, :2]
    low, high = foot.min(axis=0), foot.max(axis=0)
    x, y = 0.5 * (low + high)
    size = (float(high[0] - low[0]), float(high[1] - low[1]))
    return Anchor("base", np.eye(4), size), mesh.shifted(-x, -y, 0.0)


def _stroller(mesh: Triangles, forward: Array | None) -> Fitted:
    """Its handle is where it reaches highest; nobody pushes it, because grips are not found."""
    if forward is None:
        points = sampled(mesh, 2.0 * SPACING)
        forward = _nearest_axis(-points[points[:, 2] > 0.85 * points[:, 2].max(), :2].mean(axis=0))
    return Fitted(_facing(mesh, forward), OBSTACLE)


def _thing(mesh: Triangles, forward: Array | None) -> Fitted:
    return Fitted(_facing(mesh, np.array((1.0, 0.0)) if forward is None else forward), OBSTACLE)


_FITS: dict[str, Callable[[Triangles, Array | None], Fitted]] = {
    "table": _table,
    "chair": _chair,
    "laptop": _laptop,
    "monitor": _monitor,
    "stroller": _stroller,
    "suitcase": _thing,
    "other": _thing,
}


def _level(mesh: Triangles, class_name: str, tolerance: float) -> Level | None:
    heights = SIZES[class_name].level
    assert heights is not None
    return find_level(sampled(mesh, SPACING), heights, tolerance)


def _span(class_name: str) -> str:
    heights = SIZES[class_name].level
    assert heights is not None
    return f"{heights[0]:g} and {heights[1]:g}"


def _directions(forward: Array | None) -> list[Array]:
    return [np.array(d) for d in _DIRECTIONS] if forward is None else [forward]


def _nearest_axis(direction: Array) -> Array:
    """(2,) the axis, with its sign, that a direction (2,) is nearest to."""
    return np.array(max(_DIRECTIONS, key=lambda axis: float(direction @ np.array(axis))))


def _facing(mesh: Triangles, forward: Array) -> Triangles:
    """The mesh turned about the vertical so that `forward` (2,) becomes x, its box's middle on the origin."""
    c, s = forward
    turned = mesh.turned(np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))
    x, y = (0.5 * (turned.vertices[:, k].min() + turned.vertices[:, k].max()) for k in range(2))
    return turned.shifted(-x, -y, 0.0)
