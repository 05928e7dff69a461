"""Crops hold the foreground and nothing else; samples are the same pixels in every layer that shows them."""

import numpy as np
import pytest

from forests.crops import NOTHING, CropWriter, crop_image, foreground_box
from forests.frames import DepthFrame, FrameBatch, FrameSubset, Intrinsics, LabelTable, check_depth
from forests.oarf.config import OARFConfig
from forests.samples import draw_pixels, gather, image_of

CAMERA = Intrinsics(60.0, 62.0, 31.5, 23.5)
LABELS = LabelTable(("head", "trunk"), ("table", "box"), ("head", "neck", "torso"))


def scene(rng: np.random.Generator, height: int = 48, width: int = 64) -> tuple[np.ndarray, ...]:
    """A person (labels 1, 2) as a rectangle, partly behind a table (3): depth, label, body depth, body label."""
    body_depth = np.zeros((height, width), np.uint16)
    body_label = np.zeros((height, width), np.uint8)
    left = int(rng.integers(5, 25))
    body_depth[6:40, left : left + 20] = 2000 + rng.integers(0, 50, (34, 20))
    body_label[6:14, left : left + 20], body_label[14:40, left : left + 20] = 1, 2
    depth, label = body_depth.copy(), body_label.copy()
    depth[28:44, 2:60], label[28:44, 2:60] = 1700, 3
    return depth, label, body_depth, body_label


def batch(n: int, seed: int = 0) -> FrameBatch:
    """A few such scenes."""
    rng = np.random.default_rng(seed)
    images = [np.stack(column) for column in zip(*(scene(rng) for _ in range(n)), strict=True)]
    joints = rng.normal(size=(n, 3, 3)).astype(np.float32)
    return FrameBatch(images[0], images[1], joints, CAMERA, LABELS, images[2], images[3])


@pytest.mark.parametrize("max_bytes", [0, 2**31])
def test_a_crop_is_the_image_with_nothing_around_it(max_bytes):
    """In memory or mapped from a file."""
    frames = batch(5)
    with CropWriter(max_bytes) as writer:
        origins = [writer.add(frame.depth, frame.camera) for frame in frames]
        crops = writer.finish()
    for i, frame in enumerate(frames):
        width, height = crops.width[i], crops.height[i]
        crop = crops.pixels[crops.start[i] : crops.start[i] + width * height].reshape(height, width)
        column, row = origins[i]
        assert (column, row) == tuple(crops.origin[i])
        inside = frame.depth[row + 1 : row + height - 1, column + 1 : column + width - 1]
        assert np.array_equal(np.where(inside == 0, NOTHING, inside), crop[1:-1, 1:-1])
        assert (inside > 0).sum() == (frame.depth > 0).sum()
        assert (crop[[0, -1]] == NOTHING).all()
        assert (crop[:, [0, -1]] == NOTHING).all()
    assert np.allclose(crops.intrinsics, [CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy])


