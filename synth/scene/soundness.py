"""The laws of a scene: nothing sinks into floor, person or another object, or comes near but at contacts."""

import numpy as np
from scipy.spatial import cKDTree

from synth.geometry import surface_points, transform_points
from synth.scene.draw import FOREARMS, THIGHS, Person, Scene
from synth.scene.placement import PlacedObject, is_free_of

MAX_OVERLAP = 0.008
"""Skin may sink this deep into what it touches [m]; the law is 0.01 m, less is left for what vertices miss."""
MAX_SHORTFALL = 0.005
"""Parts that do not touch an object come at most this much nearer to it than the clearance [m]."""
PLATE_SPACING = 0.015
"""Distance between the points that stand for a laptop on the lap [m]."""
LIMB_RADIUS = 0.08
"""What is inside a forearm is nearer to its skin than this [m]."""
MAX_BELOW_FLOOR = 0.01
"""Skin and clothes are at most this far below the floor [m]: a long hem when its wearer crouches is farther."""
OBJECT_OVERLAP = -0.01
"""Objects may sink this deep into each other (a seat under a table's apron, thin edges) [m]."""


def is_sound(scene: Scene, clearance: tuple[float, float]) -> bool:
    """Whether a scene keeps the laws.

    Args:
        scene: The scene, complete.
        clearance: Range of the gap between the surfaces of person and object [m].
    """
    if float(scene.person.vertices[:, 2].min()) < -MAX_BELOW_FLOOR:
        return False
    if not all(_keeps_clear(item, scene.person, clearance[0]) for item in scene.objects):
        return False
    for k, item in enumerate(scene.objects):
        others = tuple(other for other_idx, other in enumerate(scene.objects[:k]) if other_idx != item.stands_on)
        if not is_free_of(item, others, OBJECT_OVERLAP):
            return False
    return True


def _keeps_clear(item: PlacedObject, person: Person, clearance: float) -> bool:
    nearest = -MAX_OVERLAP if item.contact_parts else clearance - MAX_SHORTFALL
    if item.is_nearer(person.vertices, nearest):
        return False
    if item.is_seat or not item.contact_parts:
        return True
    # What is touched is often thin: a deck's corner or a bar finds its way between vertices.
    if item.is_nearer(person.face_centres_of(item.contact_parts), -MAX_OVERLAP) or _cuts_forearm(item, person):
        return False
    return not item.is_nearer(person.points_without(item.contact_parts), clearance - MAX_SHORTFALL)


def _cuts_forearm(item: PlacedObject, person: Person) -> bool:
    """Whether a laptop on the lap reaches deeper into a forearm than skin may sink.

    A plate thinner than twice the overlap goes deep into an arm without any skin being deep in the plate, so here
    the plate's surface is held against the planes of the skin's nearest faces.
    """
    if not item.contact_parts >= THIGHS:
        return False
    centres, normals = person.face_planes_of(FOREARMS)
    points = transform_points(item.T_world_object, surface_points(item.occluder.mesh, PLATE_SPACING))
    is_near = ((points > centres.min(axis=0)) & (points < centres.max(axis=0))).all(axis=1)
    distance, nearest = cKDTree(centres).query(points[is_near], distance_upper_bound=LIMB_RADIUS)
    is_found = np.isfinite(distance)
    offset = points[is_near][is_found] - centres[nearest[is_found]]
    return bool(((offset * normals[nearest[is_found]]).sum(axis=1) < -MAX_OVERLAP).any())
