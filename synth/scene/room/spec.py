"""RoomSpec: the shell of a room and what stands in it, as numbers that a frame can store."""

import json
import math
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from synth.scene.placement import pose_on_floor

N_WALLS = 4
"""The walls are numbered counter-clockwise seen from above: at +x, at +y, at -x, at -y."""
BEYOND = 25.0
"""Where a hall has no wall, its floor and ceiling go on so far beyond its sides [m]; no sensor sees farther."""
FILLINGS = ("open", "glass", "leaf")


@dataclass(frozen=True)
class Opening:
    """A door or a window in a wall.

    Attributes:
        wall: Number of the wall.
        at: Where its middle is along the wall, from the wall's middle [m].
        width: [m].
        bottom: Of its lower edge above the floor; 0 for doors [m].
        top: Of its upper edge above the floor [m].
        filling: "open" (a door that stands open), "glass" (a window; glass gives no return) or "leaf" (a shut door).
    """

    wall: int
    at: float
    width: float
    bottom: float
    top: float
    filling: str

    def __post_init__(self) -> None:
        if self.filling not in FILLINGS:
            raise ValueError(f"filling={self.filling!r} is unknown; known are {', '.join(FILLINGS)}")


@dataclass(frozen=True)
class Piece:
    """Something that stands or hangs in a room.

    Attributes:
        spec: What it is made from, with "kind".
        x: Where its origin is, room frame [m].
        y: See x.
        z: Height of its z = 0 above the floor: 0, or that of the table that it stands on [m].
        yaw: Turn about the vertical [rad].
        stands_on: Number of the piece that carries it; -1 for the floor or a wall.
    """

    spec: dict[str, object]
    x: float
    y: float
    z: float
    yaw: float
    stands_on: int = -1

    def pose(self) -> NDArray[np.float64]:
        """(4, 4) T_room_piece."""
        T = pose_on_floor(self.x, self.y, self.yaw)
        T[2, 3] = self.z
        return T


@dataclass(frozen=True)
class RoomSpec:
    """A room; its frame has the origin in the middle of the floor, x along its length, z up.

    Attributes:
        kind: "living", "office" or "hall".
        length: Between the inner faces of the walls at -x and +x [m].
        width: Between those at -y and +y [m].
        height: Of the ceiling [m].
        thickness: Of the walls [m].
        walls: Which of the four walls there are.
        openings: Doors and windows.
        pieces: Furniture and what else stands and hangs there.
    """

    kind: str
    length: float
    width: float
    height: float
    thickness: float
    walls: tuple[bool, bool, bool, bool]
    openings: tuple[Opening, ...] = ()
    pieces: tuple[Piece, ...] = ()

    def wall_length(self, wall: int) -> float:
        """Length of a wall between its corners [m]."""
        return self.width if wall % 2 == 0 else self.length

    def wall_pose(self, wall: int) -> NDArray[np.float64]:
        """(4, 4) T_room_wall: origin on the floor in the middle of its inner face, x into the room, y along it."""
        inward = (wall + 2) % N_WALLS * math.pi / 2
        half = 0.5 * (self.length if wall % 2 == 0 else self.width)
        return pose_on_floor(-half * math.cos(inward), -half * math.sin(inward), inward)

    def plain(self) -> dict[str, object]:
        """The fields as plain JSON values."""
        values: dict[str, object] = json.loads(json.dumps(asdict(self)))
        return values

    @staticmethod
    def from_plain(plain: dict) -> "RoomSpec":
        """The inverse of `plain`; lists become tuples.

        Raises:
            TypeError, KeyError, ValueError: It is none.
        """
        openings = tuple(Opening(**item) for item in plain["openings"])
        pieces = tuple(Piece(**item) for item in plain["pieces"])
        walls = tuple(map(bool, plain["walls"]))
        return RoomSpec(**plain | {"walls": walls, "openings": openings, "pieces": pieces})
