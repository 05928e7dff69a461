"""Trees that are told more than depth: they ask what helps, as the twin does, and nothing where nothing is told."""

import numpy as np
import pytest

from forests.crops import Crops, CropWriter
from forests.features import FEATURE_LIMIT_MM, draw_hit
from forests.frames import FACT_LIMIT, Hints, Intrinsics
from forests.growing import GrownTree, GrowthConfig, grow, grow_class_tree
from forests.samples import Samples
from tests import reference_forests_growing as reference

CAMERA = Intrinsics(60.0, 62.0, 31.5, 23.5)
SEED, TREE = 5, 1
CONFIG = GrowthConfig(max_depth=4, n_candidates=40, n_finalists=10, min_samples_leaf=4)
N_CLASSES, N_FRAMES, N_PER_FRAME = 3, 6, 120


def told(n_facts: int = 2, has_classes: bool = True, seed: int = 0) -> tuple[Crops, Samples]:
    """Flat images, of which depth tells nothing, with random patches of classes and random facts."""
    rng = np.random.default_rng(seed)
    parts = []
    with CropWriter(2**20) as writer:
        for frame in range(N_FRAMES):
            depth = np.full((40, 56), 2000, np.uint16)
            patches = np.kron(rng.integers(0, N_CLASSES + 1, (5, 7)), np.ones((8, 8), int)).astype(np.uint8)
            facts = rng.integers(-FACT_LIMIT, FACT_LIMIT + 1, n_facts).astype(np.int16)
            origin = writer.add(depth, CAMERA, Hints(patches if has_classes else None, facts))
            kept = np.sort(rng.permutation(depth.size)[:N_PER_FRAME])
            row, column = np.divmod(kept, depth.shape[1])
            parts.append(
                (
                    np.full(N_PER_FRAME, frame, np.int32),
                    (column - origin[0]).astype(np.int16),
                    (row - origin[1]).astype(np.int16),
                    depth[row, column],
                    np.ones(N_PER_FRAME, np.uint8),
                )
            )
        crops = writer.finish()
    return crops, Samples(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def grown_from(crops: Crops, samples: Samples, classes: np.ndarray, n_threads: int = 1, **options) -> GrownTree:
    n_classes = int(classes.max()) + 1
    return grow_class_tree(crops, samples, classes, n_classes, CONFIG, SEED, TREE, n_threads, **options)


def asked(crops: Crops, samples: Samples, feature: np.ndarray, hint: int) -> np.ndarray:
    """(n,) what a node asks of every sample, by the twin."""
    return np.array([reference.hint_of(crops, samples, s, feature, hint) for s in range(len(samples.frame))])


def leaf_of_sample(grown: GrownTree) -> np.ndarray:
    leaves = np.empty(len(grown.order), np.int64)
    leaves[grown.order] = np.repeat(np.arange(len(grown.leaf_start) - 1), np.diff(grown.leaf_start))
    return leaves


def test_a_class_that_a_probe_hits_is_found():
    crops, samples = told()
    feature = np.empty(4, np.float32)
    hint = draw_hit(SEED, TREE, 1, 6, N_CLASSES, CONFIG.max_offset_m, feature)
    classes = (asked(crops, samples, feature, hint) > 0).astype(np.uint8)
    assert 50 < classes.sum() < len(classes) - 50
    grown = grown_from(crops, samples, classes)
    assert len(grown.nodes) == 3
    assert grown.hints.tolist() == [hint, 0, 0]
    assert np.array_equal(grown.nodes["u"][0], feature[:2])
    assert 0 <= grown.nodes["threshold"][0] < FEATURE_LIMIT_MM
    assert np.array_equal(leaf_of_sample(grown), classes)


def test_a_fact_that_decides_is_found():
    crops, samples = told(has_classes=False)
    middle = np.sort(crops.facts[:, 1])[N_FRAMES // 2 - 1]
    classes = (crops.facts[samples.frame, 1] > middle).astype(np.uint8)
    grown = grown_from(crops, samples, classes)
    assert grown.hints.tolist() == [-2, 0, 0]
    assert np.array_equal(leaf_of_sample(grown), classes)


def test_samples_end_where_the_twin_descends():
    crops, samples = told()
    hits = asked(crops, samples, np.array([0.1, -0.05, 0, 0], np.float32), 2) > 0
    classes = (hits + 2 * (crops.facts[samples.frame, 0] > 0)).astype(np.uint8)
    grown = grown_from(crops, samples, classes)
    assert (grown.hints > 0).any()
    assert (grown.hints < 0).any()
    ours = reference.descend_with_hints(crops, samples, grown.nodes, grown.hints)
    assert np.array_equal(ours, leaf_of_sample(grown))


def test_the_tree_is_the_same_to_the_byte_for_any_threads_and_tasks(monkeypatch):
    crops, samples = told()
    classes = np.random.default_rng(1).integers(0, 4, len(samples.frame)).astype(np.uint8)
    offsets = np.random.default_rng(2).integers(-900, 900, (len(classes), 3)).astype(np.int16)

    def grown_with(n_threads, subtree_samples):
        monkeypatch.setattr(grow, "SUBTREE_SAMPLES", subtree_samples)
        return grown_from(crops, samples, classes, n_threads, offsets=offsets)

    first = grown_with(1, 2**20)
    assert first.hints.any()
    for n_threads, subtree_samples in ((1, 40), (2, 40), (3, 100)):
        for one, other in zip(first, grown_with(n_threads, subtree_samples), strict=True):
            assert (one.dtype, one.tobytes()) == (other.dtype, other.tobytes())


def test_hints_that_tell_nothing_change_nothing():
    crops, samples = told(n_facts=0)
    classes = np.random.default_rng(1).integers(0, 3, len(samples.frame)).astype(np.uint8)
    rng = np.random.default_rng(3)
    crops = crops._replace(pixels=rng.integers(1000, 3000, len(crops.pixels)).astype(np.uint16))
    plain = crops._replace(classes=np.zeros(0, np.uint8), facts=np.zeros((0, 0), np.int16))
    empty = plain._replace(classes=np.zeros_like(crops.classes), facts=np.zeros((N_FRAMES, 0), np.int16))
    trees = [grown_from(each, samples, classes) for each in (plain, empty)]
    assert len(trees[0].nodes) > 10
    for one, other in zip(*trees, strict=True):
        assert one.tobytes() == other.tobytes()
    assert len(trees[0].hints) == 0


def test_nodes_of_one_class_are_split_on_by_offsets_where_there_are_any():
    crops, samples = told(n_facts=1, has_classes=False)
    is_above = crops.facts[samples.frame, 0] > np.sort(crops.facts[:, 0])[2]
    offsets = np.where(is_above[:, None], [300, 0, 0], [-300, 40, 0]).astype(np.int16)
    one_class = np.zeros(len(is_above), np.uint8)
    assert len(grown_from(crops, samples, one_class).nodes) == 1
    grown = grown_from(crops, samples, one_class, offsets=offsets)
    assert grown.hints[0] == -1
    assert np.array_equal(leaf_of_sample(grown), is_above)


def test_classes_are_drawn_evenly_and_some_probes_are_the_pixel_itself():
    features, hints = np.empty((4000, 4), np.float32), np.empty(4000, int)
    for k in range(4000):
        hints[k] = draw_hit(SEED, TREE, 3, k, 5, 0.6, features[k])
    counts = np.bincount(hints, minlength=6)
    assert counts[0] == 0
    assert counts[1:].min() > 700
    length = np.linalg.norm(features[:, :2].astype(float), axis=1)
    assert length.max() <= 0.6 + 1e-6
    assert (length == 0).mean() == pytest.approx(1 / 8, abs=0.02)
    assert not features[:, 2:].any()


@pytest.mark.parametrize(
    ("hints", "message"),
    [
        ({"classes": np.zeros((2, 2), np.int32)}, r"classes are int32 \(2, 2\), must be uint8 \(height, width\)"),
        ({"facts": np.zeros(2)}, r"facts are float64 \(2,\), must be int16 \(n_facts,\)"),
        ({"facts": np.array([FACT_LIMIT + 1], np.int16)}, r"256 facts at most, each within \+-2000"),
        ({"facts": np.zeros(257, np.int16)}, "256 facts at most"),
    ],
)
def test_hints_out_of_range_are_refused(hints, message):
    with pytest.raises(ValueError, match=message):
        Hints(**hints)


def test_hints_must_fit_their_images_and_one_another():
    depth = np.full((4, 5), 900, np.uint16)
    fact = np.zeros(1, np.int16)
    message = r"classes of shape \(5, 4\), must be that of the depth, \(4, 5\)"
    with CropWriter(2**20) as writer, pytest.raises(ValueError, match=message):
        writer.add(depth, CAMERA, Hints(np.zeros((5, 4), np.uint8)))
    for others in (None, Hints(), Hints(np.zeros((4, 5), np.uint8), fact)):
        with CropWriter(2**20) as writer:
            writer.add(depth, CAMERA, Hints(facts=fact))
            writer.add(depth, CAMERA, others)
            with pytest.raises(ValueError, match="hints must tell the same of all frames"):
                writer.finish()


def test_a_fact_reaches_as_far_as_a_difference():
    assert FACT_LIMIT == FEATURE_LIMIT_MM
