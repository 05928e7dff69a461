"""Objects that are moved up to people stop where they should."""

import numpy as np
import pytest

from synth.geometry import surface_points, translation
from synth.occluders import registry
from synth.scene.placement import PlacedObject, advance, is_free_of, pose_on_floor


def placed(class_name: str, T: np.ndarray, seed: int = 0) -> PlacedObject:
    spec = registry.sample(class_name, np.random.default_rng(seed))
    occluder = registry.make(spec)
    return PlacedObject("x", registry.to_plain(spec), occluder, T, surface_points(occluder.mesh, 0.05))


@pytest.mark.parametrize("class_name", ["table", "stroller", "chair", "suitcase", "other"])
@pytest.mark.parametrize("seed", range(4))
def test_an_object_advances_to_the_gap_and_not_beyond(class_name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal((0.0, 0.0, 0.5), 0.15, (500, 3))
    start = placed(class_name, pose_on_floor(3.0, 0.1 * rng.standard_normal(), rng.uniform(-3, 3)), seed)
    moved = advance((start,), (-1.0, 0.0, 0.0), points, 0.04)
    assert moved is not None
    assert moved[0].gap(points) == pytest.approx(0.04, abs=0.0011)
    way = moved[0].T_world_object[:3, 3] - start.T_world_object[:3, 3]
    assert way[0] < 0.0
    assert np.allclose(way[1:], 0.0)
    for share in np.linspace(0.0, 1.0, 25):
        assert start.moved(share * way).gap(points) >= 0.04 - 0.0011


def test_an_object_that_passes_by_or_starts_too_near_is_refused() -> None:
    points = np.array([[0.0, 5.0, 0.5]])
    assert advance((placed("other", pose_on_floor(2.0, 0.0, 0.0)),), (-1.0, 0.0, 0.0), points, 0.04) is None
    inside = np.array([[0.0, 0.0, 0.1]])
    assert advance((placed("other", pose_on_floor(0.0, 0.0, 0.0)),), (-1.0, 0.0, 0.0), inside, 0.04) is None


def test_an_assembly_moves_as_one() -> None:
    table, laptop = placed("table", pose_on_floor(3.0, 0.0, 0.0)), placed("laptop", translation(2.9, 0.0, 0.74))
    moved = advance((table, laptop), (-1.0, 0.0, 0.0), np.array([[0.0, 0.0, 0.76]]), 0.03)
    assert moved is not None
    step = [
        new.T_world_object[:3, 3] - old.T_world_object[:3, 3]
        for new, old in zip(moved, (table, laptop), strict=True)
    ]
    assert np.allclose(step[0], step[1])


def test_objects_that_overlap_are_not_free_of_each_other() -> None:
    box = placed("other", np.eye(4))
    assert not is_free_of(box, (placed("other", pose_on_floor(0.05, 0.0, 0.3)),))
    assert is_free_of(box, (placed("other", pose_on_floor(5.0, 0.0, 0.3)),))
