"""What whole scenes are drawn from: kinds of rooms, their sizes and surfaces, how many people and in which groups."""

import math
from dataclasses import asdict, dataclass, field

from storage.ranges import check_fields, check_number, check_span
from synth.vocabulary import MAX_PEOPLE, SURFACE_CLASSES

MAX_WEIGHT = 1e9
AREA_A_PERSON = 1.5
"""Floor that a person needs among furniture [m2]."""
SIDES: dict[str, tuple[tuple[float, float], tuple[float, float]]] = {
    "living": ((4.2, 7.0), (3.6, 5.5)),
    "office": ((5.0, 10.0), (4.2, 7.5)),
    "hall": ((10.0, 24.0), (8.0, 18.0)),
}
"""Ranges of length and width of each kind of room [m]; ours, from flats, small offices, and foyers."""
HEIGHTS: dict[str, tuple[float, float]] = {"living": (2.4, 2.8), "office": (2.5, 3.2), "hall": (3.5, 7.0)}
"""Ranges of the ceiling's height [m]; building codes ask for 2.4-2.5 m in rooms where people live and work."""


@dataclass(frozen=True)
class RoomWeights:
    """How often each kind of room is drawn. The weights are non-negative numbers; if all are zero there are no rooms.

    Attributes:
        living: Living rooms, with sofas, shelves, curtains and a table or two.
        office: Offices, with desks, screens, cabinets and boards.
        hall: Halls and foyers, with pillars and up to four walls, often none within sight.
    """

    living: float = 0.0
    office: float = 0.0
    hall: float = 0.0

    def __post_init__(self) -> None:
        for name, weight in asdict(self).items():
            check_number(f"room weight {name}", weight, 0.0, MAX_WEIGHT)


@dataclass(frozen=True)
class RoomConfig:
    """The rooms around the people. Without weights there are none, and every frame shows one person cut out.

    Attributes:
        kinds: Weights of the kinds of rooms.
        sides: Range of length and width of all rooms [m]. It replaces the ranges of the kinds.
        ceiling: Range of the height of all rooms [m]. It replaces the ranges of the kinds.
        furniture: How much of its furniture a room has, from 0 (bare) to 1.
        surfaces: Surfaces that give depth, of floor, wall, ceiling and background. Background is what belongs to
            the room and is neither table, chair, monitor, suitcase nor box: shelves, curtains, pillars, coat stands.
        frames_per_room: Largest average number of frames that show the same room.
    """

    kinds: RoomWeights = field(default_factory=RoomWeights)
    sides: tuple[float, float] | None = None
    ceiling: tuple[float, float] | None = None
    furniture: float = 1.0
    surfaces: tuple[str, ...] = SURFACE_CLASSES
    frames_per_room: int = 15

    def __post_init__(self) -> None:
        check_span("room sides", self.sides, 1.0, 60.0)
        check_span("room ceiling", self.ceiling, 2.0, 15.0)
        check_fields(self, {"furniture": (0.0, 1.0), "frames_per_room": (1, 60)})
        unknown = [name for name in self.surfaces if name not in SURFACE_CLASSES]
        if unknown:
            raise ValueError(f"surface {unknown[0]!r} is unknown; known are {', '.join(SURFACE_CLASSES)}")

    @property
    def is_on(self) -> bool:
        """Whether there are rooms at all."""
        return any(asdict(self.kinds).values())

    def sides_of(self, kind: str) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ranges of length and width of a kind of room [m]."""
        return SIDES[kind] if self.sides is None else (self.sides, self.sides)

    def ceiling_of(self, kind: str) -> tuple[float, float]:
        """Range of the height of a kind of room [m]."""
        return HEIGHTS[kind] if self.ceiling is None else self.ceiling

    def drawn_kinds(self) -> tuple[str, ...]:
        """The kinds with a weight."""
        return tuple(name for name, weight in asdict(self.kinds).items() if weight > 0.0)

    def holds(self, kind: str) -> int:
        """How many people fit into the largest room of a kind."""
        (_, length), (_, width) = self.sides_of(kind)
        return math.floor(length * width / AREA_A_PERSON)


@dataclass(frozen=True)
class GroupWeights:
    """How often people are in each kind of group. The weights are non-negative numbers and not all zero.

    Attributes:
        alone: One person, in a scene family of those that are drawn without rooms.
        facing: Two to four who stand and face each other.
        queue: Two to five who stand in a line.
        table: Two to six who sit at one table.
        passing: Two or three who walk past each other or side by side.
    """

    alone: float = 0.4
    facing: float = 0.2
    queue: float = 0.1
    table: float = 0.2
    passing: float = 0.1

    def __post_init__(self) -> None:
        weights = asdict(self)
        for name, weight in weights.items():
            check_number(f"group weight {name}", weight, 0.0, MAX_WEIGHT)
        if not sum(weights.values()) > 0.0:
            raise ValueError("at least one group weight must be positive")


@dataclass(frozen=True)
class PeopleConfig:
    """The people in a room.

    Attributes:
        number: Range of the number of people in a frame, 0 to 8; numbers from the range are equally frequent.
        groups: Weights of the kinds of groups. Who is left over is alone.
        visible: Range of the share of all their pixels that stay visible; it holds for the person seen best.
    """

    number: tuple[int, int] = (1, 1)
    groups: GroupWeights = field(default_factory=GroupWeights)
    visible: tuple[float, float] = (0.15, 1.0)

    def __post_init__(self) -> None:
        check_span("people number", self.number, 0, MAX_PEOPLE)
        check_span("people visible", self.visible, 0.0, 1.0)


def check_rooms(room: RoomConfig, people: PeopleConfig, distance: tuple[float, float] | None) -> None:
    """Refuses rooms, people and camera distances that contradict each other.

    Args:
        room: The rooms.
        people: The people.
        distance: Range of the distance from camera to person, if one is set [m].

    Raises:
        ValueError: Says which setting contradicts which.
    """
    if not room.is_on:
        if people != PeopleConfig():
            raise ValueError("people describes who is in a room; give room kinds too, such as room.kinds.living=1")
        return
    for kind in room.drawn_kinds():
        most = room.holds(kind)
        if most < people.number[1]:
            raise ValueError(
                f"people number={people.number} do not fit into a {kind} room of {room.sides_of(kind)[0]} by "
                f"{room.sides_of(kind)[1]} m: a person needs {AREA_A_PERSON} m2, so at most {most} do"
            )
        (_, length), (_, width) = room.sides_of(kind)
        if distance is not None and distance[0] >= math.hypot(length, width) - 1.0:
            raise ValueError(
                f"distance={distance} leaves the camera nobody to see: a {kind} room is at most {length} by {width} m"
            )