def test_the_foreground_box_is_what_numpy_says():
    rng = np.random.default_rng(3)
    for density in (0.5, 0.01, 0.001):
        depth = (rng.random((40, 57)) < density).astype(np.uint16)
        rows, columns = np.nonzero(depth)
        expected = (
            (0, 0, 0, 0) if len(rows) == 0 else (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
        )
        assert foreground_box(depth) == expected


def test_an_empty_image_gives_a_crop_of_nothing():
    crops = crop_image(np.zeros((10, 12), np.uint16), CAMERA)
    assert (crops.pixels == NOTHING).all()
    assert crops.width[0] == crops.height[0] == 2


def test_body_pixels_seen_in_both_layers_are_drawn_alike():
    """The modes of a forest are compared on the same pixels."""
    frames = batch(4)
    full = gather(frames, "body", 10_000, 0, seed=5)
    for layer_pixels in (40, 200):
        body = gather(frames, "body", layer_pixels, 0, seed=5)
        for index, frame in enumerate(frames):
            drawn_body = draw_pixels(frame.body_label, 2, layer_pixels, 0, 5, index)
            drawn_seen = draw_pixels(frame.label, 2, layer_pixels, layer_pixels, 5, index)
            is_seen = frame.label[tuple(drawn_body.T)] <= 2
            seen = {tuple(p) for p in drawn_seen}
            assert {tuple(p) for p in drawn_body[is_seen]} <= seen
        assert len(body.samples.frame) == layer_pixels * len(frames)
    assert len(full.samples.frame) == sum((f.body_label > 0).sum() for f in frames)


def test_any_number_of_threads_gathers_the_same():
    frames = batch(9)
    one, three = (gather(frames, "composite", 40, 20, seed=2, n_threads=n) for n in (1, 3))
    for a, b in zip(
        (*one.samples, *one.crops, one.joints), (*three.samples, *three.crops, three.joints), strict=True
    ):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("mode", ["baseline", "semantic"])
@pytest.mark.parametrize("n_frames", [1, 100, 2499, 2500, 2501, 30_000, 10**8])
def test_many_frames_give_fewer_pixels_each(mode, n_frames):
    config = OARFConfig(mode=mode, n_pixels=1000, n_occluder_pixels=500)
    body, objects = config.pixels_a_frame(n_frames)
    assert 1 <= body <= 1000
    assert objects <= (0 if mode == "baseline" else 500)
    assert (body + objects) * n_frames <= config.max_samples or (body, objects) == (1, 0)
    is_full = n_frames * (1000 if mode == "baseline" else 1500) <= config.max_samples
    assert (body == 1000) == is_full
    if mode == "semantic" and objects > 20:
        assert body / objects == pytest.approx(2.0, rel=0.1)


def test_pixels_are_drawn_evenly():
    """Over many seeds every pixel of a part comes up about as often (binomial, six standard deviations)."""
    label = np.ones((10, 10), np.uint8)
    counts = np.zeros((10, 10), int)
    n_draws = 400
    for seed in range(n_draws):
        drawn = draw_pixels(label, 2, 25, 0, seed, 0)
        assert len(np.unique(drawn, axis=0)) == 25
        np.add.at(counts, tuple(drawn.T), 1)
    deviation = np.sqrt(n_draws * 0.25 * 0.75)
    assert np.abs(counts - n_draws * 0.25).max() < 6 * deviation


def test_samples_lie_on_their_labels_and_lift_to_the_surface():
    frames = batch(3)
    training = gather(frames, "composite", 100, 50, seed=1)
    samples, crops = training.samples, training.crops
    assert (np.diff(samples.frame) >= 0).all()
    u = samples.x + crops.origin[samples.frame, 0]
    v = samples.y + crops.origin[samples.frame, 1]
    assert np.array_equal(frames.label[samples.frame, v, u], samples.label)
    assert np.array_equal(frames.depth[samples.frame, v, u], samples.z_mm)
    points = samples.points(crops)
    assert np.allclose(points[:, 0], (u - CAMERA.cx) * samples.z_mm / 1000 / CAMERA.fx, atol=1e-6)
    assert np.allclose(points[:, 1], (v - CAMERA.cy) * samples.z_mm / 1000 / CAMERA.fy, atol=1e-6)
    for index in range(3):
        of_frame = samples.label[samples.frame == index]
        assert (of_frame <= 2).sum() == 100
        assert (of_frame > 2).sum() == 50
    assert np.array_equal(training.joints, frames.joints)


def test_a_layer_without_a_body_is_cut_from_the_composite():
    """Real frames in which nothing hides anyone."""
    frames = batch(1)
    alone = FrameBatch(frames.depth, frames.label, frames.joints, CAMERA, LABELS)[0]
    depth, label = image_of(alone, "body")
    assert set(np.unique(label)) == {0, 1, 2}
    assert np.array_equal(depth > 0, label > 0)
    assert not alone.is_occluded.any()


def test_a_pixel_that_the_sensor_lost_is_never_drawn():
    frame = batch(1)[0]
    holes = frame.depth.copy()
    holes[::2] = 0
    noisy = DepthFrame(
        holes, frame.label, frame.body_depth, frame.body_label, frame.joints, frame.is_occluded, CAMERA
    )
    depth, label = image_of(noisy, "composite")
    assert (label[depth == 0] == 0).all()
    assert (label[depth > 0] > 0).all()


def test_a_frame_without_a_person_gives_no_samples():
    empty = np.zeros((2, 20, 20), np.uint16)
    frames = FrameBatch(empty, empty.astype(np.uint8), np.zeros((2, 3, 3), np.float32), CAMERA, LABELS)
    with pytest.raises(ValueError, match="none of the 2 frames shows a labelled pixel in the composite layer"):
        gather(frames, "composite", 10, 10, 0)


def test_a_subset_is_its_frames():
    frames = batch(5)
    subset = FrameSubset(frames, (3, 1))
    assert len(subset) == 2
    assert np.array_equal(subset[0].depth, frames[3].depth)
    assert subset.labels == LABELS


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"depth": np.zeros((2, 3), np.uint16)}, "depth has shape"),
        ({"label": np.zeros((2, 4, 5), np.int32)}, "label is int32"),
        ({"label": np.full((2, 4, 5), 9, np.uint8)}, "label 9 is not in 0..4"),
        ({"joints": np.zeros((2, 4, 3), np.float32)}, "joints is float32"),
        ({"joints": np.full((2, 3, 3), np.inf, np.float32)}, "joints must be finite"),
        ({"body_depth": np.zeros((2, 4, 5), np.uint16)}, "must be given together"),
        ({"is_occluded": np.zeros((2, 3))}, "is_occluded is float64"),
    ],
)
def test_wrong_arrays_are_refused_by_name(changes, message):
    good = {
        "depth": np.zeros((2, 4, 5), np.uint16),
        "label": np.zeros((2, 4, 5), np.uint8),
        "joints": np.zeros((2, 3, 3), np.float32),
        "camera": CAMERA,
        "labels": LABELS,
    }
    with pytest.raises(ValueError, match=message):
        FrameBatch(**{**good, **changes})


@pytest.mark.parametrize(
    ("depth", "message"),
    [
        (np.zeros((2, 3, 4), np.uint16), r"must be \(height, width\)"),
        (np.zeros((0, 4), np.uint16), r"must be \(height, width\)"),
        (np.zeros((3, 4), np.float32), "must be integer millimetres"),
        (np.full((3, 4), -1), "must be in 0..65535"),
        (np.full((3, 4), 70000), "must be in 0..65535"),
    ],
)
def test_a_depth_image_is_integer_millimetres(depth, message):
    with pytest.raises(ValueError, match=message):
        check_depth(depth)


def test_any_integer_depth_in_range_is_taken():
    assert check_depth(np.full((3, 4), 1500, np.int64)).dtype == np.uint16


def test_a_label_table_counts():
    assert (LABELS.n_parts, LABELS.n_labels, LABELS.n_joints) == (2, 4, 3)
    with pytest.raises(ValueError, match="at least one body part"):
        LabelTable((), (), ("head",))
    with pytest.raises(ValueError, match="exceed 254"):
        LabelTable(("a",) * 200, ("b",) * 100, ("head",))
