"""Puts a camera and groups of people into a room, each on floor that nothing else takes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.geometry import look_at, transform_points
from synth.render.presets import mounting_named
from synth.scene.config import SceneConfig
from synth.scene.placement import Assembly, pose_on_floor
from synth.scene.room.groups import Group, Member
from synth.scene.room.occupancy import Occupancy
from synth.scene.room.shell import BuiltRoom

EYE_ROOM = 0.25
"""The camera keeps this far from the room's furniture, beside what people keep [m]."""
PEOPLE_FROM_EYE = 0.7
"""Nobody, and nothing that belongs to them, is nearer to the camera than this, seen from above [m]."""
GROUP_ROOM = 0.2
"""Groups keep this far from each other, seen from above [m]."""
IN_VIEW_SHARE = 0.9
"""Share of the groups that are put where the camera looks."""
TRIES_IN_VIEW, TRIES_ANYWHERE = 40, 15
ALIGNED_SHARE = 0.7
"""Share of the groups with objects that are turned as the walls are."""
LEAST_VIEW = 1.5
"""The camera looks at a place that is at least so far away [m]."""
N_EYES, N_LOOKED_AT = 4, 160
"""Of so many cameras the one is taken that has the most of so many free places before it: most stand at a wall."""
AIM = (0.9, 0.25)
"""Mean and standard deviation of the height that the camera looks at [m]."""
HEAD_ROOM = 0.2
"""The camera stays this far below the ceiling [m]."""
WITHIN_VIEW = 0.42
"""Groups are put within this share of the horizontal field of view, on each side of its middle."""


@dataclass(frozen=True)
class Eye:
    """A camera in a room.

    Attributes:
        T_world_camera: (4, 4).
        heading: Direction of the optical axis seen from above [rad].
    """

    T_world_camera: NDArray[np.float64]
    heading: float

    @property
    def place(self) -> NDArray[np.float64]:
        """(2,) where it stands, seen from above [m]."""
        return self.T_world_camera[:2, 3]


@dataclass(frozen=True)
class PlacedPerson:
    """Somebody in a room.

    Attributes:
        member: Who, and how they sit or stand.
        T_world_person: (4, 4).
        group: Kind of their group.
        group_number: From 1.
        seat: Index of their seat among the people's objects; -1 if they have none.
    """

    member: Member
    T_world_person: NDArray[np.float64]
    group: str
    group_number: int
    seat: int

    def joints(self) -> NDArray[np.float64]:
        """(15, 3) joint centres, world frame [m]."""
        return transform_points(self.T_world_person, self.member.person.joints())


@dataclass(frozen=True)
class Gathering:
    """The people of a room and what belongs to them.

    Attributes:
        people: In order of number.
        objects: World frame; `stands_on` counts within them.
    """

    people: tuple[PlacedPerson, ...] = ()
    objects: Assembly = ()

    def with_group(self, group: Group, T_world_group: NDArray[np.float64]) -> "Gathering":
        """The gathering with a further group at a pose."""
        first = len(self.objects)
        number = 1 + max((one.group_number for one in self.people), default=0)
        people = tuple(
            PlacedPerson(
                member,
                T_world_group @ member.T_group_person,
                group.kind,
                number,
                member.seat + first if member.seat >= 0 else -1,
            )
            for member in group.members
        )
        objects = tuple(
            replace(
                item,
                T_world_object=T_world_group @ item.T_world_object,
                stands_on=item.stands_on + first if item.stands_on >= 0 else -1,
            )
            for item in group.objects
        )
        return Gathering((*self.people, *people), (*self.objects, *objects))


def draw_eye(
    config: SceneConfig, room: BuiltRoom, floor: Occupancy, camera: Camera, rng: np.random.Generator
) -> Eye | None:
    """Draws a camera that stands on free floor and looks across the room.

    Args:
        config: Mounting, and ranges that replace its own.
        room: The room.
        floor: What is taken of it.
        camera: Its field of view.
        rng: Source of randomness.

    Returns:
        The camera, or None if the room has too little free floor for one.
    """
    free = floor.draw_free(N_LOOKED_AT, rng)
    best, most = None, -1
    n_found = 0
    for place, target in zip(free[0::2], free[1::2], strict=False):
        view = target - place
        if np.hypot(*view) < LEAST_VIEW or not floor.is_free(_ring(place, EYE_ROOM)):
            continue
        heading = float(np.arctan2(view[1], view[0]))
        n_before = _count_before(free, place, heading, distance_range(config), half_view(camera))
        if n_before > most:
            best, most = (place, heading), n_before
        n_found += 1
        if n_found == N_EYES:
            break
    return None if best is None else _eye_at(*best, config, room, rng)


