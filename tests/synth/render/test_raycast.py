"""The renderers against ray casting by an independent library, on random scenes."""

import numpy as np
import pytest

from synth.geometry import transform_points
from synth.render.backends import renderer
from synth.render.records import Backend
from tests.reference_render import Layer, cast_rays, is_away_from_edges
from tests.render_scenes import NEAR, RandomScene, random_scene

N_SCENES = 120
N_SCENES_GL = 20
MAX_WRONG_AT_EDGES = 6
"""Pixels an image whose centre lies within 1/256 px of a side, where snapping may decide otherwise."""


def assert_layers_agree(layer: Layer, depth: np.ndarray, part: np.ndarray, instance: np.ndarray) -> None:
    is_inner = is_away_from_edges(layer)
    n_hits = np.count_nonzero(layer.depth)
    assert np.count_nonzero(is_inner & (layer.depth > 0)) > 0.35 * n_hits  # else nothing is tested
    error = np.abs(depth * 1e-3 - layer.depth)[is_inner]
    assert error.max(initial=0.0) < 1e-3
    assert np.array_equal(part[is_inner], layer.part[is_inner])
    assert np.array_equal(instance[is_inner], layer.instance[is_inner])
    assert np.count_nonzero((part != layer.part) | (instance != layer.instance)) <= MAX_WRONG_AT_EDGES


def assert_equals_rays(backend: Backend, scene: RandomScene) -> None:
    pair = backend.render(scene.T_camera_world, scene.body, scene.objects)
    composite = cast_rays(scene.camera, NEAR, scene.T_camera_world, scene.body, scene.objects)
    alone = cast_rays(scene.camera, NEAR, scene.T_camera_world, scene.body, ())
    assert_layers_agree(composite, pair.depth, pair.part, pair.instance)
    assert_layers_agree(alone, pair.body_depth, pair.body_part, np.zeros_like(pair.instance))
    class_of = np.zeros(256, np.uint8)
    for item in scene.objects:
        class_of[item.instance] = item.class_code
    assert np.array_equal(pair.occluder, class_of[pair.instance])


@pytest.mark.parametrize("first", range(0, N_SCENES, 20))
def test_numba_equals_ray_casting_away_from_edges(first: int) -> None:
    for seed in range(first, first + 20):
        scene = random_scene(seed)
        assert_equals_rays(renderer("numba", scene.camera, NEAR), scene)


def test_the_random_scenes_hold_open_meshes_and_faces_through_the_near_plane() -> None:
    n_open, n_crossing = 0, 0
    for seed in range(N_SCENES):
        scene = random_scene(seed)
        for item in scene.objects:
            z = transform_points(scene.T_camera_world @ item.T_world_mesh, item.mesh.vertices)[:, 2]
            in_face = z[item.mesh.faces]
            n_crossing += bool(((in_face.min(axis=1) < NEAR) & (in_face.max(axis=1) > NEAR)).any())
            n_open += not item.mesh.is_closed
    assert n_open >= 100
    assert n_crossing >= 50


def test_pyrender_equals_ray_casting_away_from_edges() -> None:
    scenes = [random_scene(seed) for seed in range(N_SCENES_GL)]
    try:
        renderer("pyrender", scenes[0].camera, NEAR)
    except RuntimeError as error:
        pytest.skip(str(error))
    for scene in scenes:
        assert_equals_rays(renderer("pyrender", scene.camera, NEAR), scene)


@pytest.mark.parametrize("seed", range(6))
def test_object_pixels_are_those_of_the_object_drawn_alone(seed: int) -> None:
    scene = random_scene(seed)
    pair = renderer("numba", scene.camera, NEAR).render(scene.T_camera_world, scene.body, scene.objects)
    for item in scene.objects:
        alone = cast_rays(scene.camera, NEAR, scene.T_camera_world, None, [item])
        n_pixels = np.count_nonzero(alone.depth)
        n_edge = np.count_nonzero((alone.depth > 0) & ~is_away_from_edges(alone, jump=np.inf))
        assert abs(int(pair.object_pixels[item.instance]) - n_pixels) <= 0.05 * n_edge + 2
