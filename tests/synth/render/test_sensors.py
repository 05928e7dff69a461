"""Sensor models obey the equations they cite, and the geometry they claim."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from synth.camera import Camera
from synth.render.presets import CAMERAS
from synth.render.sensors import RANDOM, SENSOR_NAMES, apply_sensor, sensor
from synth.render.sensors.geometry import (
    bridge_pinholes,
    disparity_of,
    drop_unsupported,
    fill_gaps,
    hidden_from_right,
    incidence_cosine,
    smooth_noise,
)
from synth.render.sensors.stereo import ActiveStereo
from synth.render.sensors.structured_light import StructuredLight
from synth.render.sensors.time_of_flight import TimeOfFlight

SENSOR_CLASSES = [name for name in SENSOR_NAMES if name != RANDOM]
REAL = [name for name in SENSOR_NAMES if name not in ("ideal", RANDOM)]
OWN_CAMERA = {
    "ideal": CAMERAS["kinect_v2"],
    "kinect_v1": CAMERAS["kinect_v1"],
    "kinect_v2": CAMERAS["kinect_v2"],
    "realsense_d435": CAMERAS["realsense_d435"],
}
SMALL = Camera(160, 120, 143.0, 143.0, 79.5, 59.5)


def plane(camera: Camera, distance: float, angle: float = 0.0) -> NDArray[np.float64]:
    """(height, width) depth [m] of a plane through (0, 0, distance), turned about the vertical by the angle."""
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    depth = distance * math.cos(angle) / (math.cos(angle) + math.sin(angle) * x)
    depth = np.where(depth > 0, depth, 0.0)
    return np.tile(depth, (camera.height, 1))


def millimetres(depth: NDArray[np.float64]) -> NDArray[np.uint16]:
    return np.rint(1000.0 * np.minimum(depth, 60.0)).astype(np.uint16)


def room(camera: Camera) -> NDArray[np.uint16]:
    """A tilted wall, a floor, a box, a rod, and a hole without return."""
    depth = plane(camera, 4.0, 0.3)
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    with np.errstate(divide="ignore"):
        floor = np.where(y > 0.05, 1.2 / y, np.inf)
    depth = np.minimum(depth, floor[:, None])
    h, w = camera.height, camera.width
    depth[h // 4 : 3 * h // 4, w // 2 : 3 * w // 4] = 2.0
    depth[:, w // 4 : w // 4 + max(w // 80, 1)] = 2.5
    depth[: h // 8, : w // 8] = 0.0
    return millimetres(depth)


@pytest.mark.parametrize("name", SENSOR_NAMES)
def test_the_same_seed_gives_the_same_bytes_and_the_input_is_left_alone(name: str) -> None:
    clean = room(SMALL)
    before = clean.copy()
    one = apply_sensor(name, clean, SMALL, np.random.default_rng([7, 3]))
    two = apply_sensor(name, clean, SMALL, np.random.default_rng([7, 3]))
    assert one.dtype == np.uint16
    assert one.shape == clean.shape
    assert not np.shares_memory(one, clean)
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(clean, before)
    if name != "ideal":
        other = apply_sensor(name, clean, SMALL, np.random.default_rng([7, 4]))
        assert (one != other).mean() > 0.3


def test_the_ideal_sensor_changes_nothing() -> None:
    clean = room(SMALL)
    np.testing.assert_array_equal(apply_sensor("ideal", clean, SMALL, np.random.default_rng(0)), clean)


@pytest.mark.parametrize("name", SENSOR_NAMES)
@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1), (3, 2)])
def test_tiny_images_and_empty_ones_stay_what_they_are(name: str, size: tuple[int, int]) -> None:
    camera = Camera(*size, 100.0, 100.0, 0.5 * (size[0] - 1), 0.5 * (size[1] - 1))
    nothing = np.zeros((camera.height, camera.width), np.uint16)
    assert not apply_sensor(name, nothing, camera, np.random.default_rng(0)).any()
    wall = apply_sensor(name, nothing + np.uint16(2000), camera, np.random.default_rng(0))
    assert wall.shape == nothing.shape
    assert np.all((wall == 0) | (np.abs(wall.astype(int) - 2000) < 400))


@pytest.mark.parametrize("name", SENSOR_CLASSES)
@pytest.mark.parametrize("value", [1, 40, 65535])
def test_depths_out_of_range_read_zero_or_stay(name: str, value: int) -> None:
    clean = np.full((SMALL.height, SMALL.width), value, np.uint16)
    out = apply_sensor(name, clean, SMALL, np.random.default_rng(0))
    assert np.all(out == (clean if name == "ideal" else 0))


def test_a_random_sensor_is_one_of_the_others_drawn_from_the_generator() -> None:
    clean, found = room(SMALL), set()
    for seed in range(24):
        rng = np.random.default_rng(seed)
        out = apply_sensor(RANDOM, clean, SMALL, rng)
        again = np.random.default_rng(seed)
        name = SENSOR_CLASSES[int(again.integers(len(SENSOR_CLASSES)))]
        assert np.array_equal(out, apply_sensor(name, clean, SMALL, again))
        found.add(name)
    assert found == set(SENSOR_CLASSES)


def test_pinholes_are_bridged_and_nothing_else_is() -> None:
    rng = np.random.default_rng(4)
    disparity = np.where(rng.random((40, 50)) < 0.12, 0.0, rng.uniform(5.0, 6.0, (40, 50))).astype(np.float32)
    disparity[10:20, 10:20] = 0.0
    out = bridge_pinholes(disparity)
    for v in range(40):
        for u in range(50):
            around = disparity[max(v - 1, 0) : v + 2, max(u - 1, 0) : u + 2]
            lit = np.sort(around[around > 0.0])
            is_inside = 0 < v < 39 and 0 < u < 49
            is_hole = is_inside and disparity[v, u] == 0.0 and len(lit) >= 6
            assert out[v, u] == (lit[len(lit) // 2] if is_hole else disparity[v, u])
    assert (out > 0.0).sum() > (disparity > 0.0).sum()


def test_bad_input_gets_one_clear_error() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="ideal, kinect_v1, kinect_v2, realsense_d435"):
        apply_sensor("kinect", room(SMALL), SMALL, rng)
    with pytest.raises(TypeError, match=r"float32.*uint16"):
        apply_sensor("ideal", room(SMALL).astype(np.float32), SMALL, rng)
    with pytest.raises(ValueError, match=r"\(120, 159\).*\(120, 160\)"):
        apply_sensor("ideal", room(SMALL)[:, 1:], SMALL, rng)


def test_a_model_of_ones_own_can_be_passed() -> None:
    clean = millimetres(plane(SMALL, 2.0))
    fine = apply_sensor(ActiveStereo(subpixel=0.01, steps=1024.0), clean, SMALL, np.random.default_rng(0))
    coarse = apply_sensor(sensor("realsense_d435"), clean, SMALL, np.random.default_rng(0))
    assert fine[fine > 0].std() < 0.2 * coarse[coarse > 0].std()


def published_sigma(name: str, z: float, angle: float, camera: Camera) -> float:
    """The cited equations, written out once more [m]."""
    lean = angle / (math.pi / 2 - angle)
    if name == "kinect_v1":
        return 0.0012 + 0.0019 * (z - 0.4) ** 2 + 0.0001 / math.sqrt(z) * lean**2
    if name == "kinect_v2":
        return (1.5 - 0.5 * z + 0.3 * z**2 + 0.1 * z**1.5 * lean**2) / 1000.0
    return z**2 * 0.08 / (camera.fx * 0.050)


@pytest.mark.parametrize("name", REAL)
@pytest.mark.parametrize(
    ("z", "degrees"), [(0.9, 0.0), (1.7, 0.0), (3.0, 0.0), (4.2, 0.0), (2.0, 50.0), (2.0, 65.0)]
)
def test_noise_on_a_plane_has_the_published_spread(name: str, z: float, degrees: float) -> None:
    camera = OWN_CAMERA[name]
    angle = math.radians(degrees)
    half = int(0.06 * camera.fx)
    rows = slice(int(camera.cy) - half, int(camera.cy) + half)
    columns = slice(int(camera.cx) - half, int(camera.cx) + half)
    errors, weights = [], []
    for seed in range(12):
        # Distances spread over a disparity step, so that its phase averages out.
        true = plane(camera, z * (1.0 + 0.012 * (seed / 12 - 0.5)), angle)
        measured = apply_sensor(name, millimetres(true), camera, np.random.default_rng(seed))[rows, columns]
        error = measured / 1000.0 - true[rows, columns]
        errors.append(error[measured > 0])
        sigmas = [published_sigma(name, d, angle, camera) for d in true[0, columns]]
        weights.append(np.mean(np.square(sigmas)))
    error = np.concatenate(errors)
    assert error.size > 0.9 * 12 * (2 * half) ** 2
    expected = math.sqrt(float(np.mean(weights)))
    assert np.sqrt(np.mean(error**2)) == pytest.approx(expected, rel=0.10)
    assert abs(error.mean()) < 0.25 * expected


def test_kinect_v1_depths_lie_on_the_devices_own_table() -> None:
    camera = CAMERAS["kinect_v1"]
    depth = np.linspace(0.55, 7.0, camera.width)[None, :] + 0.0 * np.arange(camera.height)[:, None]
    out = apply_sensor("kinect_v1", millimetres(depth), camera, np.random.default_rng(0))
    # libfreenect's table, written out once more: centimetres, quarter pixels of the 1280 px imager.
    m = ((np.arange(1089) - 800) / 4 - 0.375) * 0.1042
    table = np.floor(10.0 * (m * 120.0 / (7.5 - m) + 120.0)).astype(int)
    assert set(np.unique(out[out > 0])) <= set(table.tolist())
    assert np.unique(out).size > 200
    near = np.sort(table[(table > 2900) & (table < 3100)])
    assert np.diff(near).mean() == pytest.approx(3000.0**2 / (8 * 575.8 * 75.0), rel=0.03)


def test_stereo_depths_lie_on_the_disparity_grid() -> None:
    camera = CAMERAS["realsense_d435"]
    out = apply_sensor("realsense_d435", room(camera), camera, np.random.default_rng(0))
    z = np.unique(out[out > 0]).astype(float)
    steps = np.rint(32.0 * 50.0 * camera.fx / z)
    assert np.abs(32.0 * 50.0 * camera.fx / steps - z).max() <= 0.5 + 1e-6
    assert z.size > 100


@pytest.mark.parametrize(("name", "baseline"), [("kinect_v1", 0.075), ("realsense_d435", 0.050)])
@pytest.mark.parametrize(("near", "far"), [(1.0, 2.0), (1.5, 4.0)])
def test_the_shadow_of_a_box_lies_on_its_left_and_is_as_wide_as_the_disparities_differ(
    name: str, baseline: float, near: float, far: float
) -> None:
    camera = OWN_CAMERA[name]
    h, w = camera.height, camera.width
    left, right = w // 2, 3 * w // 4
    clean = np.full((h, w), round(1000 * far), np.uint16)
    clean[h // 4 : 3 * h // 4, left:right] = round(1000 * near)
    out = apply_sensor(name, clean, camera, np.random.default_rng(0))[h // 4 + 20 : 3 * h // 4 - 20]
    width = baseline * camera.fx * (1.0 / near - 1.0 / far)
    empty = (out[:, : (left + right) // 2] == 0)[:, w // 8 :].sum(axis=1)
    fattened = 1.2 if name == "realsense_d435" else 0.0
    assert np.median(empty) == pytest.approx(width - fattened, abs=1.6)
    columns = np.nonzero((out == 0).mean(axis=0) > 0.5)[0]
    columns = columns[columns >= w // 8]
    assert columns.max() < left + 2
    assert columns.min() > left - width - 3
    assert (out[:, right + 8 :] == 0).mean() < 0.01


def test_a_rod_hides_no_more_than_its_own_width() -> None:
    disparity = np.full((1, 100), 5.0, np.float32)
    disparity[0, 60:63] = 25.0  # its shadow is shifted by 20 px, well clear of the rod
    hidden = np.nonzero(hidden_from_right(disparity, is_left_border_hidden=False)[0])[0]
    assert hidden.min() >= 39
    assert hidden.max() <= 43
    assert 3 <= hidden.size <= 4


def naive_hidden(disparity: NDArray[np.float32]) -> NDArray[np.bool_]:
    """A pixel is hidden where a surface a pixel of disparity nearer is seen within half a column of it."""
    out = np.zeros(disparity.shape, bool)
    u = np.arange(disparity.shape[1])
    for v, row in enumerate(disparity):
        seen_at = u - row
        for i in u[row > 0]:
            others = (row > row[i] + 1.0) & (np.floor(seen_at) <= np.floor(seen_at[i] + 0.5))
            out[v, i] = np.any(others & (np.floor(seen_at) + 1 >= np.floor(seen_at[i] + 0.5)))
    return out


def test_shadows_equal_the_slow_twins() -> None:
    rng = np.random.default_rng(5)
    disparity = np.repeat(rng.uniform(2.0, 60.0, (40, 20)), 6, axis=1).astype(np.float32)
    disparity[rng.random(disparity.shape) < 0.1] = 0.0
    np.testing.assert_array_equal(
        hidden_from_right(disparity, is_left_border_hidden=False), naive_hidden(disparity)
    )


def test_the_left_border_of_stereo_has_no_partner() -> None:
    camera = CAMERAS["realsense_d435"]
    out = apply_sensor("realsense_d435", millimetres(plane(camera, 1.0)), camera, np.random.default_rng(0))
    band = 0.050 * camera.fx / 1.0  # D400 data sheet, invalid depth band: B F / Z
    assert (out[:, : int(band) - 2] == 0).all()
    assert (out[:, int(band) + 3 :] > 0).mean() > 0.99


@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0, 80.0])
def test_incidence_on_a_plane_is_exact(degrees: float) -> None:
    camera = CAMERAS["kinect_v2"]
    angle = math.radians(degrees)
    depth = plane(camera, 2.0, angle)
    disparity = np.where(depth > 0, 1.0 / np.maximum(depth, 1e-9), 0.0).astype(np.float32)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.backproject(np.stack([u, v], axis=-1), np.ones(u.shape))
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    expected = rays @ np.array([math.sin(angle), 0.0, math.cos(angle)])
    is_sure = (depth > 0) & (depth < 20.0)
    is_sure[[0, 1, -2, -1]] = is_sure[:, [0, 1, -2, -1]] = False
    np.testing.assert_allclose(incidence_cosine(disparity, camera)[is_sure], expected[is_sure], atol=2e-3)


def test_incidence_does_not_look_across_an_edge() -> None:
    clean = np.full((SMALL.height, SMALL.width), 4000, np.uint16)
    clean[:, 80:] = 2000
    cosine = incidence_cosine(disparity_of(clean, 1.0), SMALL)
    flat = incidence_cosine(disparity_of(np.full_like(clean, 2000), 1.0), SMALL)
    np.testing.assert_allclose(cosine, flat, atol=1e-5)


def test_no_return_stays_no_return_but_for_a_rim() -> None:
    clean = np.zeros((SMALL.height, SMALL.width), np.uint16)
    clean[40:80, 60:100] = 2000
    grown = np.zeros(clean.shape, bool)
    grown[33:87, 53:107] = True
    for name in REAL:
        out = apply_sensor(name, clean, SMALL, np.random.default_rng(1))
        assert not out[~grown].any()
        assert (out[46:74, 72:94] > 0).mean() > 0.98
    flying = apply_sensor("kinect_v2", clean, SMALL, np.random.default_rng(1))
    assert not flying[clean == 0].any()


def test_foreground_grows_in_stereo_and_does_not_in_structured_light() -> None:
    areas = {}
    for name in ("kinect_v1", "realsense_d435"):
        camera = OWN_CAMERA[name]
        clean = np.full((camera.height, camera.width), 3000, np.uint16)
        clean[100:300, 300:500] = 2700
        out = apply_sensor(name, clean, camera, np.random.default_rng(0))
        areas[name] = float(((out > 2450) & (out < 2850))[80:320, 280:520].sum()) / 200**2
    assert areas["kinect_v1"] == pytest.approx(1.0, abs=0.02)
    assert 1.01 < areas["realsense_d435"] < 1.05


def test_flying_pixels_lie_between_the_two_surfaces_and_only_at_their_edge() -> None:
    camera = CAMERAS["kinect_v2"]
    clean = np.full((camera.height, camera.width), 3000, np.uint16)
    clean[:, 256:] = 1500
    out = apply_sensor("kinect_v2", clean, camera, np.random.default_rng(0))
    is_between = (out > 1560) & (out < 2940)
    columns = np.unique(np.nonzero(is_between)[1])
    assert set(columns.tolist()) <= {255, 256}
    assert 0.1 < is_between[:, 255:257].mean() < 0.5
    # The nearer surface is four times as bright: it pulls the mixture more than the far one does.
    far_side = out[:, 255][is_between[:, 255]]
    near_side = out[:, 256][is_between[:, 256]]
    assert (3000 - far_side).mean() > (near_side - 1500).mean()


def test_far_corners_lose_their_return_before_the_centre_does() -> None:
    camera = CAMERAS["kinect_v2"]
    out = apply_sensor("kinect_v2", millimetres(plane(camera, 6.0)), camera, np.random.default_rng(0))
    assert (out[192:232, 236:276] > 0).all()
    assert not out[:10, :10].any()
    near = apply_sensor("kinect_v2", millimetres(plane(camera, 2.0)), camera, np.random.default_rng(0))
    assert (near > 0).all()


@pytest.mark.parametrize("name", REAL)
def test_steep_surfaces_give_no_return(name: str) -> None:
    camera = OWN_CAMERA[name]
    depth = plane(camera, 3.0, math.radians(87.5))
    row = np.zeros(depth.shape)
    columns = slice(int(camera.cx) - 20, int(camera.cx) + 20)
    row[:, columns] = depth[:, columns]
    row[(row > 6.0) | (row < 1.0)] = 0.0
    out = apply_sensor(name, millimetres(row), camera, np.random.default_rng(0))
    assert (out[(row > 2.0) & (row < 5.0)] > 0).mean() < 0.05


def test_thin_things_and_specks_have_no_support() -> None:
    disparity = np.full((60, 60), 10.0, np.float32)
    disparity[:, 30] = 20.0
    disparity[10, 10] = 20.0
    kept = drop_unsupported(disparity, 4.0, 0.03, 4)
    assert not kept[10, 10]
    assert not kept[8:-8, 30].any()
    disparity[:, 28:33] = 20.0
    assert (drop_unsupported(disparity, 4.0, 0.03, 4)[:, 29:32] > 0).all()
    assert (kept[:, 40:] == 10.0).all()


def test_gaps_between_fingers_are_filled_and_outlines_stay() -> None:
    hand = np.full((60, 80), 5.0, np.float32)
    hand[:40, 20:60] = 20.0
    for left in (27, 35, 43, 51):
        hand[:30, left : left + 3] = 5.0  # between fingers of five pixels
    filled = fill_gaps(hand, 4.0, 0.03, 8)
    assert (filled[8:26, 24:56] == 20.0).all()
    outside = np.ones_like(hand, bool)
    outside[:40, 20:60] = False
    np.testing.assert_array_equal(filled[outside], hand[outside])
    wide = np.full((60, 80), 5.0, np.float32)
    wide[:, 20:32] = wide[:, 44:60] = 20.0
    np.testing.assert_array_equal(fill_gaps(wide, 4.0, 0.03, 8), wide)


def test_a_window_takes_the_nearer_surface_as_in_the_slow_twin() -> None:
    rng = np.random.default_rng(0)
    disparity = rng.choice(np.float32([0.0, 5.0, 5.1, 8.0, 20.0]), (40, 50), p=(0.2, 0.2, 0.1, 0.2, 0.3))
    filled = fill_gaps(disparity, 3.0, 0.03, 8)
    angles = 2.0 * np.pi * np.array([0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13]) / 16
    offsets = np.rint(3.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)).astype(int)
    expected = disparity.copy()
    for v, u in np.ndindex(disparity.shape):
        at = offsets + np.array([u, v])
        at = at[((at >= 0) & (at < (50, 40))).all(axis=1)]
        near = [d for d in disparity[at[:, 1], at[:, 0]] if 0.97 * d > disparity[v, u]]
        if len(near) >= 8:
            expected[v, u] = np.sort(near)[len(near) // 2]
    assert (expected != disparity).any()
    np.testing.assert_array_equal(filled, expected)


@pytest.mark.parametrize("sigma", [0.0, 1.0, 1.5, 3.0])
def test_smooth_noise_has_unit_variance_everywhere(sigma: float) -> None:
    rng = np.random.default_rng(0)
    fields = np.stack([smooth_noise(rng, (40, 50), sigma) for _ in range(400)])
    assert fields.dtype == np.float32
    assert fields.var() == pytest.approx(1.0, abs=0.03)
    assert np.abs(fields.var(axis=0)[[0, 0, -1, 20], [0, -1, 0, 25]] - 1.0).max() < 0.3
    assert abs(fields.mean()) < 0.02
    kurtosis = float((fields**4).mean())
    assert kurtosis == pytest.approx(3.0, abs=0.2)
    correlation = float((fields[:, :, 1:] * fields[:, :, :-1]).mean())
    expected = math.exp(-1.0 / (4.0 * sigma**2)) if sigma else 0.0
    assert correlation == pytest.approx(expected, abs=0.04)


def test_models_are_frozen_records() -> None:
    for model in (StructuredLight(), TimeOfFlight(), ActiveStereo()):
        with pytest.raises(AttributeError):
            model.edge = 0.5  # type: ignore[misc]
