"""Objects that have nothing to do with what the person does, pushed between the camera and them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synth.geometry import inverse
from synth.scene.draw import Scene, SceneDraw
from synth.scene.placement import Assembly, advance, is_free_of, pose_on_floor
from synth.scene.tables import START, stand_on_table
from synth.scene.viewpoint import draw_azimuth

CLUTTER_CLASSES: tuple[tuple[str, float], ...] = (
    ("table", 0.22),
    ("chair", 0.22),
    ("suitcase", 0.20),
    ("other", 0.24),
    ("stroller", 0.12),
)
"""What stands in the way, and how often."""
MAX_SIDEWAYS = 0.35
"""Bearing of the object seen from the person, off the camera's [rad]."""
TRIES = 4
"""Objects tried for one place in the way."""
ON_TABLE_SHARE = 0.4
"""Share of the tables in the way that carry a laptop or a monitor."""


def draw_clutter_class(rng: np.random.Generator) -> str:
    """Draws the class of an object that stands in the way."""
    names, weights = zip(*CLUTTER_CLASSES, strict=True)
    return str(names[int(rng.choice(len(names), p=np.array(weights) / sum(weights)))])


def add_clutter(draw: SceneDraw, scene: Scene, n_objects: int) -> Scene | None:
    """Puts unrelated objects between the person and a bearing that the camera then takes.

    Args:
        draw: The attempt.
        scene: The scene so far.
        n_objects: How many to add.

    Returns:
        The scene with its camera's bearing fixed, or None if an object finds no place.
    """
    azimuth = draw_azimuth(draw.config, draw.rng) if scene.azimuth is None else scene.azimuth
    scene = replace(scene, azimuth=azimuth)
    for _ in range(n_objects):
        tries = (_try_clutter(draw, scene, azimuth) for _ in range(TRIES))
        pushed = next((assembly for assembly in tries if assembly is not None), None)
        if pushed is None:
            return None
        scene = scene.with_objects(*pushed)
    return scene


def _try_clutter(draw: SceneDraw, scene: Scene, azimuth: float) -> Assembly | None:
    return push_in_the_way(draw, scene, draw_assembly(draw, draw_clutter_class(draw.rng)), azimuth)


def push_in_the_way(draw: SceneDraw, scene: Scene, assembly: Assembly, azimuth: float) -> Assembly | None:
    """Pushes objects, turned at random, towards the person from about a bearing until the gap is as drawn.

    They stop at the person, or before an object that is in their way.

    Args:
        draw: The attempt.
        scene: The person and the objects that are there already.
        assembly: The objects, the first one on the floor and the others on it.
        azimuth: Where they come from, seen from the person [rad].
    """
    bearing = azimuth + float(draw.rng.uniform(-MAX_SIDEWAYS, MAX_SIDEWAYS))
    ahead = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    start = START * ahead + float(draw.rng.normal(0.0, 0.15)) * np.array([-ahead[1], ahead[0], 0.0])
    T_world_start = pose_on_floor(start[0], start[1], float(draw.rng.uniform(-np.pi, np.pi)))
    return push_up(draw, scene.person.vertices, scene.objects, assembly, T_world_start, -ahead)


def push_up(
    draw: SceneDraw,
    points: NDArray[np.float64],
    others: Assembly,
    assembly: Assembly,
    T_world_start: NDArray[np.float64],
    direction: NDArray[np.float64],
) -> Assembly | None:
    """Pushes objects along a direction until the gap to a person, or to an object in their way, is as drawn.

    Args:
        draw: The attempt.
        points: (n, 3) points of the person, world frame [m].
        others: The objects that are there already.
        assembly: The objects, the first one on the floor and the others on it; the person touches none of them.
        T_world_start: (4, 4) pose of the first one, from where it is pushed.
        direction: (3,) unit vector, world frame.

    Returns:
        The objects where they stop, or None if they meet nobody or stop inside other objects.
    """
    T_world_old = T_world_start @ inverse(assembly[0].T_world_object)
    n_before = len(others)
    moved = tuple(
        replace(
            item,
            T_world_object=T_world_old @ item.T_world_object,
            contact_parts=frozenset(),
            stands_on=n_before if k else -1,
        )
        for k, item in enumerate(assembly)
    )
    obstacles = [points, *(item.world_surface() for item in others)]
    pushed = advance(moved, direction, np.concatenate(obstacles), draw.gap())
    if pushed is None or not all(is_free_of(item, others) for item in pushed):
        return None
    return pushed


def draw_assembly(draw: SceneDraw, class_name: str) -> Assembly:
    """An object, and what stands on it where it is a table and something fits."""
    carrier = draw.place(class_name, np.eye(4))
    if class_name != "table" or draw.rng.random() >= ON_TABLE_SHARE:
        return (carrier,)
    load = stand_on_table(draw, "laptop" if draw.rng.random() < 0.5 else "monitor", carrier, 0)
    return (carrier,) if load is None else (carrier, load)
