"""Draws rooms: sides, doors and windows, then furniture that stands along the walls, in corners and about the floor."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synth.geometry import transform_points
from synth.occluders.background import catalogue
from synth.occluders.background.hanging import CurtainSpec, RadiatorSpec
from synth.occluders.background.standing import PillarSpec
from synth.occluders.furniture.sofa import SofaSpec
from synth.occluders.kit.spec import Spec
from synth.scene.placement import pose_on_floor
from synth.scene.room.config import RoomConfig
from synth.scene.room.shell import box_of
from synth.scene.room.spec import N_WALLS, Opening, Piece, RoomSpec

TRIES = 12
"""Places tried for one piece before the room does without it."""
GAP = 0.02
"""Pieces keep this far from each other [m]."""
DOOR_ROOM = 0.9
"""No furniture stands so far before a door [m]."""
SILL_ROOM = 0.3
"""What stands this far before a window, but for curtains and radiators, is lower than its sill [m]."""

Box = tuple[NDArray[np.float64], NDArray[np.float64]]


class Furnishing:
    """A room that is being furnished: its spec so far, and the boxes that are taken.

    Args:
        spec: The shell, with its openings.
        rng: Source of randomness.
    """

    def __init__(self, spec: RoomSpec, rng: np.random.Generator) -> None:
        self.spec = spec
        self.rng = rng
        self._taken: list[Box] = []
        for item in spec.openings:
            reach = SILL_ROOM if item.filling == "glass" else DOOR_ROOM
            corners = np.array([(x, item.at + s * item.width / 2, 0.0) for x in (0.0, reach) for s in (-1, 1)])
            placed = transform_points(spec.wall_pose(item.wall), corners)
            low, high = placed.min(axis=0), placed.max(axis=0)
            low[2], high[2] = item.bottom, item.top
            self._taken.append((low, high))

    def add(
        self, made: Spec, T: NDArray[np.float64], gap: float = GAP, is_before_window: bool = False
    ) -> int | None:
        """Puts a piece at a pose if its box is free and inside the walls.

        Args:
            made: What it is.
            T: (4, 4) T_room_piece, turned about the vertical.
            gap: To all other boxes [m].
            is_before_window: Whether it may hang or stand before windows.

        Returns:
            Its number among the room's pieces; None if it does not fit.
        """
        vertices = transform_points(T, box_of(made))
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        half = np.array([self.spec.length, self.spec.width]) / 2
        if (low[:2] < -half).any() or (high[:2] > half).any() or high[2] > self.spec.height:
            return None
        n_openings = len(self.spec.openings)
        for k, (other_low, other_high) in enumerate(self._taken):
            if is_before_window and k < n_openings and self.spec.openings[k].filling == "glass":
                continue
            if ((low < other_high + gap) & (high > other_low - gap)).all():
                return None
        self._taken.append((low, high))
        return self._keep(made, T)

    def put_on(self, made: Spec, carrier: int, x: float, y: float, z: float, yaw: float) -> None:
        """Stands a piece on another one, at a place in that one's frame; it must be known to fit there."""
        T = self.spec.pieces[carrier].pose() @ pose_on_floor(x, y, yaw)
        T[2, 3] += z
        self._keep(made, T, carrier)

    def _keep(self, made: Spec, T: NDArray[np.float64], stands_on: int = -1) -> int:
        yaw = math.atan2(T[1, 0], T[0, 0])
        piece = Piece(catalogue.to_plain(made), float(T[0, 3]), float(T[1, 3]), float(T[2, 3]), yaw, stands_on)
        self.spec = replace(self.spec, pieces=(*self.spec.pieces, piece))
        return len(self.spec.pieces) - 1

    def along_wall(self, made: Spec, gap: tuple[float, float] = (0.01, 0.05), turn: float = 0.0) -> int | None:
        """Stands a piece with its back, or another side, to some wall.

        Args:
            made: What it is.
            gap: Range of the gap to the wall [m].
            turn: How the piece is turned from looking into the room [rad], a multiple of a right angle.
        """
        walls = [k for k in range(N_WALLS) if self.spec.walls[k]]
        vertices = transform_points(pose_on_floor(0.0, 0.0, turn), box_of(made))
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        for _ in range(TRIES if walls else 0):
            wall = walls[int(self.rng.integers(len(walls)))]
            half = self.spec.wall_length(wall) / 2
            if high[1] - low[1] > 2 * half - 0.1:
                continue
            y = float(self.rng.uniform(-half + 0.03 - low[1], half - 0.03 - high[1]))
            x = float(self.rng.uniform(*gap)) - low[0]
            number = self.add(made, self.spec.wall_pose(wall) @ pose_on_floor(float(x), y, turn))
            if number is not None:
                return number
        return None

    def somewhere(self, made: Spec, room: float = 0.1, is_turned: bool = True) -> int | None:
        """Stands a piece anywhere on the floor, turned at random or to the walls."""
        for _ in range(TRIES):
            x = float(self.rng.uniform(-0.5, 0.5)) * self.spec.length
            y = float(self.rng.uniform(-0.5, 0.5)) * self.spec.width
            quarter = int(self.rng.integers(4)) * math.pi / 2
            yaw = float(self.rng.uniform(-math.pi, math.pi)) if is_turned else quarter
            number = self.add(made, pose_on_floor(x, y, yaw), room)
            if number is not None:
                return number
        return None

    def draw(self, kind: str) -> Spec:
        """Draws a spec of a kind."""
        return catalogue.sample(kind, self.rng)

    def chance(self, share: float) -> bool:
        """True with a probability."""
        return bool(self.rng.random() < share)

    def count(self, least: int, most: int) -> int:
        """A number from a range, its ends included."""
        return int(self.rng.integers(least, most + 1))


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


