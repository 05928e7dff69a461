"""Several people at one table: each pushed up to their side of it, with a seat and the hands on the top."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.poses.hands import HandTargets
from synth.geometry import inverse, transform_points
from synth.scene.bases import draw_arms_pose
from synth.scene.draw import FOREARMS, Person, Scene, SceneDraw
from synth.scene.families import draw_pose_family
from synth.scene.placement import Assembly, PlacedObject, advance, is_free_of, pose_on_floor
from synth.scene.seating import DESK_CHAIRS, seat_person
from synth.scene.soundness import OBJECT_OVERLAP, is_sound
from synth.scene.tables import START, TABLE_KINDS

PLACE = 0.68
"""Length of a table's side that one sitter needs [m]; planners of restaurants count 0.6-0.7 m."""
SLACK = 0.06
"""Standard deviation of a sitter's place along the side [m]."""
TRIES = 4
"""People tried on one place."""


@dataclass(frozen=True)
class Seated:
    """Someone at the table.

    Attributes:
        person: Sitting on their own origin, facing x.
        T_table_person: (4, 4).
        seat: Index of their seat among the objects; the table is number 0.
    """

    person: Person
    T_table_person: NDArray[np.float64]
    seat: int


@dataclass(frozen=True)
class _Place:
    """A place at a table.

    Attributes:
        turn: Turn of the sitter against the table's user [rad], a multiple of a right angle.
        along: Where it is along the side, from its middle, to the sitter's left [m].
    """

    turn: float
    along: float


def sit_round_table(draw: SceneDraw, n_people: int) -> tuple[tuple[Seated, ...], Assembly] | None:
    """Draws a table and people who sit at it.

    Args:
        draw: The attempt.
        n_people: How many.

    Returns:
        The people, and the table with its seats in the table's frame; None if they do not fit.
    """
    table = draw.place("table", np.eye(4), TABLE_KINDS)
    places = _places(table, draw.rng)
    if len(places) < n_people:
        return None
    seated: list[Seated] = []
    objects: Assembly = (table,)
    for place in places:
        for _ in range(TRIES):
            found = _sit_down(draw, objects, place)
            if found is not None and _is_apart(found[0], seated):
                person, seat = found
                seated.append(replace(person, seat=len(objects)))
                objects = (*objects, seat)
                break
        if len(seated) == n_people:
            return tuple(seated), objects
    return None


def _places(table: PlacedObject, rng: np.random.Generator) -> list[_Place]:
    """The places at a table, in the order in which people take them: a side of a desk, all sides of other tables."""
    top = table.occluder.anchor("top")
    along_x, along_y = top.size
    n_long = max(1, int(along_y / PLACE))
    spread = (np.arange(n_long) - (n_long - 1) / 2) * (along_y / n_long)
    long_sides = [_Place(turn, float(y)) for y in spread for turn in (0.0, np.pi)]
    if table.spec.get("kind") == "desk":
        return [place for place in long_sides if place.turn == 0.0]
    ends = [_Place(turn, 0.0) for turn in (np.pi / 2, -np.pi / 2)] if along_x >= PLACE else []
    rng.shuffle(long_sides)
    return long_sides + ends


def _sit_down(draw: SceneDraw, objects: Assembly, place: _Place) -> tuple[Seated, PlacedObject] | None:
    """One person and their seat at a place, clear of everything at the table."""
    subject = draw.subject(is_seated=True)
    pose_family = draw_pose_family(draw, "sitting", "table")
    found = seat_person(draw, subject, pose_family, DESK_CHAIRS)
    if found is None:
        return None
    person, seat = found
    y = -place.along + float(draw.rng.normal(0.0, SLACK))
    start = pose_on_floor(START, y, -place.turn)
    table = replace(objects[0], T_world_object=start, contact_parts=FOREARMS)
    pushed = advance((table,), (-1.0, 0.0, 0.0), person.points_without(FOREARMS), draw.gap())
    if pushed is None:
        return None
    arms = draw_arms_pose(draw, pose_family, subject.body, person.pose, _targets(pushed[0], place))
    if arms is None:
        return None
    person = Person.in_pose(subject, arms)
    T_person_table = pushed[0].T_world_object
    others = tuple(
        replace(
            item, T_world_object=T_person_table @ item.T_world_object, contact_parts=frozenset(), is_seat=False
        )
        for item in objects[1:]
    )
    is_clear = (
        is_sound(Scene("table", person, (seat, pushed[0])), draw.config.clearance)
        and is_free_of(seat, others, OBJECT_OVERLAP)
        and not any(item.is_nearer(person.vertices, draw.config.clearance[0]) for item in others)
    )
    if not is_clear:
        return None
    T_table_person = inverse(T_person_table)
    return Seated(person, T_table_person, -1), replace(seat, T_world_object=T_table_person @ seat.T_world_object)


def _targets(table: PlacedObject, place: _Place) -> HandTargets:
    """The table's top for the hands of a sitter whose side of it may be another than its user's."""
    top = table.occluder.anchor("top")
    x, y, z = (table.T_world_object @ top.T_object_anchor)[:3, 3]
    half_x, half_y = 0.5 * top.size[0], 0.5 * top.size[1]
    if abs(np.sin(place.turn)) > 0.5:
        half_x, half_y = half_y, half_x
    if top.shape == "ellipse":
        half_x, half_y = 0.97 * half_x, 0.6 * half_y
    return HandTargets(
        surface_height=float(z),
        surface=(float(x - half_x), float(x + half_x), float(y - half_y), float(y + half_y)),
    )


def _is_apart(one: Seated, others: list[Seated]) -> bool:
    """Whether the trunk of someone is not where another one's is: a first look before skins are compared."""
    at = transform_points(one.T_table_person, one.person.joints()[2])
    return all(
        np.linalg.norm(at - transform_points(other.T_table_person, other.person.joints()[2])) > 0.45
        for other in others
    )
