"""People of clips who push a stroller along: the hands stay on its handle, it stays on the floor before them."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Pose
from synth.bodies.motion.hold import hand_in, held
from synth.bodies.motion.record import Motion
from synth.scene.bases import draw_base_pose
from synth.scene.clips.actors import Actor
from synth.scene.clips.routes import Router
from synth.scene.contacts import push_stroller
from synth.scene.draw import FOREARMS, UPPER_ARMS, Person, SceneDraw
from synth.scene.families import draw_pose_family
from synth.scene.placement import PlacedObject, pose_on_floor
from synth.scene.pools import Subject
from synth.scene.room.occupancy import footprint

ACT = "push"
PUSHING_SPEED = 0.85
"""Pushing, people walk at this share of their usual speed."""
ON_HANDLE = 0.12
"""A hand whose palm is nearer than this to the handle's end holds it [m]."""
MOST_MISSED = 0.015
"""Hands are nearer than this to where they hold [m]."""
MOST_OVERLAP = 0.01
"""Legs and trunk are no deeper in the stroller [m]."""
APART = 0.75
"""Other people's hips are never nearer to the middle of the stroller, seen from above [m]."""
FROM_EYE = 1.1
"""The middle of the stroller is never nearer to the first camera, likewise [m]."""
LOOKED_AT = 0.15
"""It is looked for room so often [s]."""


@dataclass(frozen=True)
class Pushing:
    """How somebody holds a stroller, person frame.

    Attributes:
        pose: Of the person.
        item: The stroller.
        T_item_hand: (4, 4) of each hand that holds it, by side.
    """

    pose: Pose
    item: PlacedObject
    T_item_hand: dict[str, NDArray[np.float64]]


def draw_pushing(draw: SceneDraw, subject: Subject) -> Pushing | None:
    """Draws a stroller and how a person holds it; None if it does not fit."""
    family = draw_pose_family(draw, "standing", "stroller")
    base = draw_base_pose(draw, family, subject.body)
    pushed = None if base is None else push_stroller(draw, Person.in_pose(subject, base), family)
    if pushed is None:
        return None
    person, item = pushed
    T_item_person = np.linalg.inv(item.T_world_object)
    ends = [
        item.T_world_object @ item.occluder.anchor(f"handle_{name}").T_object_anchor for name in ("left", "right")
    ]
    bar = np.stack([T[:3, 3] for T in ends])
    hands = {}
    for side in "lr":
        T = hand_in(subject.body, person.pose.angles, person.pose.T_world_root, side)
        if np.linalg.norm(bar - T[:3, 3], axis=1).min() < ON_HANDLE + 0.08:
            hands[side] = T_item_person @ T
    return Pushing(person.pose, item, hands) if hands else None


def pushed(actor: Actor, pushing: Pushing, ways: NDArray[np.float64], open_floor: Router) -> Actor | None:
    """Somebody who walks, with a stroller before them; None where it has no room or the hands do not reach.

    Args:
        actor: Who walks, arms anyhow.
        pushing: How they hold it.
        ways: (n, 3) x, y [m] and heading [rad] of the body over the floor, world.
        open_floor: What is free for a stroller.
    """
    T_person = np.array([pose_on_floor(float(x), float(y), float(yaw)) for x, y, yaw in ways])
    T_items = T_person @ pushing.item.T_world_object
    stride = max(1, round(LOOKED_AT * actor.motion.rate))
    for T in T_items[::stride]:
        if not open_floor.floor.is_free(footprint(replace(pushing.item, T_world_object=T).world_surface())):
            return None
    body = actor.subject.body
    motion, missed = held(actor.motion, body, pushing.pose.angles, T_items, pushing.T_item_hand)
    if missed > MOST_MISSED or _overlaps(actor.subject, motion, pushing.item, T_items, stride):
        return None
    return replace(actor, motion=motion, item=pushing.item, T_items=T_items)


def _overlaps(
    subject: Subject, motion: Motion, item: PlacedObject, T_items: NDArray[np.float64], stride: int
) -> bool:
    for k in range(0, len(motion), stride):
        points = Person.in_pose(subject, motion.pose(k)).points_without(FOREARMS | UPPER_ARMS)
        if replace(item, T_world_object=T_items[k]).is_nearer(points, -MOST_OVERLAP):
            return True
    return False


def keeps_from_eye(actor: Actor, track: NDArray[np.float64], stride: int) -> bool:
    """Whether the stroller of an actor keeps from a camera (n_steps, 4, 4) that stands or moves."""
    assert actor.T_items is not None
    middle = actor.T_items[:, :2, 3][::stride][: len(track)]
    return bool(np.hypot(*(middle - track[:, :2, 3]).T).min() >= FROM_EYE)


def keeps_from(actor: Actor, others: Iterable[Actor], n: int, stride: int) -> bool:
    """Whether the stroller of an actor keeps from other people, and theirs from them, at n time steps."""
    pairs = [(a, b) for other in others for a, b in ((actor, other), (other, actor)) if a.T_items is not None]
    for pusher, other in pairs:
        assert pusher.T_items is not None
        middle = pusher.T_items[:, :2, 3][::stride][:n]
        if np.hypot(*(middle - other.places()[::stride][:n]).T).min() < APART:
            return False
    return True
