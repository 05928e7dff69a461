"""The floor is found to the millimetre where it is seen, and refused where it is not."""

import numpy as np
import pytest

from forests.finder.floor import Floor, FloorPrior, NoFloorError, find_floor
from tests.reference_finder import CAMERA, SIZE, cast, figure, standing


def off(found, true):
    """Angle [degrees] and height [m] between two floors."""
    cosine = np.clip(found.normal @ true.normal, -1, 1)
    return np.degrees(np.arccos(cosine)), abs(found.height - true.height)


@pytest.mark.parametrize(("pitch", "height"), [(-0.1, 0.6), (0.0, 1.2), (0.3, 1.6), (0.9, 2.4)])
def test_a_floor_is_found_at_every_tilt_and_height(pitch, height):
    true = standing(pitch, height)
    angle, lift = off(find_floor(cast(true, figure(3.0, 0.2), wall=5.0), CAMERA), true)
    assert angle < 0.2
    assert lift < 0.01


def test_a_rolled_camera_has_a_rolled_floor():
    true = Floor(np.array([0.1, -np.sqrt(1 - 0.01 - 0.04), -0.2]), 1.3)
    angle, lift = off(find_floor(cast(true), CAMERA), true)
    assert angle < 0.2
    assert lift < 0.01


def test_noise_that_grows_with_depth_moves_the_floor_little():
    true = standing(0.25, 1.5)
    depth = cast(true, figure(3.0, 0.2), wall=5.0)
    z = depth / 1000
    noise = np.random.default_rng(1).normal(0, 1000 * (0.003 + 0.002 * z * z))
    angle, lift = off(find_floor(np.where(depth > 0, depth + noise, 0).astype(np.uint16), CAMERA), true)
    assert angle < 0.5
    assert lift < 0.02


def test_a_table_is_no_floor_though_it_covers_more_of_the_image():
    true = standing(0.35, 1.3)
    depth = cast(true, levels=[(0.8, 2.6, -0.9, 1.2, 0.74)], wall=4.0)
    found = find_floor(depth, CAMERA)
    assert off(found, true)[1] < 0.01


def test_the_same_seed_gives_the_same_floor():
    depth = cast(standing(), figure(2.5, -0.4), wall=5.0)
    first, second = find_floor(depth, CAMERA, seed=3), find_floor(depth, CAMERA, seed=3)
    assert first.normal.tobytes() == second.normal.tobytes()
    assert first.height == second.height


def test_points_of_the_floor_have_height_zero_in_its_frame():
    floor = standing(0.4, 1.7)
    T = floor.T_floor_camera
    assert np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3))
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    assert T[:3, 3] == pytest.approx([0, 0, 1.7])
    assert (T[:3, :3] @ [0, 0, 1])[1] == pytest.approx(0)
    points = np.random.default_rng(0).normal(size=(20, 3))
    assert (points @ T[:3, :3].T + T[:3, 3])[:, 2] == pytest.approx(points @ floor.normal + floor.height)
    assert floor.pitch == pytest.approx(0.4)


@pytest.mark.parametrize("what", ["empty", "wall", "speck", "lens"])
def test_an_image_without_a_floor_is_refused_with_a_reason(what):
    depth = np.zeros(SIZE, np.uint16)
    if what == "wall":
        depth[:] = 2500
    if what == "speck":
        depth[100:104, 50:54] = 1800
    if what == "lens":
        depth[:] = 300
    with pytest.raises(NoFloorError, match="no floor was found: "):
        find_floor(depth, CAMERA)


def test_a_floor_that_contradicts_what_is_known_is_refused():
    depth = cast(standing(0.3, 1.5), wall=5.0)
    assert find_floor(depth, CAMERA, FloorPrior(pitch=0.33, height=1.45)).height == pytest.approx(1.5, abs=0.01)
    for prior in (FloorPrior(height=0.8), FloorPrior(pitch=-0.1)):
        with pytest.raises(NoFloorError):
            find_floor(depth, CAMERA, prior)


def test_bad_values_are_refused():
    for bad in ({"pitch": 2.0}, {"height": -1.0}, {"height": 1.0, "height_tolerance": 0.0}):
        with pytest.raises(ValueError, match="must be"):
            FloorPrior(**bad)
    with pytest.raises(ValueError, match="unit vector"):
        Floor(np.array([0.0, -2.0, 0.0]), 1.0)
    with pytest.raises(ValueError, match="must be integer millimetres"):
        find_floor(np.ones(SIZE), CAMERA)