def draw_openings(spec: RoomSpec, rng: np.random.Generator) -> tuple[Opening, ...]:
    """Doors of 0.8-1.0 m by 2.0-2.1 m (twice as wide in halls), windows with sills of 0.75-1.0 m; sizes are common."""
    walls = [k for k in range(N_WALLS) if spec.walls[k]]
    openings: list[Opening] = []
    n_doors = int(rng.integers(1, 3)) if walls else 0
    for _ in range(n_doors):
        wide = float(rng.uniform(0.8, 1.0)) * (2.0 if spec.kind == "hall" else 1.0)
        filling = "open" if rng.random() < 0.4 else "leaf"
        top = min(float(rng.uniform(2.0, 2.1)), spec.height - 0.1)
        _add_opening(spec, openings, walls[int(rng.integers(len(walls)))], wide, (0.0, top), filling, rng)
    if not walls:
        return ()
    lit = walls[int(rng.integers(len(walls)))]
    n_windows = int(rng.integers(1, {"living": 3, "office": 4, "hall": 5}[spec.kind]))
    for _ in range(n_windows):
        sill = float(rng.uniform(0.75, 1.0)) if rng.random() < 0.85 else float(rng.uniform(0.02, 0.1))
        top = min(float(rng.uniform(2.05, 2.3)), spec.height - 0.12)
        if top - sill >= 0.6:
            _add_opening(spec, openings, lit, float(rng.uniform(0.8, 2.0)), (sill, top), "glass", rng)
    return tuple(openings)


def _add_opening(
    spec: RoomSpec,
    openings: list[Opening],
    wall: int,
    width: float,
    z: tuple[float, float],
    filling: str,
    rng: np.random.Generator,
) -> None:
    """Adds an opening to the list if the wall has room for it between those that it has."""
    half = spec.wall_length(wall) / 2 - width / 2 - 0.15
    for _ in range(TRIES if half > 0.0 else 0):
        at = float(rng.uniform(-half, half))
        others = [item for item in openings if item.wall == wall]
        if all(abs(at - item.at) > (width + item.width) / 2 + 0.25 for item in others):
            openings.append(Opening(wall, round(at, 3), round(width, 3), round(z[0], 3), round(z[1], 3), filling))
            return


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
