"""Seats a person: draws a sitting pose for a seat's height and puts the seat under it."""

from dataclasses import replace

import numpy as np

from synth.bodies.poses.sit import seat_depth_of, seat_height_of
from synth.occluders import registry
from synth.occluders.solids.sweep import free_way
from synth.scene.bases import draw_base_pose
from synth.scene.draw import SEAT, Person, SceneDraw
from synth.scene.placement import PlacedObject, pose_on_floor
from synth.scene.pools import Subject
from synth.vocabulary import PART

LOWER_LEGS = frozenset(PART[f"{side}{name}"] for side in "lr" for name in ("w_leg", "_knee", "_ankle", "_foot"))
"""Labels that the front of a seat must keep clear of."""
SEATS_TO_CHOOSE_FROM = 2
"""Seats drawn, of which the one that fits the legs best is taken: people do not sit anyhow."""
FORWARD = (1.0, 0.0, 0.0)
LEAST_SEAT = 0.05
"""A seat reaches at least this far before the hip joints [m]."""
LEG_GAP = 0.01
"""The front of a seat keeps this far from the calves [m]."""
CONTACT = 0.01
"""Skin and seat touch if they are within this of each other [m]."""
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
    fitting = seat_height_of(subject.body)
    kinds = kinds or registry.KINDS["chair"]
    drawn = [draw.place("chair", np.eye(4), kinds) for _ in range(SEATS_TO_CHOOSE_FROM)]
    seat = min(drawn, key=lambda item: abs(_seat_height(item) - fitting))
    height = _seat_height(seat)
    base = draw_base_pose(draw, pose_family, subject.body, height)
    if base is None:
        return None
    person = Person.in_pose(subject, base)
    placed = _slide_under(draw, person, seat)
    return None if placed is None else (person, placed)


def _seat_height(seat: PlacedObject) -> float:
    return float(seat.occluder.anchor("seat").T_object_anchor[2, 3])


def _slide_under(draw: SceneDraw, person: Person, seat: PlacedObject) -> PlacedObject | None:
    """Pushes the seat forward until its back meets the trunk, its front the legs, or it reaches far enough."""
    surface = seat.occluder.anchor("seat")
    centre, half_x = surface.T_object_anchor[:3, 3], 0.5 * surface.size[0]
    root = person.pose.T_world_root[:3, 3]
    slack = max(0.0, 0.5 * surface.size[1] - 0.22)
    y = root[1] - centre[1] + float(draw.rng.uniform(-slack, slack))
    T_world_start = pose_on_floor(root[0] + LEAST_SEAT - centre[0] - half_x, y, 0.0)
    start = replace(seat, T_world_object=T_world_start, contact_parts=SEAT, is_seat=True)
    travel = seat_depth_of(person.subject.body) - LEAST_SEAT
    is_above = person.vertices[:, 2] > centre[2] + 0.08
    is_trunk = person.is_of(SEAT) & is_above
    is_leg = person.is_of(LOWER_LEGS)
    trunk, legs = person.vertices[is_trunk], person.vertices[is_leg]
    ways = (
        free_way(start.solids, points, FORWARD, gap, travel)
        for points, gap in ((trunk, draw.gap()), (legs, LEG_GAP))
    )
    way = min(*ways, travel)
    placed = start.moved((way, 0.0, 0.0))
    return placed if way >= 0.0 and abs(placed.gap(person.points_of(SEAT), 2.0 * CONTACT)) < CONTACT else None