def distance_range(config: SceneConfig) -> tuple[float, float]:
    """Range of the distance from the camera to people [m]."""
    return config.distance or mounting_named(config.mounting).distance


def half_view(camera: Camera) -> float:
    """How far to each side of the camera's heading people are put [rad]."""
    return float(np.arctan2(0.5 * camera.width, camera.fx) * 2.0 * WITHIN_VIEW)


def _count_before(
    places: NDArray[np.float64],
    eye: NDArray[np.float64],
    heading: float,
    distance: tuple[float, float],
    half: float,
) -> int:
    """How many of places (n, 2) lie before a camera, where people are put."""
    way = places - eye
    turn = (np.arctan2(way[:, 1], way[:, 0]) - heading + np.pi) % (2.0 * np.pi) - np.pi
    length = np.hypot(way[:, 0], way[:, 1])
    return int(np.count_nonzero((np.abs(turn) < half) & (length >= distance[0]) & (length <= distance[1])))


def _eye_at(
    place: NDArray[np.float64], heading: float, config: SceneConfig, room: BuiltRoom, rng: np.random.Generator
) -> Eye:
    """A camera at a place (2,) [m] that looks along a heading [rad], with height, pitch and roll drawn."""
    mounting = mounting_named(config.mounting)
    low, high = config.height or mounting.height
    top = room.spec.height - HEAD_ROOM
    height = float(rng.uniform(min(low, top), min(high, top)))
    distance = float(rng.uniform(*distance_range(config)))
    pitch = float(np.clip(np.arctan2(height - rng.normal(*AIM), distance), *mounting.pitch))
    roll = float(np.clip(rng.normal(0.0, 0.02), -0.05, 0.05))
    eye = np.array([place[0], place[1], height])
    target = eye + np.array([np.cos(heading), np.sin(heading), -np.tan(pitch)])
    return Eye(look_at(eye, target, roll), heading)


def gather(
    groups: Sequence[Group],
    floor: Occupancy,
    eye: Eye,
    camera: Camera,
    distance: tuple[float, float],
    rng: np.random.Generator,
) -> Gathering | None:
    """Puts groups into a room.

    Args:
        groups: The groups, from the first that is put there to the last.
        floor: What is taken; changed.
        eye: The camera, which most groups stand before.
        camera: Its field of view.
        distance: Range of a group's distance from the camera [m].
        rng: Source of randomness.

    Returns:
        The people, or None if a group finds no place.
    """
    floor.take(eye.place[None], PEOPLE_FROM_EYE)
    gathering = Gathering()
    for group in groups:
        T = _find_place(group.prints, bool(group.objects), floor, eye, camera, distance, rng)
        if T is None:
            return None
        gathering = gathering.with_group(group, T)
        floor.take(group.prints @ T[:2, :2].T + T[:2, 3], GROUP_ROOM)
    return gathering


def _find_place(
    prints: NDArray[np.float64],
    has_objects: bool,
    floor: Occupancy,
    eye: Eye,
    camera: Camera,
    distance: tuple[float, float],
    rng: np.random.Generator,
) -> NDArray[np.float64] | None:
    """A pose of a group on free floor, before the camera if it can be; `prints` (n, 2) is the floor under it [m]."""
    middle = 0.5 * (prints.min(axis=0) + prints.max(axis=0))
    half = half_view(camera)
    is_in_view = rng.random() < IN_VIEW_SHARE
    for attempt in range((TRIES_IN_VIEW if is_in_view else 0) + TRIES_ANYWHERE):
        if is_in_view and attempt < TRIES_IN_VIEW:
            bearing = eye.heading + float(rng.uniform(-half, half))
            way = float(rng.uniform(*distance))
            at = eye.place + way * np.array([np.cos(bearing), np.sin(bearing)])
        else:
            drawn = floor.draw_free(1, rng)
            if not len(drawn):
                return None
            at = drawn[0]
        yaw = float(rng.uniform(-np.pi, np.pi))
        if has_objects and rng.random() < ALIGNED_SHARE:
            yaw = float(np.round(yaw / (np.pi / 2)) * np.pi / 2 + rng.normal(0.0, 0.03))
        T = pose_on_floor(0.0, 0.0, yaw)
        T[:2, 3] = at - T[:2, :2] @ middle
        if floor.is_free(prints @ T[:2, :2].T + T[:2, 3]):
            return T
    return None


def _ring(place: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """(n, 2) a place and points round it."""
    bearing = np.arange(8) * (np.pi / 4)
    return np.concatenate([place[None], place + radius * np.stack([np.cos(bearing), np.sin(bearing)], axis=1)])
