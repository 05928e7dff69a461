"""Several cameras of one scene: in the corners, front and top, or a pair side by side."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from synth.geometry import look_at
from synth.scene.config import SceneConfig
from synth.scene.placement import Assembly, is_eye_free
from synth.scene.room.arrange import HEAD_ROOM, Eye, distance_range
from synth.scene.room.occupancy import Occupancy
from synth.scene.room.shell import BuiltRoom
from synth.scene.viewpoint import TOP, beside, looking_down

CORNER = 0.3
"""Cameras in corners stand this far from both walls [m]."""
CORNER_HEIGHT = (1.9, 2.5)
"""Range of their height [m]; the ceiling allowing."""
FARTHEST = 6.0
"""Where the corners are farther away, cameras stand round the people, within this [m]."""
EYE_ROOM = 0.2
"""Cameras keep this far from the room's things [m]."""
LOOKED_AT = 0.9
"""Height that cameras look at [m]."""
TRIES = 12


def further_eyes(
    config: SceneConfig,
    room: BuiltRoom,
    taken: Occupancy,
    first: Eye,
    objects: Assembly,
    people: Sequence[NDArray[np.float64]],
    rng: np.random.Generator,
) -> tuple[Eye, ...] | None:
    """Where the cameras after the first one are.

    Args:
        config: How many, and how they are put up.
        room: The room.
        taken: What its furniture takes of the floor.
        first: The first camera.
        objects: What belongs to the people, world frame.
        people: (n, 3) points of each person, world frame [m].
        rng: Source of randomness; not used where there is one camera.

    Returns:
        The cameras, or None if one finds no place.
    """
    if config.cameras == 1:
        return ()
    target = np.append(_middle(first, people), LOOKED_AT)
    if config.rig == "stereo":
        return (Eye(beside(first.T_world_camera), first.heading),)
    if config.rig == "front_top":
        low, high = (min(height, room.spec.height - 0.05) for height in TOP)
        height = float(rng.uniform(low, high))
        return (Eye(looking_down(target[:2], height, first.T_world_camera), first.heading),)
    eyes: list[Eye] = []
    things = (*room.items[room.n_surfaces :], *objects)
    for k in range(1, config.cameras):
        bearing = _bearing(target, first.place) + 2.0 * np.pi * k / config.cameras
        eye = _corner(config, room, things, target, bearing, rng)
        if eye is None:
            return None
        eyes.append(eye)
    return tuple(eyes)


def _middle(first: Eye, people: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """(2,) the middle of the people, or a place before the first camera if there is nobody."""
    if not people:
        return first.place + 2.5 * np.array([np.cos(first.heading), np.sin(first.heading)])
    return np.asarray(np.mean([points[:, :2].mean(axis=0) for points in people], axis=0))


def _bearing(target: NDArray[np.float64], place: NDArray[np.float64]) -> float:
    return float(np.arctan2(place[1] - target[1], place[0] - target[0]))


def _corner(
    config: SceneConfig,
    room: BuiltRoom,
    things: Assembly,
    target: NDArray[np.float64],
    bearing: float,
    rng: np.random.Generator,
) -> Eye | None:
    """A camera high up at about a bearing from what it looks at: in the corner there, or nearer in large rooms."""
    half = np.array([room.spec.length, room.spec.width]) / 2 - CORNER
    for _ in range(TRIES):
        angle = bearing + float(rng.normal(0.0, 0.25))
        way = np.array([np.cos(angle), np.sin(angle)])
        low, high = config.height or CORNER_HEIGHT
        top = room.spec.height - HEAD_ROOM
        height = float(rng.uniform(min(low, top), min(high, top)))
        farthest = min(FARTHEST, distance_range(config)[1]) * float(rng.uniform(0.7, 1.0))
        place = np.clip(target[:2] + farthest * way, -half, half)
        eye = np.array([place[0], place[1], height])
        if np.hypot(*(place - target[:2])) < 0.8:
            continue
        T = look_at(
            eye, target + rng.normal(0.0, (0.1, 0.1, 0.05)), float(np.clip(rng.normal(0.0, 0.02), -0.05, 0.05))
        )
        if is_eye_free(T, things, EYE_ROOM):
            return Eye(T, float(np.arctan2(*(target[:2] - place)[::-1])))
    return None
