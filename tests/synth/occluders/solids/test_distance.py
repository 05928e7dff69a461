import numpy as np
import pytest
import trimesh

from synth.geometry import transform_points
from synth.occluders.model import BOX, CAPSULE, CYLINDER, Solids
from synth.occluders.solids.distance import is_any_nearer, nearest_point, place, solid_distances


def random_pose(rng):
    T = trimesh.transformations.random_rotation_matrix(rng.random(3))
    T[:3, 3] = rng.uniform(-0.5, 0.5, 3)
    return T


def random_solids(rng, n):
    kind = rng.integers(0, 3, n).astype(np.uint8)
    size = rng.uniform(0.02, 0.4, (n, 3))
    size[kind != BOX, 1] = size[kind != BOX, 0]
    return Solids(kind, np.stack([random_pose(rng) for _ in range(n)]), size)


def slow_distances(solids, T_world_object, points):
    """One solid after the other, textbook formulas in numpy."""
    out = np.full(len(points), np.inf)
    for kind, T, size in zip(solids.kind, solids.T_object_solid, solids.size, strict=True):
        local = transform_points(np.linalg.inv(T_world_object @ T), points)
        if kind == BOX:
            q = np.abs(local) - size
        elif kind == CYLINDER:
            q = np.stack([np.hypot(local[:, 0], local[:, 1]) - size[0], np.abs(local[:, 2]) - size[2]], axis=1)
        else:
            nearest = np.zeros_like(local)
            nearest[:, 2] = np.clip(local[:, 2], -size[2], size[2])
            out = np.minimum(out, np.linalg.norm(local - nearest, axis=1) - size[0])
            continue
        out = np.minimum(out, np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0))
    return out


def test_distances_equal_the_slow_twin():
    rng = np.random.default_rng(1)
    for n in (1, 2, 30):
        solids, T = random_solids(rng, n), random_pose(rng)
        points = rng.normal(0, 0.8, (2000, 3))
        want = slow_distances(solids, T, points)
        np.testing.assert_allclose(solid_distances(solids, T, points), want, atol=1e-12)
        np.testing.assert_allclose(solid_distances(solids, T, points, 0.1), np.minimum(want, 0.1), atol=1e-12)


@pytest.mark.parametrize("kind", [BOX, CYLINDER, CAPSULE])
def test_one_solid_agrees_with_trimesh_on_its_mesh(kind):
    rng = np.random.default_rng(kind)
    size = np.array([0.3, 0.2, 0.4]) if kind == BOX else np.array([0.2, 0.2, 0.4])
    mesh = {
        BOX: lambda: trimesh.creation.box(2 * size),
        CYLINDER: lambda: trimesh.creation.cylinder(size[0], 2 * size[2], sections=128),
        CAPSULE: lambda: trimesh.creation.capsule(2 * size[2], size[0], count=[64, 64]),
    }[kind]()
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    T = random_pose(rng)
    mesh.apply_transform(T)
    points = rng.normal(0, 0.7, (300, 3))
    want = -trimesh.proximity.signed_distance(mesh, points)
    solids = Solids(np.array([kind], np.uint8), T[None], size[None])
    np.testing.assert_allclose(solid_distances(solids, np.eye(4), points), want, atol=1e-3)


def test_the_nearest_point_is_the_smallest_distance():
    rng = np.random.default_rng(3)
    solids, T = random_solids(rng, 12), random_pose(rng)
    for shift in (0.0, 1.5, 4.0):
        points = rng.normal(0, 0.3, (500, 3)) + np.array([shift, 0, 0])
        every = solid_distances(solids, T, points)
        value, index = nearest_point(solids, T, points)
        assert value == pytest.approx(every.min(), abs=1e-12)
        assert index == every.argmin()


@pytest.mark.parametrize("distance", [-0.05, 0.0, 0.08])
def test_some_point_is_nearer_when_the_smallest_distance_is(distance):
    rng = np.random.default_rng(4)
    n_nearer = 0
    for _ in range(60):
        solids, T = random_solids(rng, 5), random_pose(rng)
        points = T[:3, 3] + rng.normal(0, 0.02, (20, 3)) + rng.normal(0, 0.8, 3)
        is_nearer = bool(solid_distances(solids, T, points).min() < distance)
        assert is_any_nearer(place(solids, T), points, distance) is is_nearer
        n_nearer += is_nearer
    assert 0 < n_nearer < 60
    assert not is_any_nearer(place(solids, T), np.empty((0, 3)), distance)


def test_no_point_within_reach_gives_the_reach_and_no_index():
    solids = Solids(np.array([BOX], np.uint8), np.eye(4)[None], np.full((1, 3), 0.1))
    assert nearest_point(solids, np.eye(4), [[5.0, 0, 0]], 0.5) == (0.5, -1)
    assert nearest_point(solids, np.eye(4), np.empty((0, 3)), 0.5) == (0.5, -1)


def test_points_of_a_wrong_shape_are_refused():
    solids = Solids(np.array([BOX], np.uint8), np.eye(4)[None], np.full((1, 3), 0.1))
    with pytest.raises(ValueError, match=r"points have shape \(4, 2\), must be \(n, 3\)"):
        solid_distances(solids, np.eye(4), np.zeros((4, 2)))
