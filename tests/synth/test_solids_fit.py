import numpy as np
import pytest
import trimesh

from synth.geometry import transform_points
from synth.occluders.distance import solid_distances
from synth.occluders.model import BOX, CAPSULE
from synth.occluders.registry import GENERATORS, make

CENTIMETRE = 0.01


def solid_mesh(kind, T, size):
    """One solid as a mesh by trimesh."""
    if kind == BOX:
        mesh = trimesh.creation.box(2 * size)
    elif kind == CAPSULE:
        mesh = trimesh.creation.capsule(2 * size[2], size[0], count=[16, 8])
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
    else:
        mesh = trimesh.creation.cylinder(size[0], 2 * size[2], sections=48)
    mesh.apply_transform(T)
    return mesh


def examples(kind, n):
    rng = np.random.default_rng(42)
    return [GENERATORS[kind].sample(rng) for _ in range(n)]


@pytest.mark.parametrize("kind", list(GENERATORS))
def test_every_surface_sample_of_the_mesh_lies_within_a_centimetre_of_the_solids_or_inside(kind):
    for spec in examples(kind, 6):
        occluder = make(spec)
        mesh = trimesh.Trimesh(occluder.mesh.vertices, occluder.mesh.faces, process=False)
        points, _ = trimesh.sample.sample_surface(mesh, 4000, seed=1)
        distance = solid_distances(occluder.solids, np.eye(4), points)
        assert distance.max() < CENTIMETRE, spec


@pytest.mark.parametrize("kind", list(GENERATORS))
def test_every_surface_sample_of_the_solids_lies_within_a_centimetre_of_the_mesh(kind):
    for spec in examples(kind, 3):
        occluder = make(spec)
        mesh = trimesh.Trimesh(occluder.mesh.vertices, occluder.mesh.faces, process=False)
        solids = occluder.solids
        points, outwards = [], []
        for row in zip(solids.kind, solids.T_object_solid, solids.size, strict=True):
            solid = solid_mesh(*row)
            on_solid, face = trimesh.sample.sample_surface(solid, 40, seed=2)
            points.append(on_solid)
            outwards.append(on_solid + 2e-3 * solid.face_normals[face])
        is_outer = solid_distances(solids, np.eye(4), np.concatenate(outwards)) > 1e-3
        points = np.concatenate(points)
        _, distance, _ = trimesh.proximity.closest_point(mesh, points[is_outer])
        # Where parts overlap, a solid's surface may lie inside another part's mesh without a solid there.
        assert np.quantile(distance, 0.99) < CENTIMETRE, spec
        assert distance.max() < 1.5 * CENTIMETRE, spec


@pytest.mark.parametrize("kind", list(GENERATORS))
def test_solids_are_posed_by_rotations_and_have_a_size(kind):
    for spec in examples(kind, 6):
        solids = make(spec).solids
        R = solids.T_object_solid[:, :3, :3]
        np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.tile(np.eye(3), (len(R), 1, 1)), atol=1e-9)
        np.testing.assert_allclose(np.linalg.det(R), 1, atol=1e-9)
        assert (solids.size > 0).all()
        assert solids.kind.dtype == np.uint8


def test_a_moved_object_keeps_its_distances():
    rng = np.random.default_rng(0)
    occluder = make(GENERATORS["dining_chair"].sample(rng))
    points = rng.normal(0, 0.5, (200, 3))
    T = trimesh.transformations.euler_matrix(0.1, 0.2, 0.9)
    T[:3, 3] = (1, 2, 3)
    moved = solid_distances(occluder.solids, T, transform_points(T, points))
    np.testing.assert_allclose(moved, solid_distances(occluder.solids, np.eye(4), points), atol=1e-9)
