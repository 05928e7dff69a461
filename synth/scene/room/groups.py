"""Groups of people, each with what belongs to them, before they are put into a room."""

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from synth.bodies.poses.families import families_for
from synth.bodies.poses.stand import stand_upright, walk
from synth.geometry import extent, thinned, transform_points, within
from synth.scene.bases import draw_arms_pose, draw_base_pose
from synth.scene.draw import Person, Scene, SceneDraw
from synth.scene.families import SCENE_FAMILIES, draw_scene_family
from synth.scene.placement import Assembly, pose_on_floor
from synth.scene.room.occupancy import footprint
from synth.scene.room.tables import sit_round_table
from synth.scene.soundness import MAX_BELOW_FLOOR, is_sound

PERSON_GAP = 0.05
"""Skins of two people of one group keep this far apart [m]."""
SKIN_SPACING = 0.02
"""Distance between the points that stand for a skin [m]."""
FACING = (0.75, 1.3)
"""Range of the distance between neighbours who face each other [m]: Hall's personal distance (1966), 0.45-1.2 m."""
QUEUE = (0.55, 0.95)
"""Range of the distance between people in a queue [m]; ours."""
ASIDE = (0.75, 1.2)
"""Range of the distance across of people who pass each other or walk side by side [m]; ours."""


@dataclass(frozen=True)
class Member:
    """One person of a group.

    Attributes:
        person: Standing on their own origin, facing x.
        T_group_person: (4, 4).
        activity: Scene family of who is alone; else the group's kind.
        seat: Index of their seat among the group's objects; -1 if they have none.
    """

    person: Person
    T_group_person: NDArray[np.float64]
    activity: str
    seat: int = -1

    def points(self) -> NDArray[np.float64]:
        """(n, 3) vertices of the skin, group frame [m]."""
        return transform_points(self.T_group_person, self.person.vertices)


@dataclass(frozen=True)
class Group:
    """People and the objects that belong to them, in a frame of their own on the floor.

    Attributes:
        kind: Name in `GroupWeights`.
        members: At least one.
        objects: Their T_world_object is T_group_object.
    """

    kind: str
    members: tuple[Member, ...]
    objects: Assembly = ()

    @functools.cached_property
    def prints(self) -> NDArray[np.float64]:
        """(n, 2) the floor below everybody and everything, group frame [m]."""
        points = [*(one.points() for one in self.members), *(item.world_surface() for item in self.objects)]
        return footprint(np.concatenate(points))


def draw_group(draw: SceneDraw, kind: str, size: int) -> Group | None:
    """Draws a group.

    Args:
        draw: The attempt; its pools give every person of a frame another body.
        kind: A key of `GROUPS`.
        size: How many people, as the kind allows.

    Returns:
        The group, or None if its people do not fit.
    """
    group = GROUPS[kind].draw(draw, size)
    return group if group is not None and are_apart([one.points() for one in group.members]) else None


def are_apart(skins: list[NDArray[np.float64]], gap: float = PERSON_GAP) -> bool:
    """Whether all people of a group keep a gap from each other.

    Args:
        skins: (n, 3) points of each person [m]; a skin's points are nearer to each other than the gap.
        gap: [m].
    """
    boxes = [extent(skin) for skin in skins]
    for k, (skin, (low_skin, high_skin)) in enumerate(zip(skins, boxes, strict=True)):
        for other, (low_other, high_other) in zip(skins[:k], boxes[:k], strict=True):
            low, high = np.maximum(low_skin, low_other) - gap, np.minimum(high_skin, high_other) + gap
            if (low > high).any():
                continue
            near, near_other = (p[within(p, low, high)] for p in (skin, other))
            if not len(near) or not len(near_other):
                continue
            tree = cKDTree(thinned(near_other, SKIN_SPACING))
            if np.isfinite(tree.query(thinned(near, SKIN_SPACING), distance_upper_bound=gap)[0]).any():
                return False
    return True


