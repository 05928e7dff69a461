"""Seats a person: draws a sitting pose for a seat's height and puts the seat under it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.poses import draw_base, seat_contact
from synth.scene.draw import SEAT, Person, SceneDraw
from synth.scene.placement import FAR, PlacedObject, advance, pose_on_floor
from synth.scene.pools import Subject
from synth.vocabulary import PART

LOWER_LEGS = frozenset(PART[f"{side}{name}"] for side in "lr" for name in ("w_leg", "_knee", "_ankle", "_foot"))
"""Labels that the front of a seat must keep clear of."""
SEAT_MARGIN = 0.08
"""The sitting bones stay this far inside the seat's borders [m]."""
DESK_CHAIRS: tuple[str, ...] = ("dining_chair", "office_chair", "stool")
"""Chair kinds that people sit at tables on."""


def seat_person(
    draw: SceneDraw, subject: Subject, pose_family: str, kinds: tuple[str, ...] = ()
) -> tuple[Person, PlacedObject] | None:
    """Draws a seat and a sitting pose without arm contacts, and slides the seat under the person.

    Args:
        draw: The attempt.
        subject: Who sits.
        pose_family: A family whose posture is "sitting".
        kinds: Kinds of chairs to draw from; all if empty.

    Returns:
        The person and the seat, or None if they do not fit.
    """
    seat = draw.place("chair", pose_on_floor(0.0, 0.0, 0.0), kinds)
    surface = seat.occluder.anchor("seat")
    height = float(surface.T_object_anchor[2, 3])
    base = draw_base(pose_family, subject.body, draw.rng, seat_height=height)
    if base is None:
        return None
    person = Person.in_pose(subject, base)
    contact = seat_contact(subject.body, base)
    placed = _slide_under(draw, person, seat, contact)
    return None if placed is None else (person, placed)


def _slide_under(
    draw: SceneDraw, person: Person, seat: PlacedObject, contact: NDArray[np.float64]
) -> PlacedObject | None:
    """Pushes the seat forward until its back or its front edge meets the person."""
    surface = seat.occluder.anchor("seat")
    half_x = 0.5 * surface.size[0]
    half_y = max(0.0, 0.5 * surface.size[1] - 0.22)
    to_front = surface.T_object_anchor[0, 3] + half_x - SEAT_MARGIN
    sideways = float(draw.rng.uniform(-half_y, half_y))
    start = pose_on_floor(contact[0] - to_front, contact[1] - surface.T_object_anchor[1, 3] + sideways, 0.0)
    placed = replace(seat, T_world_object=start, contact_parts=SEAT, is_seat=True)
    above = person.vertices[:, 2] > surface.T_object_anchor[2, 3] + 0.08
    is_leg = np.isin(person.subject.vertex_part, list(LOWER_LEGS))
    obstacles = person.vertices[is_leg | (above & np.isin(person.subject.vertex_part, list(SEAT)))]
    travel = 2.0 * (half_x - SEAT_MARGIN)
    pushed = advance((placed,), (1.0, 0.0, 0.0), obstacles, draw.gap(), max_travel=travel)
    if pushed is not None:
        return pushed[0]
    if placed.gap(obstacles, FAR) < 0.0:
        return None
    centred = placed.moved((0.5 * travel, 0.0, 0.0))
    return centred if centred.gap(obstacles) >= 0.0 else None
