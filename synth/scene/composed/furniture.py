"""Families of objects before a recorded person, each a function of one attempt, in the person's scene frame."""

from collections.abc import Callable

import numpy as np

from synth.occluders import registry
from synth.scene.clutter import MAX_SIDEWAYS, TRIES, draw_assembly, draw_clutter_class, push_up
from synth.scene.composed.person import RecordedPerson
from synth.scene.draw import SceneDraw
from synth.scene.placement import Assembly, pose_on_floor
from synth.scene.tables import START, TABLE_KINDS, stand_on_table

MAX_TURN = 0.7
"""A desk or stroller stands at most this far off the line from person to camera, to hide something [rad]."""
DESK_LOADS: tuple[tuple[str, float], ...] = (("laptop", 0.40), ("monitor", 0.20), ("other", 0.15), ("", 0.25))
"""What stands on a desk, and how often."""
LOAD_DEPTH = {"laptop": (0.04, 0.3), "monitor": (0.25, 0.6), "other": (0.05, 0.4)}
"""Range of the distance between a desk's near edge and what stands on it [m]."""
MAX_LOAD_HEIGHT = 0.6
"""Higher piles of boxes are not put on desks [m]."""
TWO_MORE_SHARE = 0.3
"""How often two unrelated objects join a scene of several, not one."""
TURNED_BACK_SHARE = 0.6
"""Share of the chairs whose back is towards the person; the others are turned at random."""


def desk(draw: SceneDraw, person: RecordedPerson) -> Assembly | None:
    """A table that the person stands at, or whose top passes over the knees of who sits."""
    table = draw.place("table", np.eye(4), TABLE_KINDS)
    names, weights = zip(*DESK_LOADS, strict=True)
    name = str(names[int(draw.rng.choice(len(names), p=np.array(weights) / sum(weights)))])
    load = None
    if name:
        y = float(draw.rng.normal(0.0, 0.1))
        load = stand_on_table(draw, name, table, 0, LOAD_DEPTH[name], y)
    is_loaded = load is not None and load.surface[:, 2].max() <= MAX_LOAD_HEIGHT
    assembly = (table, load) if load is not None and is_loaded else (table,)
    return _push(draw, person, (), assembly, _ahead(draw, person), float(draw.rng.normal(0.0, 0.05)))


def stroller(draw: SceneDraw, person: RecordedPerson) -> Assembly | None:
    """A stroller that has been let go of."""
    pushed = draw.place("stroller", np.eye(4), registry.KINDS["stroller"])
    return _push(draw, person, (), (pushed,), _ahead(draw, person), float(draw.rng.normal(0.0, 0.2)))


def chair(draw: SceneDraw, person: RecordedPerson) -> Assembly | None:
    """A chair that the person stands behind."""
    is_back = draw.rng.random() < TURNED_BACK_SHARE
    turn = float(draw.rng.normal(0.0, 0.15) if is_back else draw.rng.uniform(-np.pi, np.pi))
    return _push(draw, person, (), (draw.place("chair", np.eye(4)),), _ahead(draw, person), turn)


def clutter(draw: SceneDraw, person: RecordedPerson) -> Assembly | None:
    """Any object, turned at random."""
    return _add_clutter(draw, person, ())


def several(draw: SceneDraw, person: RecordedPerson) -> Assembly | None:
    """A desk, stroller or chair, and unrelated objects that come up to the person or to it."""
    kinds = (desk, stroller, chair)
    objects = kinds[int(draw.rng.integers(len(kinds)))](draw, person)
    for _ in range(1 + int(draw.rng.random() < TWO_MORE_SHARE)):
        if objects is None:
            return None
        tries = (_add_clutter(draw, person, objects) for _ in range(TRIES))
        more = next((found for found in tries if found is not None), None)
        objects = None if more is None else (*objects, *more)
    return objects


FAMILIES: dict[str, Callable[[SceneDraw, RecordedPerson], Assembly | None] | None] = {
    "unhidden": None,
    "desk": desk,
    "stroller": stroller,
    "chair": chair,
    "clutter": clutter,
    "several": several,
}
"""What attempts the objects before a person by family; "unhidden" puts nothing there.

An attempt that gives None is made again with the same randomness going on.
"""


def _ahead(draw: SceneDraw, person: RecordedPerson) -> float:
    """Bearing of what the person stands at [rad]: where they look, if that is towards the camera."""
    if person.is_frontal:
        return float(np.clip(person.facing + draw.rng.normal(0.0, 0.1), -MAX_TURN, MAX_TURN))
    return float(draw.rng.uniform(-MAX_SIDEWAYS, MAX_SIDEWAYS))


def _add_clutter(draw: SceneDraw, person: RecordedPerson, others: Assembly) -> Assembly | None:
    assembly = draw_assembly(draw, draw_clutter_class(draw.rng))
    bearing = float(draw.rng.uniform(-MAX_SIDEWAYS, MAX_SIDEWAYS))
    return _push(draw, person, others, assembly, bearing, float(draw.rng.uniform(-np.pi, np.pi)))


def _push(
    draw: SceneDraw, person: RecordedPerson, others: Assembly, assembly: Assembly, bearing: float, turn: float
) -> Assembly | None:
    """Pushes objects towards the person, from a bearing and turned off it [rad], until the gap is as drawn."""
    ahead = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    start = START * ahead + float(draw.rng.normal(0.0, 0.12)) * np.array([-ahead[1], ahead[0], 0.0])
    T_scene_start = pose_on_floor(start[0], start[1], bearing + turn)
    return push_up(draw, person.body, others, assembly, T_scene_start, -ahead)
