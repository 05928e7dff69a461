"""Trees split where the twin splits, recover planted trees, and are the same on any number of threads."""

import threading

import numpy as np
import pytest

from forests.crops import Crops, CropWriter
from forests.features import draw_feature
from forests.frames import Intrinsics
from forests.growing import (
    DIRECTION_ONE,
    GrownTree,
    GrowthConfig,
    grow,
    grow_class_tree,
    grow_direction_tree,
)
from forests.samples import Samples
from forests.tree import check_tree, tree_depth
from tests import reference_forests_growing as reference

CAMERA = Intrinsics(60.0, 62.0, 31.5, 23.5)
SEED, TREE = 5, 1
SMALL = GrowthConfig(max_depth=6, n_candidates=40, n_finalists=10, min_samples_leaf=4)
EXHAUSTIVE = GrowthConfig(max_depth=1, n_candidates=25, n_finalists=25, n_thresholds=12, min_samples_leaf=6)


def two_depths(n_per_frame: int = 200, n_frames: int = 3, seed: int = 0) -> tuple[Crops, Samples]:
    """Images whose pixels lie at 1.5 or 2.5 m by chance, so that differences are about -1000, 0 or 1000 mm."""
    rng = np.random.default_rng(seed)
    parts = []
    with CropWriter(2**20) as writer:
        for frame in range(n_frames):
            depth = np.where(rng.random((40, 56)) < 0.5, 1500, 2500).astype(np.uint16)
            depth[rng.random((40, 56)) < 0.1] = 0
            origin = writer.add(depth, CAMERA)
            row, column = np.nonzero(depth)
            kept = np.sort(rng.permutation(len(row))[:n_per_frame])
            columns = (
                np.full(n_per_frame, frame, np.int32),
                (column - origin[0])[kept].astype(np.int16),
                (row - origin[1])[kept].astype(np.int16),
                depth[row, column][kept],
                np.ones(n_per_frame, np.uint8),
            )
            parts.append(columns)
        crops = writer.finish()
    return crops, Samples(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def candidate(number: int, node: int, config: GrowthConfig) -> np.ndarray:
    """(4,) a feature of a node's pool."""
    feature = np.empty(4, np.float32)
    draw_feature(SEED, TREE, node, number, config.max_offset_m, feature)
    return feature


def planted(crops: Crops, samples: Samples, config: GrowthConfig) -> tuple[np.ndarray, np.ndarray]:
    """Three features of the pools of nodes 1, 2 and 3, and the four classes that they lead to."""
    features = np.array([candidate(7 + node, node, config) for node in (1, 2, 3)])
    everyone = np.arange(len(samples.frame))
    is_right = [reference.feature_values(crops, samples, everyone, feature) > 500 for feature in features]
    classes = np.where(is_right[0], 2 + is_right[2], is_right[1])
    return features, classes.astype(np.uint8)


def class_tree(crops, samples, classes, config=SMALL, n_threads=1, **options) -> GrownTree:
    """A tree of the tests' seed."""
    n_classes = int(classes.max(initial=0)) + 1
    return grow_class_tree(crops, samples, classes, n_classes, config, SEED, TREE, n_threads, **options)


def unit_directions(n: int, seed: int = 0) -> np.ndarray:
    """(n, 3) int16 directions."""
    vectors = np.random.default_rng(seed).normal(size=(n, 3))
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.round(vectors * DIRECTION_ONE).astype(np.int16)


def some_classes(samples: Samples, n_classes: int = 5) -> np.ndarray:
    """Classes that depend on the place in the image, with noise."""
    rng = np.random.default_rng(1)
    place = samples.x.astype(int) * n_classes // 60
    return np.where(rng.random(len(place)) < 0.7, place, rng.integers(0, n_classes, len(place))).astype(np.uint8)


def leaf_of_sample(grown: GrownTree) -> np.ndarray:
    """(n_samples,) by `order` and `leaf_start`."""
    leaves = np.empty(len(grown.order), np.int64)
    leaves[grown.order] = np.repeat(np.arange(len(grown.leaf_start) - 1), np.diff(grown.leaf_start))
    return leaves


def assert_equal(a: GrownTree, b: GrownTree) -> None:
    """To the byte."""
    for one, other in zip(a, b, strict=True):
        assert one.dtype == other.dtype
        assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize("kind", ["classes", "directions"])
def test_a_planted_tree_is_recovered(kind):
    crops, samples = two_depths()
    features, classes = planted(crops, samples, SMALL)
    assert (np.bincount(classes, minlength=4) > 30).all()
    if kind == "classes":
        grown = class_tree(crops, samples, classes)
    else:
        toward = np.array([[0.6, 0, 0.8], [-0.6, 0, 0.8], [0, 0.6, -0.8], [0, -0.6, -0.8]]) * DIRECTION_ONE
        directions = np.round(toward).astype(np.int16)[classes]
        grown = grow_direction_tree(crops, samples, directions, SMALL, SEED, TREE, 1)
    nodes = grown.nodes
    assert len(nodes) == 7
    assert np.array_equal(nodes["left"][:3], [1, 3, 5])
    assert np.array_equal(np.concatenate([nodes["u"], nodes["v"]], axis=1)[:3], features)
    assert ((nodes["threshold"][:3] >= 0) & (nodes["threshold"][:3] < 1000)).all()
    assert np.array_equal(leaf_of_sample(grown), classes)


@pytest.mark.parametrize("kind", ["classes", "directions"])
def test_the_split_is_the_best_of_all_candidates_and_thresholds(kind):
    crops, samples = two_depths(n_per_frame=60, n_frames=2)
    everyone = np.arange(len(samples.frame))
    if kind == "classes":
        classes = some_classes(samples)
        grown = class_tree(crops, samples, classes, EXHAUSTIVE)

        def gain_of(goes_right):
            return reference.information_gain(classes, goes_right)
    else:
        directions = unit_directions(len(everyone))
        grown = grow_direction_tree(crops, samples, directions, EXHAUSTIVE, SEED, TREE, 1)

        def gain_of(goes_right):
            return reference.deviation_fall(directions, goes_right)

    gain, feature, threshold = reference.best_split(crops, samples, gain_of, everyone, 1, EXHAUSTIVE, SEED, TREE)
    assert gain > 0
    root = grown.nodes[0]
    assert np.array_equal([*root["u"], *root["v"]], feature)
    assert root["threshold"] == threshold
    assert gain_of(leaf_of_sample(grown) == 1) == pytest.approx(gain)


@pytest.mark.parametrize("kind", ["classes", "directions"])
def test_the_tree_is_the_same_to_the_byte_for_any_threads_and_tasks(kind, monkeypatch):
    crops, samples = two_depths()

    def grown_with(n_threads, subtree_samples):
        monkeypatch.setattr(grow, "SUBTREE_SAMPLES", subtree_samples)
        if kind == "classes":
            return class_tree(crops, samples, some_classes(samples), n_threads=n_threads)
        directions = unit_directions(len(samples.frame))
        return grow_direction_tree(crops, samples, directions, SMALL, SEED, TREE, n_threads)

    first = grown_with(1, 2**20)
    assert len(first.nodes) > 20
    for n_threads, subtree_samples in ((1, 40), (2, 40), (3, 100), (2, 0)):
        assert_equal(first, grown_with(n_threads, subtree_samples))


def test_a_tree_is_sound_and_its_samples_end_where_they_descend():
    crops, samples = two_depths()
    config = GrowthConfig(
        max_depth=5,
        n_candidates=40,
        n_finalists=10,
        min_samples_leaf=4,
        max_samples_per_split=100,
        n_racing_samples=30,
    )
    grown = class_tree(crops, samples, some_classes(samples), config)
    sizes = np.diff(grown.leaf_start)
    check_tree(grown.nodes, len(sizes))
    assert tree_depth(grown.nodes) == 5
    assert np.array_equal(np.sort(grown.order), np.arange(len(samples.frame)))
    assert sizes.min() >= 4
    for begin, end in zip(grown.leaf_start[:-1], grown.leaf_start[1:], strict=True):
        assert (np.diff(grown.order[begin:end]) > 0).all()
    leaf_nodes = np.flatnonzero(grown.nodes["leaf"] >= 0)
    assert np.array_equal(grown.nodes["leaf"][leaf_nodes], np.arange(len(sizes)))
    assert np.array_equal(reference.descend(crops, samples, grown.nodes), leaf_of_sample(grown))


def test_trees_differ_by_seed_and_number():
    crops, samples = two_depths()
    classes = some_classes(samples)
    roots = {grow_class_tree(crops, samples, classes, 5, SMALL, seed, tree, 1).nodes[0].tobytes()
             for seed in range(2) for tree in range(2)}  # fmt: skip
    assert len(roots) == 4


def test_classes_that_are_absent_change_nothing():
    crops, samples = two_depths()
    classes = some_classes(samples)
    sparse = grow_class_tree(crops, samples, (classes * 60).astype(np.uint8), 256, SMALL, SEED, TREE, 1)
    assert_equal(class_tree(crops, samples, classes), sparse)


def one_leaf(grown: GrownTree, n: int) -> bool:
    """All n samples are in the root."""
    check_tree(grown.nodes, 1)
    return len(grown.nodes) == 1 and np.array_equal(grown.order, np.arange(n)) and list(grown.leaf_start) == [0, n]


def test_a_node_that_cannot_be_split_is_a_leaf():
    crops, samples = two_depths(n_per_frame=30)
    n = len(samples.frame)
    classes = some_classes(samples)
    directions = unit_directions(n)
    assert one_leaf(class_tree(crops, samples, np.zeros(n, np.uint8)), n)
    assert one_leaf(class_tree(crops, samples, np.full(n, 3, np.uint8)), n)
    assert one_leaf(grow_direction_tree(crops, samples, directions[:1].repeat(n, 0), SMALL, SEED, TREE, 1), n)
    shallow = GrowthConfig(max_depth=0)
    assert one_leaf(class_tree(crops, samples, classes, shallow), n)
    assert one_leaf(grow_direction_tree(crops, samples, directions, shallow, SEED, TREE, 1), n)
    single = Samples(*(column[:1] for column in samples))
    assert one_leaf(class_tree(crops, single, classes[:1], GrowthConfig(min_samples_leaf=1)), 1)
    same = Samples(*(column[:1].repeat(n) for column in samples))
    assert one_leaf(class_tree(crops, same, classes), n)
    assert one_leaf(class_tree(crops, samples, classes, GrowthConfig(min_samples_leaf=n // 2 + 1)), n)


def test_pixels_of_tiny_crops_grow_a_tree():
    """Persons of a single pixel: every probe with an offset reads the border."""
    with CropWriter(2**20) as writer:
        for z_mm in range(1000, 1040):
            writer.add(np.full((1, 1), z_mm, np.uint16), CAMERA)
        crops = writer.finish()
    one = np.ones(40, np.int16)
    z_mm = np.arange(1000, 1040, dtype=np.uint16)
    samples = Samples(np.arange(40, dtype=np.int32), one, one, z_mm, one.astype(np.uint8))
    grown = class_tree(crops, samples, (np.arange(40) % 2).astype(np.uint8))
    check_tree(grown.nodes, len(grown.leaf_start) - 1)
    assert np.array_equal(reference.descend(crops, samples, grown.nodes), leaf_of_sample(grown))


def test_progress_counts_every_sample_once_from_the_calling_thread(monkeypatch):
    monkeypatch.setattr(grow, "SUBTREE_SAMPLES", 60)
    crops, samples = two_depths()
    calls = []
    class_tree(
        crops, samples, some_classes(samples), n_threads=2,
        on_samples=lambda n: calls.append((n, threading.current_thread() is threading.main_thread())),
    )  # fmt: skip
    assert sum(n for n, _ in calls) == len(samples.frame)
    assert all(is_main for _, is_main in calls)
    assert len(calls) > 3


def test_an_interrupt_stops_the_workers(monkeypatch):
    monkeypatch.setattr(grow, "SUBTREE_SAMPLES", 60)
    crops, samples = two_depths()
    n_before = threading.active_count()

    def interrupt(n):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        class_tree(crops, samples, some_classes(samples), n_threads=2, on_samples=interrupt)
    assert threading.active_count() == n_before


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("max_depth", -1, "max_depth=-1 must be in 0..60"),
        ("max_depth", 61, "max_depth=61 must be in 0..60"),
        ("n_candidates", 0, "n_candidates=0 must be in 1.."),
        ("candidates_per_sample", 0, "candidates_per_sample=0 must be in 1.."),
        ("n_thresholds", 2, "n_thresholds=2 must be in 3..256"),
        ("max_samples_per_split", 1, "max_samples_per_split=1 must be in 2.."),
        ("n_racing_samples", 0, "n_racing_samples=0 must be in 2.."),
        ("n_finalists", 0, "n_finalists=0 must be in 1.."),
        ("min_samples_leaf", 0, "min_samples_leaf=0 must be in 1.."),
        ("max_offset_m", 0.0, "max_offset_m=0.0 must be above 0"),
        ("max_offset_m", float("nan"), r"max_offset_m=nan must be in 0.0..10.0"),
    ],
)
def test_settings_out_of_range_are_refused_by_name(field, value, message):
    with pytest.raises(ValueError, match=message):
        GrowthConfig(**{field: value})


def test_data_that_do_not_fit_are_refused():
    crops, samples = two_depths(n_per_frame=10)
    n = len(samples.frame)
    classes = np.zeros(n, np.uint8)
    with pytest.raises(ValueError, match=r"class 7 is not in 0\.\.2"):
        grow_class_tree(crops, samples, np.full(n, 7, np.uint8), 3, SMALL, 0, 0, 1)
    with pytest.raises(ValueError, match=r"classes are int64 \(30,\), must be uint8 \(30,\)"):
        grow_class_tree(crops, samples, np.zeros(n, np.int64), 3, SMALL, 0, 0, 1)
    with pytest.raises(ValueError, match=r"n_classes=0 must be in 1\.\.256"):
        grow_class_tree(crops, samples, classes, 0, SMALL, 0, 0, 1)
    with pytest.raises(ValueError, match="n_threads=0 must be at least 1"):
        grow_class_tree(crops, samples, classes, 1, SMALL, 0, 0, 0)
    with pytest.raises(ValueError, match="seed=-1 and tree=0 must be"):
        grow_class_tree(crops, samples, classes, 1, SMALL, -1, 0, 1)
    with pytest.raises(ValueError, match=r"directions are float64 \(30, 3\), must be int16 \(30, 3\)"):
        grow_direction_tree(crops, samples, np.zeros((n, 3)), SMALL, 0, 0, 1)
    nobody = Samples(*(column[:0] for column in samples))
    with pytest.raises(ValueError, match="0 samples given"):
        grow_class_tree(crops, nobody, classes[:0], 1, SMALL, 0, 0, 1)