def _alone(draw: SceneDraw, size: int) -> Group | None:
    """One person in a scene family; those with unrelated objects before a camera count as unhidden."""
    family = draw_scene_family(draw)
    family = family if family not in ("clutter", "several") else "unhidden"
    scene: Scene | None = SCENE_FAMILIES[family](draw)
    if scene is None or not is_sound(scene, draw.config.clearance):
        return None
    seat = next((k for k, item in enumerate(scene.objects) if item.is_seat), -1)
    return Group("alone", (Member(scene.person, np.eye(4), family, seat),), scene.objects)


def _standing(draw: SceneDraw, kind: str, are_walking: bool = False) -> Person | None:
    """Someone upright whose hands touch nothing, or who walks."""
    base_of = walk if are_walking else stand_upright
    families = [family for family in families_for("standing") if family.base is base_of]
    weights = np.array([family.weight for family in families])
    family = families[int(draw.rng.choice(len(families), p=weights / weights.sum()))].name
    subject = draw.subject(is_seated=False)
    base = draw_base_pose(replace(draw, library=None), family, subject.body)
    arms = None if base is None else draw_arms_pose(draw, family, subject.body, base)
    if arms is None:
        return None
    person = Person.in_pose(subject, arms)
    return person if float(person.vertices[:, 2].min()) >= -MAX_BELOW_FLOOR else None


def _stood(
    draw: SceneDraw, kind: str, poses: list[NDArray[np.float64]], are_walking: bool = False
) -> Group | None:
    members = []
    for T in poses:
        person = _standing(draw, kind, are_walking)
        if person is None:
            return None
        members.append(Member(person, T, kind))
    return Group(kind, tuple(members))


def _facing(draw: SceneDraw, size: int) -> Group | None:
    """People on a circle who look at its middle (the o-space of Kendon's formations, 1990)."""
    radius = float(draw.rng.uniform(*FACING)) / (2.0 * np.sin(np.pi / size))
    poses = []
    for k in range(size):
        bearing = 2.0 * np.pi * k / size + float(draw.rng.normal(0.0, 0.12))
        yaw = bearing + np.pi + float(draw.rng.normal(0.0, 0.2))
        poses.append(pose_on_floor(radius * np.cos(bearing), radius * np.sin(bearing), yaw))
    return _stood(draw, "facing", poses)


def _queue(draw: SceneDraw, size: int) -> Group | None:
    """A line of people, each behind the next; one in five looks aside."""
    poses, x = [], 0.0
    for _ in range(size):
        aside = float(draw.rng.normal(0.0, 0.9)) if draw.rng.random() < 0.2 else 0.0
        poses.append(pose_on_floor(x, float(draw.rng.normal(0.0, 0.07)), float(draw.rng.normal(aside, 0.12))))
        x -= float(draw.rng.uniform(*QUEUE))
    return _stood(draw, "queue", poses)


def _passing(draw: SceneDraw, size: int) -> Group | None:
    """People who walk along parallel lines, in the same or the opposite direction."""
    poses, y = [], 0.0
    for _ in range(size):
        heading = float(draw.rng.normal(0.0, 0.1)) + (np.pi if draw.rng.random() < 0.5 else 0.0)
        poses.append(pose_on_floor(float(draw.rng.uniform(-0.8, 0.8)), y, heading))
        y += float(draw.rng.uniform(*ASIDE))
    return _stood(draw, "passing", poses, are_walking=True)


def _table(draw: SceneDraw, size: int) -> Group | None:
    """People who sit round one table."""
    found = sit_round_table(draw, size)
    if found is None:
        return None
    seated, objects = found
    members = tuple(Member(one.person, one.T_table_person, "table", one.seat) for one in seated)
    return Group("table", members, objects)


@dataclass(frozen=True)
class GroupKind:
    """One kind of group.

    Attributes:
        least: Fewest people in it.
        most: Most people in it.
        draw: Draws it.
    """

    least: int
    most: int
    draw: Callable[[SceneDraw, int], Group | None]


GROUPS: dict[str, GroupKind] = {
    "alone": GroupKind(1, 1, _alone),
    "facing": GroupKind(2, 4, _facing),
    "queue": GroupKind(2, 5, _queue),
    "table": GroupKind(2, 6, _table),
    "passing": GroupKind(2, 3, _passing),
}
"""Kinds of groups by name."""
