from dataclasses import fields

import numpy as np
import pytest
import trimesh

from synth.geometry import transform_points
from synth.occluders.kit.shapes import oval
from synth.occluders.model import BOX, CAPSULE, Solids
from synth.occluders.registry import GENERATORS, make
from synth.occluders.solids.distance import solid_distances

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


def accepted_spec(kind, rng):
    """A spec whose fields are drawn from their whole ranges, as far as they fit each other."""
    spec_type = GENERATORS[kind].spec_type
    while True:
        values = {}
        for entry in fields(spec_type):
            limits = entry.metadata
            if limits["type"] is float:
                values[entry.name] = rng.uniform(limits["low"], limits["high"])
            elif limits["type"] is int:
                values[entry.name] = rng.integers(limits["low"], limits["high"] + 1)
            else:
                values[entry.name] = rng.choice(limits.get("names", (False, True)))
        if values.get("top") == "round":
            values["width"] = values["depth"]
        try:
            return spec_type(**values)
        except ValueError:
            continue


@pytest.mark.parametrize("kind", list(GENERATORS))
def test_whatever_spec_is_accepted_can_be_built_and_is_filled(kind):
    rng = np.random.default_rng(9)
    for _ in range(20):
        spec = accepted_spec(kind, rng)
        occluder = make(spec)
        mesh = trimesh.Trimesh(occluder.mesh.vertices, occluder.mesh.faces, process=False)
        points, _ = trimesh.sample.sample_surface(mesh, 1500, seed=1)
        assert solid_distances(occluder.solids, np.eye(4), points).max() < CENTIMETRE, spec
        assert abs(mesh.vertices[:, 2].min()) < CENTIMETRE, spec


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


@pytest.mark.parametrize("ratio", [0.35, 0.6, 0.9, 0.97, 0.99, 0.999, 1.0])
def test_discs_fill_an_oval_of_any_ratio(ratio):
    part = oval(1.6 * ratio, 1.6, 0.03)
    solids = Solids(part.kind, part.T_part_solid, part.size)
    distance = solid_distances(solids, np.eye(4), part.vertices)
    assert distance.max() < CENTIMETRE
    assert len(solids.kind) <= 40
