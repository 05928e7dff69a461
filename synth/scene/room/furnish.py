"""Draws rooms: sides, doors and windows, then the furniture of each kind of room."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from synth.occluders.background import catalogue
from synth.occluders.background.hanging import CurtainSpec, RadiatorSpec
from synth.occluders.background.standing import PillarSpec
from synth.occluders.furniture.sofa import SofaSpec
from synth.scene.placement import pose_on_floor
from synth.scene.room.config import RoomConfig
from synth.scene.room.furnishing import Furnishing
from synth.scene.room.openings import draw_openings
from synth.scene.room.shell import box_of
from synth.scene.room.spec import N_WALLS, RoomSpec


def sample_room(kind: str, config: RoomConfig, rng: np.random.Generator) -> RoomSpec:
    """Draws a room with its furniture.

    Args:
        kind: "living", "office" or "hall".
        config: Ranges of sizes, and how much furniture there is.
        rng: Source of randomness.
    """
    length_range, width_range = config.sides_of(kind)
    walls = (True, True, True, True)
    if kind == "hall":
        is_there = rng.random(N_WALLS) < float(rng.choice((0.0, 0.4, 0.75, 1.0)))
        walls = (bool(is_there[0]), bool(is_there[1]), bool(is_there[2]), bool(is_there[3]))
    spec = RoomSpec(
        kind=kind,
        length=round(float(rng.uniform(*length_range)), 3),
        width=round(float(rng.uniform(*width_range)), 3),
        height=round(float(rng.uniform(*config.ceiling_of(kind))), 3),
        thickness=round(float(rng.uniform(0.12, 0.3)), 3),
        walls=walls,
    )
    spec = replace(spec, openings=draw_openings(spec, rng))
    room = Furnishing(spec, rng)
    for put in FURNITURE[kind]:
        if rng.random() < config.furniture:
            put(room)
    return room.spec


def _curtains(room: Furnishing) -> None:
    """Curtains on both sides of each window, or on one; a few are drawn."""
    for item in room.spec.openings:
        if item.filling != "glass" or not room.chance(0.8):
            continue
        drawn = room.draw("curtain")
        assert isinstance(drawn, CurtainSpec)
        is_shut = room.chance(0.2)
        width = item.width / 2 + 0.15 if is_shut else drawn.width
        made = replace(drawn, width=width, top=min(item.top + 0.12, room.spec.height - 0.04))
        for side in (-1, 1):
            y = item.at + side * (item.width / 2 + (0.1 - width / 2 if is_shut else 0.15 - width / 4))
            T = room.spec.wall_pose(item.wall) @ pose_on_floor(0.08 + made.swing, y, 0.0)
            room.add(made, T, 0.005, is_before_window=True)


def _radiators(room: Furnishing) -> None:
    """A radiator under most windows."""
    for item in room.spec.openings:
        if item.filling == "glass" and item.bottom > 0.7 and room.chance(0.7):
            drawn = room.draw("radiator")
            assert isinstance(drawn, RadiatorSpec)
            made = replace(drawn, width=round(min(drawn.width, item.width), 4))
            T = room.spec.wall_pose(item.wall) @ pose_on_floor(made.depth / 2, item.at, 0.0)
            room.add(made, T, 0.005, is_before_window=True)


def _panels(room: Furnishing) -> None:
    """Pictures and boards flat on the walls."""
    for _ in range(room.count(1, 4)):
        room.along_wall(room.draw("panel"), (0.0, 0.0))


def _sofas(room: Furnishing) -> None:
    """A sofa or two along the walls, a low table before the first."""
    for k in range(room.count(1, 2)):
        number = room.along_wall(room.draw("sofa"), (0.02, 0.12))
        if number is not None and k == 0 and room.chance(0.7):
            _table_before(room, number)


def _table_before(room: Furnishing, sofa: int) -> None:
    """A coffee table before a sofa, at the distance at which it is reached."""
    front = box_of(catalogue.from_plain(room.spec.pieces[sofa].spec))[:, 0].max()
    made = room.draw("coffee_table")
    half = -box_of(made)[:, 0].min()
    x = float(front + half) + float(room.rng.uniform(0.3, 0.45))
    room.add(made, room.spec.pieces[sofa].pose() @ pose_on_floor(x, float(room.rng.normal(0.0, 0.1)), 0.0))


def _armchair(room: Furnishing) -> None:
    """An armchair, turned to the middle of the room or so."""
    drawn = room.draw("sofa")
    assert isinstance(drawn, SofaSpec)
    if room.chance(0.6):
        room.somewhere(replace(drawn, n_seats=1), 0.15)


def _along(
    kind: str, least: int, most: int, gap: tuple[float, float] = (0.01, 0.05)
) -> Callable[[Furnishing], None]:
    """Pieces of a kind with their backs to the walls."""

    def put(room: Furnishing) -> None:
        for _ in range(room.count(least, most)):
            room.along_wall(room.draw(kind), gap)

    return put


def _about(kind: str, least: int, most: int) -> Callable[[Furnishing], None]:
    """Pieces of a kind anywhere on the floor."""

    def put(room: Furnishing) -> None:
        for _ in range(room.count(least, most)):
            room.somewhere(room.draw(kind))

    return put


def _dining(room: Furnishing) -> None:
    """A table in the room with chairs round it, pulled out a little."""
    table = room.draw("table")
    number = room.somewhere(table, 0.3, is_turned=False)
    if number is None:
        return
    extent = np.abs(box_of(table)[:, :2]).max(axis=0)
    chair = room.draw("dining_chair")
    for side in range(4):
        if not room.chance(0.75):
            continue
        reach = float(extent[side % 2]) - float(box_of(chair)[:, 0].min())
        away = pose_on_floor(
            reach + float(room.rng.uniform(0.03, 0.3)), float(room.rng.normal(0.0, 0.05)), math.pi
        )
        T = room.spec.pieces[number].pose() @ pose_on_floor(0.0, 0.0, side * math.pi / 2) @ away
        room.add(chair, T @ pose_on_floor(0.0, 0.0, float(room.rng.normal(0.0, 0.15))), 0.01)


def _workplaces(room: Furnishing) -> None:
    """Desks, most of them at a wall, all alike, with a screen on them and a chair before them."""
    desk, screen, chair = room.draw("desk"), room.draw("monitor"), room.draw("office_chair")
    for _ in range(room.count(2, 5)):
        if room.chance(0.6):
            number = room.along_wall(desk, (0.02, 0.08), turn=math.pi)
        else:
            number = room.somewhere(desk, 0.15, is_turned=False)
        if number is None:
            continue
        extent = np.abs(box_of(desk)).max(axis=0)
        half = np.abs(box_of(screen)[:, :2]).max(axis=0)
        slack = extent[:2] - half - 0.02
        if (slack > 0.0).all():
            x = float(np.clip(room.rng.uniform(0.0, 0.2), 0.0, slack[0]))
            y = float(np.clip(room.rng.normal(0.0, 0.15), -slack[1], slack[1]))
            room.put_on(screen, number, x, y, float(extent[2]), 0.0)
        reach = float(extent[0] + box_of(chair)[:, 0].max())
        x = -reach - float(room.rng.uniform(0.02, 0.3))
        T = room.spec.pieces[number].pose() @ pose_on_floor(x, float(room.rng.normal(0.0, 0.1)), 0.0)
        room.add(chair, T @ pose_on_floor(0.0, 0.0, float(room.rng.normal(0.0, 0.5))), 0.01)


def _pillars(room: Furnishing) -> None:
    """Pillars in a grid of 4 to 7 m, all alike; in an office at most one."""
    drawn = room.draw("pillar")
    assert isinstance(drawn, PillarSpec)
    made = replace(drawn, height=round(room.spec.height - 0.001, 4))
    if room.spec.kind != "hall":
        if room.chance(0.3):
            room.somewhere(made, 0.3, is_turned=False)
        return
    step = float(room.rng.uniform(4.0, 7.0))
    n_x, n_y = max(1, int(room.spec.length / step)), max(1, int(room.spec.width / step))
    for x in (np.arange(n_x) - (n_x - 1) / 2) * step:
        for y in (np.arange(n_y) - (n_y - 1) / 2) * step:
            room.add(made, pose_on_floor(float(x), float(y), 0.0), 0.1)


FURNITURE: dict[str, tuple[Callable[[Furnishing], None], ...]] = {
    "living": (
        _radiators, _curtains, _sofas, _along("cabinet", 0, 2), _along("shelf", 1, 2), _dining, _armchair,
        _panels, _along("floor_lamp", 0, 1, (0.03, 0.15)), _along("plant", 0, 2, (0.03, 0.1)),
        _along("coat_stand", 0, 1, (0.05, 0.2)), _about("boxes", 0, 1),
    ),
    "office": (
        _radiators, _pillars, _workplaces, _along("cabinet", 1, 3), _along("shelf", 0, 2), _panels, _dining,
        _along("coat_stand", 0, 1, (0.05, 0.2)), _along("plant", 0, 2, (0.03, 0.1)),
        _along("bin", 1, 2, (0.03, 0.2)), _about("boxes", 0, 1),
    ),
    "hall": (
        _pillars, _along("sofa", 0, 3, (0.03, 0.2)), _along("plant", 0, 3, (0.05, 0.3)), _panels, _dining, _dining,
        _along("cabinet", 0, 1), _about("suitcase", 0, 3), _about("plant", 0, 2), _about("bin", 0, 2),
        _about("coat_stand", 0, 1), _about("sofa", 0, 2),
    ),
}  # fmt: skip
"""What is put into each kind of room, in this order."""
