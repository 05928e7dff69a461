"""Features are drawn evenly and from counters alone; the kernels read what a plain look into the image reads."""

import numpy as np
import pytest

from forests.crops import NOTHING, CropWriter
from forests.features import (
    FEATURE_LIMIT_MM,
    difference,
    draw_feature,
    feature_values,
    pixels_per_metre,
    probe,
)
from forests.frames import Intrinsics
from forests.hashing import hash4, splitmix64, unit_float
from forests.samples import Samples
from tests.reference_forests_growing import feature_values as reference_values


def drawn(n: int, seed: int = 1, tree: int = 2, node: int = 3, max_offset: float = 0.6) -> np.ndarray:
    """(n, 4) the first candidates of a node."""
    features = np.empty((n, 4), np.float32)
    for candidate in range(n):
        draw_feature(seed, tree, node, candidate, max_offset, features[candidate])
    return features


def pixels(seed: int = 0) -> tuple:
    """Crops of three images with holes, and 200 of their pixels, those at the crops' rims among them."""
    rng = np.random.default_rng(seed)
    parts = []
    with CropWriter(2**20) as writer:
        for frame, focal in enumerate((60.0, 75.0, 365.0)):
            depth = rng.integers(500, 6000, (40, 56)).astype(np.uint16) * (rng.random((40, 56)) < 0.8)
            origin = writer.add(depth.astype(np.uint16), Intrinsics(focal, focal + 3, 27.5, 19.5))
            row, column = np.nonzero(depth)
            kept = np.sort(rng.permutation(len(row))[:200])
            x, y = (column - origin[0])[kept], (row - origin[1])[kept]
            z_mm = depth[row, column][kept]
            columns = (np.full(200, frame), x, y, z_mm, np.ones(200))
            types = (np.int32, np.int16, np.int16, np.uint16, np.uint8)
            parts.append([c.astype(t) for c, t in zip(columns, types, strict=True)])
        crops = writer.finish()
    return crops, Samples(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def test_splitmix64_gives_its_published_outputs():
    state, golden = 1234567, 0x9E3779B97F4A7C15
    published = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    for i, expected in enumerate(published):
        assert splitmix64(np.uint64((state + i * golden) % 2**64)) == expected


def test_a_hash_depends_on_each_counter_and_its_place():
    keys = {hash4(*counters) for counters in np.ndindex(4, 4, 4, 4)}
    assert len(keys) == 256
    floats = np.array([unit_float(np.uint64(hash4(7, 0, 0, i))) for i in range(4000)])
    assert floats.min() >= 0.0
    assert floats.max() < 1.0
    assert abs(floats.mean() - 0.5) < 6 * np.sqrt(1 / 12 / 4000)


def test_features_are_drawn_evenly():
    n = 8000
    features = drawn(n)
    has_one_probe = (features[:, 2:] == 0).all(axis=1)
    assert abs(has_one_probe.mean() - 0.5) < 6 * np.sqrt(0.25 / n)
    for offsets in (features[:, :2], features[~has_one_probe, 2:]):
        length = np.hypot(*offsets.T)
        assert length.max() <= 0.6 * (1 + 1e-6)
        assert abs(length.mean() - 0.3) < 6 * 0.6 * np.sqrt(1 / 12 / len(length))
        in_eighth = np.bincount((np.arctan2(*offsets.T) // (np.pi / 4)).astype(int) + 4, minlength=8)[:8]
        assert np.abs(in_eighth - len(length) / 8).max() < 6 * np.sqrt(len(length) * 7 / 64)


@pytest.mark.parametrize("changed", [{"seed": 9}, {"tree": 9}, {"node": 9}])
def test_features_differ_by_seed_tree_and_node(changed):
    assert np.array_equal(drawn(50), drawn(50))
    assert not (drawn(50, **changed) == drawn(50)).all(axis=1).any()


def test_a_longer_reach_scales_the_same_features():
    assert np.allclose(drawn(50, max_offset=1.2), 2 * drawn(50, max_offset=0.6), rtol=1e-6)


def test_kernels_read_what_a_look_into_the_image_reads():
    crops, samples = pixels()
    frame, half = samples.frame, np.float32(0.5)
    x, y = samples.x + half, samples.y + half
    scales = [
        np.array(
            [pixels_per_metre(crops.intrinsics[f, axis], z) for f, z in zip(frame, samples.z_mm, strict=True)]
        )
        for axis in range(2)
    ]
    width, height, start = crops.width[frame], crops.height[frame], crops.start[frame]
    right, bottom = (width - half).astype(np.float32), (height - half).astype(np.float32)
    places, values = np.empty(len(x), np.int32), np.empty(len(x), np.int32)
    n_beyond = 0
    for feature in drawn(12, max_offset=1.0):
        feature_values(
            crops.pixels, x, y, *scales, right, bottom, width, start, samples.z_mm.astype(np.int32), feature,
            places, values,
        )  # fmt: skip
        expected = reference_values(crops, samples, range(len(x)), feature)
        assert np.array_equal(values, expected)
        n_beyond += (np.abs(values) == FEATURE_LIMIT_MM).sum()
        for i in range(0, len(x), 37):
            reads = [
                probe(
                    crops.pixels, start[i], width[i], height[i], x[i], y[i], scales[0][i], scales[1][i], *offset
                )
                for offset in (feature[:2], feature[2:])
            ]  # fmt: skip
            assert difference(*reads) == expected[i]
    assert 0 < n_beyond < 12 * len(x)


def test_a_probe_far_outside_reads_nothing():
    crops, samples = pixels()
    for offset in ((9.0, 0.0), (-9.0, 0.0), (0.0, 9.0), (0.0, -9.0)):
        read = probe(
            crops.pixels, crops.start[0], crops.width[0], crops.height[0], np.float32(samples.x[0] + 0.5),
            np.float32(samples.y[0] + 0.5), np.float32(60), np.float32(60), *np.float32(offset),
        )  # fmt: skip
        assert read == NOTHING


def test_differences_are_cut():
    assert difference(NOTHING, 1500) == FEATURE_LIMIT_MM
    assert difference(1500, NOTHING) == -FEATURE_LIMIT_MM
    assert difference(NOTHING, NOTHING) == 0
    assert difference(np.uint16(1500), np.uint16(1501)) == -1
