"""Patches against a slow twin, and laws of windows."""

import numpy as np
import pytest

from forests.frames import Intrinsics
from nets.patches import MISSING, SAME_SURFACE_MM, Window, body_window, cut_patch, head_window

CAMERA = Intrinsics(60.0, 66.0, 31.5, 23.5)


def slow_patch(depth, kinds, camera, window, size, pixel_m):
    """Pixel by pixel, as the docstring says it."""
    relative, kind = np.full(size, MISSING), np.zeros(size, np.uint8)
    step = np.array([pixel_m * camera.fy, pixel_m * camera.fx]) / window.distance
    for index in np.ndindex(size):
        at = np.array([window.v, window.u]) + (np.array(index) - (np.array(size) - 1) / 2) * step
        middle = np.floor(at + 0.5).astype(int)
        low = np.minimum(middle, np.ceil(at - step / 2).astype(int))
        high = np.maximum(middle + 1, np.ceil(at + step / 2).astype(int))
        footprint = [
            (y, x)
            for y in range(low[0], high[0])
            for x in range(low[1], high[1])
            if 0 <= y < depth.shape[0] and 0 <= x < depth.shape[1] and depth[y, x]
        ]
        if not footprint:
            continue
        seed = tuple(middle) if tuple(middle) in footprint else footprint[0]
        values = [int(depth[p]) for p in footprint if abs(int(depth[p]) - int(depth[seed])) <= SAME_SURFACE_MM]
        relative[index] = (sum(values) + len(values) // 2) // len(values) - round(window.distance * 1e3)
        kind[index] = kinds[seed]
    return relative, kind


@pytest.mark.parametrize("pixel_m", [0.01, 0.034, 0.11])
@pytest.mark.parametrize("window", [Window(30.2, 22.7, 2.0), Window(3.0, 44.0, 1.3), Window(-300.0, 10.0, 2.0)])
def test_a_patch_is_that_of_the_slow_twin(window, pixel_m):
    rng = np.random.default_rng(5)
    depth = rng.choice([0, 1980, 2000, 2030, 2600], (48, 64)).astype(np.uint16)
    kinds = rng.integers(0, 3, depth.shape).astype(np.uint8)
    patch = cut_patch(depth, CAMERA, window, (15, 9), pixel_m, kinds)
    relative, kind = slow_patch(depth, kinds, CAMERA, window, (15, 9), pixel_m)
    np.testing.assert_array_equal(patch.relative, relative)
    np.testing.assert_array_equal(patch.kind, kind)


def wall_with_person(distance_mm):
    depth = np.full((48, 64), 4000, np.uint16)
    depth[10:40, 24:40] = distance_mm
    return depth


def test_the_distance_is_that_of_the_trunk_not_of_the_table_before_it():
    depth = wall_with_person(2000)
    depth[26:, :] = 1200
    window = body_window(depth, CAMERA, (24, 10, 40, 40), 2.0)
    assert window.distance == 2.0
    assert window.u == 32.0


def test_a_person_twice_as_far_has_the_same_patch():
    """Twice the distance, half the pixels: a patch is of a size in metres."""
    near, far = np.zeros((96, 128), np.uint16), np.zeros((48, 64), np.uint16)
    near[20:80, 48:80], far[10:40, 24:40] = 2000, 2000
    patches = []
    for depth, camera in ((near, Intrinsics(120.0, 120.0, 63.5, 47.5)), (far, Intrinsics(60.0, 60.0, 31.5, 23.5))):
        v, u = np.nonzero(depth)
        box = (u.min(), v.min(), u.max() + 1, v.max() + 1)
        window = body_window(depth, camera, box, 2.0)
        patches.append(cut_patch(depth, camera, window, (40, 30), 0.05).relative != MISSING)
    assert (patches[0] != patches[1]).mean() < 0.08
    assert patches[0].any()


def test_a_head_is_in_the_middle_of_its_patch():
    depth = wall_with_person(1500)
    window = head_window(depth, CAMERA, (27, 12, 37, 22))
    assert (window.u, window.v, window.distance) == (32.0, 17.0, 1.5)


@pytest.mark.parametrize("box", [(5, 5, 5, 9), (9, 5, 5, 9), (0, 0, np.nan, 4)])
def test_an_empty_box_is_refused(box):
    with pytest.raises(ValueError, match="is empty: it must be"):
        body_window(wall_with_person(2000), CAMERA, box, 2.0)


def test_a_box_in_which_nothing_is_is_refused():
    with pytest.raises(ValueError, match="shows nothing in the box"):
        head_window(np.zeros((48, 64), np.uint16), CAMERA, (5, 5, 9, 9))


def test_a_distance_of_a_millimetre_gives_a_patch_and_no_overflow():
    depth = np.full((48, 64), 65535, np.uint16)
    patch = cut_patch(depth, CAMERA, Window(30.0, 20.0, 0.3), (5, 5), 0.05)
    assert patch.relative.max() == 30_000
