"""The scene families: who does what at which object, each a function of one attempt."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from synth.bodies.poses.families import FAMILIES, Context, PoseFamily, Posture, families_for
from synth.scene.bases import draw_arms_pose, draw_base_pose
from synth.scene.clutter import add_clutter, push_in_the_way
from synth.scene.contacts import key_targets, lower_on_lap, push_stroller, table_targets
from synth.scene.draw import Person, Scene, SceneDraw
from synth.scene.placement import PlacedObject
from synth.scene.pools import Subject
from synth.scene.seating import DESK_CHAIRS, seat_person
from synth.scene.tables import push_table_up, stand_on_table

MONITOR_SHARE = 0.25
"""Share of the tables without a laptop that carry a monitor."""
UNHIDDEN_SHARE = (0.85, 1.0)
"""Visible share of a person whom nothing hides but, at most, a little of their own seat."""
CLUTTERED_SHARE = (0.0, 0.97)
"""Visible share of a person before whom unrelated objects stand: they hide something."""
SEVERAL_CLUTTER = (0.7, 0.3)
"""How often one or two unrelated objects join a scene of several."""


def draw_pose_family(draw: SceneDraw, posture: Posture, context: Context = "none") -> str:
    """Draws a daily pose family of a posture and a context by its weight."""
    return _pick(families_for(posture, context), float(draw.rng.random()))


def _pick(kinds: list[PoseFamily], place: float) -> str:
    """The family at a place, 0..1, of the line in which each takes as much room as it weighs."""
    ends = np.cumsum([kind.weight for kind in kinds])
    return kinds[int(np.searchsorted(ends / ends[-1], place, side="right"))].name


def _draw_free_pose_family(draw: SceneDraw, is_seated: bool) -> str:
    """Draws what a person does whose hands touch nothing: sits, stands or exercises."""
    if is_seated:
        return _draw_wide_or_daily(draw, "sitting")
    chance, share = float(draw.rng.random()), draw.config.exercising_share
    if chance < share:
        return _pick(families_for("standing", occasion="exercise"), chance / share)
    return _draw_wide_or_daily(draw, "standing")


def _draw_wide_or_daily(draw: SceneDraw, posture: Posture) -> str:
    """A family without context: of recorded life and wide poses, or a daily one."""
    if draw.config.life_share > 0.0 and draw.rng.random() < draw.config.life_share:
        return _pick(families_for(posture, occasion="life"), float(draw.rng.random()))
    return draw_pose_family(draw, posture)


def unhidden(draw: SceneDraw) -> Scene | None:
    """A standing person, or one on a seat, with nothing before them."""
    is_seated = draw.rng.random() < draw.config.seated_share
    subject = draw.subject(is_seated)
    pose_family = _draw_free_pose_family(draw, is_seated)
    based = _based(draw, subject, pose_family)
    if based is None:
        return None
    person, seat = based
    arms = draw_arms_pose(draw, pose_family, subject.body, person.pose)
    if arms is None:
        return None
    return Scene("unhidden", Person.in_pose(subject, arms), seat, UNHIDDEN_SHARE, hides_person=False)


def table(draw: SceneDraw) -> Scene | None:
    """Sitting at a table with the hands on it, or standing before one."""
    if draw.rng.random() < draw.config.standing_at_table_share:
        return _stand_before_table(draw)
    return _sit_at_table(draw)


def _stand_before_table(draw: SceneDraw) -> Scene | None:
    subject = draw.subject(is_seated=False)
    pose_family = _draw_wide_or_daily(draw, "standing")
    base = draw_base_pose(draw, pose_family, subject.body)
    if base is None:
        return None
    arms = draw_arms_pose(draw, pose_family, subject.body, base)
    person = Person.in_pose(subject, base if arms is None else arms)
    pushed = push_table_up(draw, person, are_arms_on_it=False)
    return None if arms is None or pushed is None else Scene("table", person, (pushed,))


def _sit_at_table(draw: SceneDraw) -> Scene | None:
    subject = draw.subject(is_seated=True)
    pose_family = draw_pose_family(draw, "sitting", "table")
    seated = seat_person(draw, subject, pose_family, DESK_CHAIRS)
    pushed = None if seated is None else push_table_up(draw, seated[0])
    if seated is None or pushed is None:
        return None
    person, seat = seated
    arms = draw_arms_pose(draw, pose_family, subject.body, person.pose, table_targets(pushed))
    if arms is None:
        return None
    scene = Scene("table", Person.in_pose(subject, arms), (seat, pushed))
    if draw.rng.random() >= MONITOR_SHARE:
        return scene
    monitor = stand_on_table(draw, "monitor", pushed, len(scene.objects) - 1, depth=(0.45, 0.75))
    return scene if monitor is None else scene.with_objects(monitor)


def laptop_table(draw: SceneDraw) -> Scene | None:
    """Typing on a laptop that stands on a table."""
    subject = draw.subject(is_seated=True)
    pose_family = draw_pose_family(draw, "sitting", "laptop_table")
    seated = seat_person(draw, subject, pose_family, DESK_CHAIRS)
    pushed = None if seated is None else push_table_up(draw, seated[0])
    if seated is None or pushed is None:
        return None
    person, seat = seated
    offset = float(draw.rng.normal(0.0, 0.04)) - pushed.T_world_object[1, 3]
    laptop = stand_on_table(draw, "laptop", pushed, 1, depth=(0.04, 0.14), y=offset)
    if laptop is None:
        return None
    arms = draw_arms_pose(draw, pose_family, subject.body, person.pose, key_targets(laptop, pushed))
    if arms is None:
        return None
    return Scene("laptop_table", Person.in_pose(subject, arms), (seat, pushed, laptop))


def laptop_lap(draw: SceneDraw) -> Scene | None:
    """Typing on a laptop that stands on the thighs."""
    subject = draw.subject(is_seated=True)
    pose_family = draw_pose_family(draw, "sitting", "laptop_lap")
    seated = seat_person(draw, subject, pose_family)
    laptop = None if seated is None else lower_on_lap(draw, seated[0])
    if seated is None or laptop is None:
        return None
    person, seat = seated
    arms = draw_arms_pose(draw, pose_family, subject.body, person.pose, key_targets(laptop, None))
    return None if arms is None else Scene("laptop_lap", Person.in_pose(subject, arms), (seat, laptop))


def stroller(draw: SceneDraw) -> Scene | None:
    """Pushing a stroller with one or both hands."""
    subject = draw.subject(is_seated=False)
    pose_family = draw_pose_family(draw, "standing", "stroller")
    base = draw_base_pose(draw, pose_family, subject.body)
    if base is None:
        return None
    pushed = push_stroller(draw, Person.in_pose(subject, base), pose_family)
    return None if pushed is None else Scene("stroller", pushed[0], (pushed[1],))


def clutter(draw: SceneDraw) -> Scene | None:
    """An unrelated object between the camera and the person."""
    scene = unhidden(draw)
    if scene is None:
        return None
    scene = replace(scene, family="clutter", visible_share=CLUTTERED_SHARE, hides_person=True)
    return add_clutter(draw, scene, 1)


def several(draw: SceneDraw) -> Scene | None:
    """A scene with a table, laptop or stroller, and unrelated objects besides."""
    kinds = (table, laptop_table, stroller)
    scene = kinds[int(draw.rng.integers(len(kinds)))](draw)
    if scene is None:
        return None
    n_objects = 1 + int(draw.rng.random() >= SEVERAL_CLUTTER[0])
    return add_clutter(draw, replace(scene, family="several", visible_share=CLUTTERED_SHARE), n_objects)


SCENE_FAMILIES: dict[str, Callable[[SceneDraw], Scene | None]] = {
    "unhidden": unhidden,
    "table": table,
    "laptop_table": laptop_table,
    "laptop_lap": laptop_lap,
    "stroller": stroller,
    "clutter": clutter,
    "several": several,
}
"""Attempts at a scene by family; None means try again with the same randomness going on."""


def draw_scene_family(draw: SceneDraw) -> str:
    """Draws a scene family by the configured weights."""
    weights = np.array([getattr(draw.config.scenes, name) for name in SCENE_FAMILIES])
    return list(SCENE_FAMILIES)[int(draw.rng.choice(len(weights), p=weights / weights.sum()))]


def without_context(draw: SceneDraw, pose_scene: Scene, object_scene: Scene) -> Scene | None:
    """The person of one scene among the objects of another, so that neither tells of the other.

    The person keeps their seat. What stood on the floor of the other scene comes up, with its load, from the
    side where it was and at a gap drawn anew, but turned at random. A laptop from a lap comes on a table.

    Args:
        draw: The attempt.
        pose_scene: Where the person comes from.
        object_scene: Where the objects come from.
    """
    seats = tuple(item for item in pose_scene.objects if item.is_seat)
    scene = replace(object_scene, person=pose_scene.person, objects=seats, azimuth=None)
    for idx, item in enumerate(object_scene.objects):
        if item.stands_on >= 0 or item.is_seat:
            continue
        assembly = (item, *(load for load in object_scene.objects if load.stands_on == idx))
        if item.occluder.class_name == "laptop":
            carrier = draw.place("table", np.eye(4))
            load = stand_on_table(draw, "laptop", carrier, 0)
            assembly = (carrier,) if load is None else (carrier, load)
        bearing = np.arctan2(item.T_world_object[1, 3], item.T_world_object[0, 3])
        pushed = push_in_the_way(draw, scene, assembly, float(bearing))
        if pushed is None:
            return None
        scene = scene.with_objects(*pushed)
    return replace(scene, azimuth=object_scene.azimuth)


def _based(draw: SceneDraw, subject: Subject, pose_family: str) -> tuple[Person, tuple[PlacedObject, ...]] | None:
    """Trunk and legs of the pose; a sitting one with its seat."""
    if FAMILIES[pose_family].posture == "sitting":
        seated = seat_person(draw, subject, pose_family)
        return None if seated is None else (seated[0], (seated[1],))
    base = draw_base_pose(draw, pose_family, subject.body)
    return None if base is None else (Person.in_pose(subject, base), ())
