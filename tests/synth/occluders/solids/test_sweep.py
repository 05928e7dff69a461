"""Solids that are swept along a line stop where a fine search says they should."""

import numpy as np
import pytest

from synth.geometry import LabelledMesh, surface_points
from synth.occluders import registry
from synth.occluders.solids.distance import place, solid_distances
from synth.occluders.solids.sweep import TOLERANCE, free_way, joined
from synth.scene.placement import pose_on_floor

KINDS = ["table", "pram", "office_chair", "suitcase", "boxes"]


def slow_way(occluder, T, points, unit, gap, longest) -> float:
    """The same by looking every millimetre."""
    for way in np.arange(0.0, longest, 0.001):
        moved = T.copy()
        moved[:3, 3] += way * unit
        if solid_distances(occluder.solids, moved, points).min() <= gap:
            return float(way)
    return np.inf


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_the_way_agrees_with_a_fine_search(kind: str, seed: int) -> None:
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    generator = registry.GENERATORS[kind]
    occluder = generator.make(generator.sample(rng))
    unit = rng.normal(size=3) * (1.0, 1.0, 0.2)
    unit /= np.linalg.norm(unit)
    T = pose_on_floor(0.0, 0.0, float(rng.uniform(-3.0, 3.0)))
    points = rng.normal(1.9 * unit + (0.0, 0.0, 0.5), 0.1, (40, 3))
    way = free_way(place(occluder.solids, T), points, unit, 0.04, 2.5)
    slow = slow_way(occluder, T, points, unit, 0.04, 2.5)
    # Along a glancing surface the last millimetre of distance may be several of way.
    assert way == slow == np.inf or slow - 0.02 < way <= slow + 2 * TOLERANCE
    if way < np.inf:
        moved = T.copy()
        moved[:3, 3] += way * unit
        assert abs(solid_distances(occluder.solids, moved, points).min() - 0.04) <= TOLERANCE * 1.01


def test_several_objects_stop_with_the_first() -> None:
    box = registry.make(registry.sample("suitcase", np.random.default_rng(0)))
    near, far = (place(box.solids, pose_on_floor(x, 0.0, 0.0)) for x in (2.0, 3.0))
    points, unit = np.array([[0.0, 0.0, 0.3]]), (-1.0, 0.0, 0.0)
    assert free_way(joined([near, far]), points, unit, 0.03, 5.0) == free_way(near, points, unit, 0.03, 5.0)


def test_a_start_too_near_and_a_way_too_short_are_told_apart() -> None:
    placed = place(registry.make(registry.sample("suitcase", np.random.default_rng(0))).solids, np.eye(4))
    inside, ahead, none = np.array([[0.0, 0.0, 0.3]]), np.array([[3.0, 0.0, 0.3]]), np.zeros((0, 3))
    assert free_way(placed, inside, (1.0, 0.0, 0.0), 0.03, 5.0) == -1.0
    assert free_way(placed, ahead, (1.0, 0.0, 0.0), 0.03, 1.0) == np.inf
    assert free_way(placed, none, (1.0, 0.0, 0.0), 0.03, 1.0) == np.inf


def test_bad_arguments_are_refused() -> None:
    placed = place(registry.make(registry.sample("suitcase", np.random.default_rng(0))).solids, np.eye(4))
    with pytest.raises(ValueError, match="unit vector"):
        free_way(placed, np.zeros((1, 3)), (2.0, 0.0, 0.0), 0.03, 1.0)
    with pytest.raises(ValueError, match=r"must be \(n, 3\)"):
        free_way(placed, np.zeros(3), (1.0, 0.0, 0.0), 0.03, 1.0)


@pytest.mark.parametrize("spacing", [0.02, 0.05])
def test_surface_points_leave_no_gap_on_a_face(spacing: float) -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 0.6, 0], [0, 0.6, 0]], dtype=np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    points = surface_points(LabelledMesh(vertices, faces, np.zeros(2, np.uint8), False), spacing)
    assert (points[:, 2] == 0).all()
    rng = np.random.default_rng(0)
    anywhere = np.column_stack([rng.uniform(0, 1, 300), rng.uniform(0, 0.6, 300), np.zeros(300)])
    nearest = np.linalg.norm(anywhere[:, None] - points[None], axis=2).min(axis=1)
    assert nearest.max() < 1.5 * spacing
