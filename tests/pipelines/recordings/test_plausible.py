"""Depth that is no depth of a person is refused, with what would make sense of it; what is depth passes."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.recordings.layout import CameraLayout, Layout
from pipelines.recordings.plausible import ImplausibleError, judge_person, judge_values
from pipelines.recordings.readers import in_millimetres

CAMERA = CameraLayout(285.0, 285.0, 160.0, 120.0)
LAYOUT = Layout("*", "npy", 320, 240, CAMERA)


def person(z_mm=2300.0, noise_mm=3.0, seed=0):
    """(240, 320) float64 [mm]: somebody of 1.7 m, rounded like a cylinder; 0 around."""
    rng = np.random.default_rng(seed)
    v, u = np.indices((240, 320))
    half_height, half_width = 0.85 * 285e3 / z_mm, 0.25 * 285e3 / z_mm
    x, y = (u - 160) / half_width, (v - 120) / half_height
    depth = z_mm - 150.0 * np.sqrt(np.clip(1 - x**2, 0, 1)) + 40.0 * y + rng.normal(0, noise_mm, v.shape)
    return np.where((np.abs(x) < 1) & (np.abs(y) < 1), depth, 0.0)


def judged(values, layout=LAYOUT):
    judge_values("file", values, layout)
    depth = in_millimetres(values, layout)
    return judge_person("file", depth, layout.camera, lambda: layout.unit_of(values.dtype))


def integers(depth, scale=1.0, dtype=np.uint16):
    return np.minimum(np.rint(depth * scale), np.iinfo(dtype).max).astype(dtype)


@pytest.mark.parametrize("z_mm", [1300.0, 2300.0, 4000.0, 6500.0])
@pytest.mark.parametrize(
    "stored",
    [
        integers,
        lambda depth: integers(depth, dtype=np.int32),
        lambda depth: np.where(depth > 0, integers(depth), 65535).astype(np.uint16),
        lambda depth: np.where(depth > 0, depth, 32767).astype(np.int16),
        lambda depth: np.where(depth > 0, depth, -1).astype(np.int32),
        lambda depth: np.where(depth > 0, integers(depth), 65535).astype(np.int64),
        lambda depth: depth / 1000.0,
        lambda depth: (depth / 1000.0).astype(np.float16),
        lambda depth: np.where(depth > 0, depth / 1000.0, np.nan),
        lambda depth: np.where(depth > 0, depth / 1000.0, np.inf),
        lambda depth: np.where(depth > 0, depth / 1000.0, 1e10).astype(np.float32),
    ],
)
def test_depth_passes_however_nothing_is_marked(z_mm, stored):
    depth = person(z_mm)
    values = stored(depth)
    assert judged(values) == ""
    mm = in_millimetres(values, LAYOUT)
    assert ((mm > 0) == (depth > 0)).all()
    assert np.abs(mm - depth)[depth > 0].max() < (1 if values.dtype != np.float16 else 3)


@pytest.mark.parametrize("z_mm", [1300.0, 2300.0, 4000.0])
@pytest.mark.parametrize(
    ("noise_mm", "dtype"), [(0.0, np.uint16), (3.0, np.uint16), (25.0, np.int32), (3.0, np.float32)]
)
def test_swapped_bytes_are_told_and_read_where_the_layout_says_so(z_mm, noise_mm, dtype):
    depth = person(z_mm, noise_mm)
    right = (depth / 1000.0).astype(np.float32) if dtype == np.float32 else integers(depth)
    wrong = right.byteswap().astype(dtype)
    with pytest.raises(ImplausibleError, match=r"the bytes look swapped: .* set swap_bytes = true in a layout"):
        judged(wrong)
    assert judged(wrong.astype(right.dtype).byteswap()) == ""


def test_a_flat_person_with_swapped_bytes_is_told_by_the_distance():
    flat = np.where(person() > 0, 0x079E, 0).astype(np.uint16)
    assert judged(flat) == ""
    with pytest.raises(ImplausibleError, match=r"bytes look swapped: as they are, the median depth is 40.5 m"):
        judged(flat.byteswap())


def test_raw_files_are_told_their_own_setting():
    raw = replace(LAYOUT, format="raw")
    with pytest.raises(ImplausibleError, match="set big_endian = true"):
        judged(integers(person()).byteswap(), raw)
    with pytest.raises(ImplausibleError, match="set big_endian = false"):
        judged(integers(person()).byteswap(), replace(raw, big_endian=True))


@pytest.mark.parametrize(
    ("scale", "dtype", "proposed"),
    [
        (10.0, np.uint16, 0.1), (8.0, np.uint16, 0.125), (5.0, np.uint16, 0.2), (4.0, np.uint16, 0.25),
        (0.1, np.uint16, 10.0), (0.001, np.uint16, 1000.0), (100.0, np.int32, None),
        (1.0, np.float32, 1.0), (0.1, np.float32, 10.0), (1 / 25.4, np.float64, 25.4), (1 / 304.8, np.float64, 304.8),
    ],
)  # fmt: skip
def test_other_units_are_refused_and_the_right_one_is_among_those_proposed(scale, dtype, proposed):
    depth = person(3000.0)
    values = (depth * scale).astype(dtype) if np.issubdtype(dtype, np.floating) else integers(depth, scale, dtype)
    with pytest.raises(ImplausibleError) as caught:
        judged(values)
    if proposed is None:
        assert "no usual unit makes sense of it" in str(caught.value)
        return
    assert f"mm_per_unit = {proposed:g} (" in str(caught.value)
    told = replace(LAYOUT, mm_per_unit=proposed)
    assert judged(values, told) == ""
    close = np.abs(in_millimetres(values, told) - depth)[depth > 0].max()
    assert close <= max(1.0, proposed if values.dtype.kind in "iu" else 1.0)


def test_disparities_of_a_kinect_are_told_by_the_end_of_their_11_bits():
    depth = person()
    values = np.where(depth > 0, 1091.5 - 348000.0 / np.maximum(depth, 1), 2047).astype(np.uint16)
    with pytest.raises(ImplausibleError, match=r"largest value 2047, the end of 11 bits.*disparities of a Kinect"):
        judged(values)


def test_specks_are_nobody_and_what_is_far_or_cut_is_only_told():
    specks = np.zeros((240, 320), np.uint16)
    specks[::40, ::40] = 2000
    with pytest.raises(ImplausibleError, match="shows no person: the largest piece"):
        judged(specks)
    assert "unlikely for a person" in judged(integers(person(9500.0)))
    wall = np.full((240, 320), 9000, np.uint16)
    assert "unlikely for a person" in judged(wall)
    half = np.zeros((240, 320), np.uint16)
    half[:, :100] = 6000
    assert "a height of 5.1 m, which is unlikely" in judged(half)


def test_nothing_is_said_of_a_room_or_of_a_head_above_a_desk():
    assert judged(np.full((240, 320), 3000, np.uint16)) == ""
    head = np.zeros((240, 320), np.uint16)
    head[60:200, 120:200] = 700
    assert "unlikely" in judged(head)
