"""Camera presets agree with the published calibrations and fields of view."""

import math

import numpy as np
import pytest

from synth.render.presets import CAMERAS, MOUNTINGS, Mounting, camera_named, free_camera, mounting_named


def horizontal_field(name: str) -> float:
    c = CAMERAS[name]
    return math.degrees(math.atan((c.cx + 0.5) / c.fx) + math.atan((c.width - 0.5 - c.cx) / c.fx))


def test_every_preset_knows_its_name_and_has_its_centre_in_the_image() -> None:
    for name, preset in CAMERAS.items():
        assert camera_named(name) is preset
        assert preset.name == name
        assert 0.4 < preset.cx / preset.width < 0.6
        assert 0.4 < preset.cy / preset.height < 0.6


@pytest.mark.parametrize(
    ("name", "size", "degrees"),
    [
        ("kinect_v1", (640, 480), 58.0),
        ("kinect_v1_qvga", (320, 240), 58.5),
        ("kinect_v2", (512, 424), 70.0),
        ("azure_kinect", (640, 576), 65.0),
        ("realsense_d435", (848, 480), 90.0),
        ("realsense_d435_vga", (640, 480), 79.6),
    ],
)
def test_presets_have_the_size_and_field_of_the_data_sheets(
    name: str, size: tuple[int, int], degrees: float
) -> None:
    assert (CAMERAS[name].width, CAMERAS[name].height) == size
    assert horizontal_field(name) == pytest.approx(degrees, abs=1.0)


def test_a_free_camera_spans_its_field_between_the_outer_borders() -> None:
    c = free_camera(400, 300, math.radians(60.0))
    edge = c.backproject([[-0.5, 149.5], [399.5, 149.5]], [1.0, 1.0])
    np.testing.assert_allclose(edge[:, 0], [-math.tan(math.radians(30)), math.tan(math.radians(30))], atol=1e-12)
    np.testing.assert_allclose(edge[:, 1], 0.0, atol=1e-12)


@pytest.mark.parametrize("hfov", [0.0, -1.0, math.pi, math.nan])
def test_a_free_camera_refuses_an_impossible_field(hfov: float) -> None:
    with pytest.raises(ValueError, match="must be in"):
        free_camera(64, 48, hfov)


def test_unknown_names_list_the_known_ones() -> None:
    with pytest.raises(ValueError, match="azure_kinect, kinect_v1, kinect_v1_qvga, kinect_v2"):
        camera_named("kinect")
    with pytest.raises(ValueError, match="any, desk, robot, tripod"):
        mounting_named("ceiling")


def test_mountings_are_looked_up_and_refuse_reversed_ranges() -> None:
    assert mounting_named("robot") is MOUNTINGS["robot"]
    assert MOUNTINGS["desk"].distance == (0.6, 2.0)
    with pytest.raises(ValueError, match="height"):
        Mounting((2.0, 1.0), (0.0, 0.1), (1.0, 2.0))
    with pytest.raises(ValueError, match="pitch"):
        Mounting((1.0, 2.0), (0.0, math.nan), (1.0, 2.0))
