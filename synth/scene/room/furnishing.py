"""A room that is being furnished: pieces are put along walls, before things or anywhere, where their boxes are free."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synth.geometry import transform_points
from synth.occluders.background import catalogue
from synth.occluders.kit.spec import Spec
from synth.scene.placement import pose_on_floor
from synth.scene.room.shell import box_of
from synth.scene.room.spec import N_WALLS, Piece, RoomSpec

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
