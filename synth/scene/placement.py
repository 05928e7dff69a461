"""Moves objects up to a person: conservative advancement on signed distances, contacts, gaps between objects."""

import functools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.frame import ObjectRecord
from synth.geometry import transform_points
from synth.occluders.model import Occluder
from synth.occluders.solids.distance import PlacedSolids, is_any_nearer, nearest_point, place
from synth.occluders.solids.sweep import free_way, joined
from synth.vocabulary import PART_NAMES

EYE_ROOM = 0.25
"""A camera keeps this far from objects [m]."""
FAR = 3.0
"""Distances are not looked at beyond this [m]."""


@dataclass(frozen=True)
class PlacedObject:
    """An object that stands in a scene.

    Attributes:
        spec_id: Identifier of its spec in the corpus.
        spec: What it was made from, as plain JSON values.
        occluder: Mesh, solids and anchors in its own frame.
        T_world_object: (4, 4) float64.
        surface: (n_points, 3) float64 points spread over its surface, its own frame [m].
        contact_parts: Body parts (labels) that may touch it; the others keep the clearance.
        stands_on: Index of the object it stands on in the scene, or -1 for the floor or the lap.
        is_seat: Whether the person sits on it.
    """

    spec_id: str
    spec: dict[str, object]
    occluder: Occluder
    T_world_object: NDArray[np.float64]
    surface: NDArray[np.float64]
    contact_parts: frozenset[int] = frozenset()
    stands_on: int = -1
    is_seat: bool = False

    def moved(self, step: ArrayLike) -> "PlacedObject":
        """The same object, shifted by a world vector [m]."""
        T = self.T_world_object.copy()
        T[:3, 3] += np.asarray(step, dtype=np.float64)
        return replace(self, T_world_object=T)

    def gap(self, points: NDArray[np.float64], reach: float = FAR) -> float:
        """Smallest signed distance of any point to the object's solids, at most `reach` [m]."""
        return nearest_point(self.occluder.solids, self.T_world_object, points, reach)[0]

    def is_nearer(self, points: NDArray[np.float64], distance: float) -> bool:
        """Whether any point is nearer to the object's solids than a signed distance [m]."""
        return is_any_nearer(self.solids, points, distance)

    @functools.cached_property
    def solids(self) -> PlacedSolids:
        """Its solids where it stands."""
        return place(self.occluder.solids, self.T_world_object)

    @functools.cached_property
    def radius(self) -> float:
        """Horizontal reach of its surface from its origin [m]."""
        return float(np.sqrt((self.surface[:, :2] ** 2).sum(axis=1).max()))

    def world_surface(self) -> NDArray[np.float64]:
        """(n_points, 3) points spread over its surface, world frame [m]."""
        return transform_points(self.T_world_object, self.surface)


def pose_on_floor(x: float, y: float, yaw: float) -> NDArray[np.float64]:
    """T_world_object of an object that stands on the ground plane.

    Args:
        x: [m].
        y: [m].
        yaw: Turn about the vertical, left positive [rad].
    """
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0, x], [s, c, 0.0, y], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


Assembly = tuple[PlacedObject, ...]
"""Objects that move as one: a table and what stands on it."""


def advance(
    assembly: Assembly,
    direction: ArrayLike,
    points: NDArray[np.float64],
    gap: float,
    max_travel: float = 2.0 * FAR,
) -> Assembly | None:
    """Moves objects along a direction until their solids are `gap` away from the points; see `free_way`.

    Args:
        assembly: The objects, where they start; farther than `gap` from all points.
        direction: (3,) unit vector, world frame.
        points: (n, 3) float64, world frame [m].
        gap: Distance to stop at [m].
        max_travel: Give up after this way [m].

    Returns:
        The moved objects, or None if they start too near or pass the points by.
    """
    unit = np.asarray(direction, dtype=np.float64)
    placed = joined([item.solids for item in assembly])
    way = free_way(placed, points, unit, gap, max_travel)
    return tuple(item.moved(way * unit) for item in assembly) if 0.0 <= way < np.inf else None


def is_free_of(placed: PlacedObject, others: Assembly, gap: float = 0.01) -> bool:
    """Whether an object keeps a gap to all others [m]: each one's surface against the other's solids."""
    surface: NDArray[np.float64] | None = None
    for other in others:
        reach = placed.radius + other.radius + gap
        if np.linalg.norm(placed.T_world_object[:2, 3] - other.T_world_object[:2, 3]) > reach:
            continue
        surface = placed.world_surface() if surface is None else surface
        if other.is_nearer(surface, gap) or placed.is_nearer(other.world_surface(), gap):
            return False
    return True


def is_eye_free(T_world_camera: NDArray[np.float64], objects: Assembly, room: float = EYE_ROOM) -> bool:
    """Whether a camera at a (4, 4) pose does not stand in an object or nearer to one than some room [m]."""
    eye = T_world_camera[None, :3, 3]
    return not any(item.is_nearer(eye, room) for item in objects)


def record_of(item: PlacedObject, instance: int, visible_fraction: float) -> ObjectRecord:
    """What a frame stores of an object.

    Args:
        item: The object.
        instance: Its number in the frame.
        visible_fraction: Share of its pixels that the composite shows.
    """
    return ObjectRecord(
        instance=instance,
        class_name=item.occluder.class_name,
        spec_id=item.spec_id,
        spec=item.spec,
        T_world_object=tuple(tuple(float(value) for value in row) for row in item.T_world_object),
        visible_fraction=visible_fraction,
        contacts=tuple(PART_NAMES[label] for label in sorted(item.contact_parts)),
    )
