"""A random walk forest as its users hold it: trained from arrays, asked, cloned, saved, repeated."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.base import clone

from forests.frames import FrameBatch, FrameSubset, Intrinsics, LabelTable
from forests.growing import GrowthConfig
from forests.modelfile import ModelFileError
from forests.records import to_json
from forests.rwf.config import RWFConfig
from forests.rwf.forest import RandomWalkForest
from forests.rwf.predict import Predictor
from forests.rwf.start import seen_box
from forests.rwf.storage import load_model, pack_model, pack_tree, save_model, unpack_model, unpack_tree
from forests.rwf.train import read_frames, train
from forests.skeleton.answers import cut_frame, edges_of
from forests.skeleton.learn import is_outside

CAMERA = Intrinsics(100.0, 100.0, 47.5, 35.5)
LABELS = LabelTable(("body",), ("table",), ("head", "neck", "foot"))
CONFIG = RWFConfig(
    learn_skeleton=False,
    skeleton=(("neck", ""), ("head", "neck"), ("foot", "neck")),
    box_joints=("head", "neck"),
    n_points=60,
    reach_m=0.3,
    n_trees=1,
    n_walks=8,
    n_box_walks=6,
    n_steps=4,
    n_proposals=3,
    growth=GrowthConfig(max_depth=8, n_candidates=60, n_finalists=20, min_samples_leaf=10, max_offset_m=0.5),
)


def people(n: int, seed: int) -> FrameBatch:
    """Upright people of boxes, 2-3 m away, with a foot to one side; a table hides every other one's foot."""
    rng = np.random.default_rng(seed)
    depth, body = np.zeros((n, 72, 96), np.uint16), np.zeros((n, 72, 96), np.uint16)
    joints, is_occluded = np.zeros((n, 3, 3), np.float32), np.zeros((n, 3), bool)
    for i in range(n):
        x, z = rng.uniform(-0.3, 0.3), rng.uniform(2.0, 3.0)
        foot = x + rng.choice([-0.15, 0.15])
        joints[i] = [[x, -0.55, z + 0.1], [x, -0.3, z + 0.1], [foot, 0.6, z + 0.1]]
        for box in (
            (x - 0.1, -0.7, x + 0.1, -0.4),
            (x - 0.2, -0.4, x + 0.2, 0.2),
            (foot - 0.1, 0.2, foot + 0.1, 0.7),
        ):
            fill(body[i], z, box)
        depth[i] = body[i]
        if i % 2:
            fill(depth[i], z - 0.3, (foot - 0.3, 0.3, foot + 0.3, 0.75))
            is_occluded[i, 2] = True
    label = (body > 0).astype(np.uint8)
    composite = np.where(depth != body, np.uint8(2), label)
    return FrameBatch(depth, composite, joints, CAMERA, LABELS, body, label, is_occluded)


def fill(image: np.ndarray, z: float, box: tuple[float, ...]) -> None:
    left, right = (int(np.clip(CAMERA.fx * x / z + CAMERA.cx, 0, 96)) for x in (box[0], box[2]))
    top, bottom = (int(np.clip(CAMERA.fy * y / z + CAMERA.cy, 0, 72)) for y in (box[1], box[3]))
    image[top:bottom, left:right] = round(1000 * z)


TRAINING, TEST = people(90, 0), people(24, 1)


@pytest.fixture(scope="module")
def forest() -> RandomWalkForest:
    return RandomWalkForest(CONFIG).fit(TRAINING, TEST)


def assert_same(one, other) -> None:
    first, second = pack_model(one), pack_model(other)
    assert first.keys() == second.keys()
    for name, values in first.items():
        assert values.tobytes() == second[name].tobytes(), name


def test_it_finds_the_joints_of_toy_people_behind_tables_too(forest):
    errors = []
    for frame in TEST:
        start = frame.joints[:2].mean(axis=0)
        errors.append(
            np.linalg.norm(forest.predict(frame.depth, CAMERA, start=start).joints - frame.joints, axis=1)
        )
    errors = np.array(errors)
    assert errors.mean(axis=0).max() < 0.08
    assert (errors < 0.1).mean() > 0.85
    start_errors = np.linalg.norm(TEST.joints - TEST.joints[:, :2].mean(axis=1, keepdims=True), axis=2)
    assert errors[:, 2].mean() < 0.2 * start_errors[:, 2].mean()


def test_joints_of_cut_images_are_more_probably_outside(forest):
    told = []
    for frame in TEST:
        edges, start = edges_of(frame.depth.shape, CAMERA), frame.joints[:2].mean(axis=0)
        cut, cut_edges = cut_frame(frame, frame.joints, edges, np.random.default_rng(0))
        walker = Predictor(forest.model_)
        outside = is_outside(frame.joints[None], cut_edges[None])[0]
        for image, ends, is_out in ((frame.depth, edges, 0 * outside), (cut.depth, cut_edges, outside)):
            told.append(
                (walker.predict_joints(image, CAMERA, start=start, edges=ends).outside_probability, is_out)
            )
    said, truth = np.concatenate(told, axis=1)
    assert 0.1 < truth.mean() < 0.4
    assert said[truth > 0].mean() > said[truth == 0].mean() + 0.3


def test_cut_images_follow_their_frames():
    places = np.arange(3, dtype=np.int32)
    whole = read_frames(TRAINING, replace(CONFIG, cut_share=0.0), places, lambda share: None)
    both = read_frames(TRAINING, replace(CONFIG, cut_share=1.0), places, lambda share: None)
    np.testing.assert_array_equal(both.joints, np.repeat(whole.joints, 2, axis=0))
    np.testing.assert_array_equal(both.starts[::2], whole.starts)
    area = both.crops.width * both.crops.height
    np.testing.assert_array_equal(area[::2], whole.crops.width * whole.crops.height)
    assert (area[1::2] < area[::2]).mean() > 0.9


def test_a_box_is_seen_where_the_image_is():
    edges = edges_of((72, 96), CAMERA)
    assert seen_box((-5, 10, 200, 20), CAMERA, edges) == pytest.approx((0, 10, 96, 20), abs=1e-4)
    assert seen_box((3, 4, 5, 6), CAMERA, edges) == pytest.approx((3, 4, 5, 6))
    assert seen_box((100, 0, 110, 20), CAMERA, edges) is None
    assert seen_box(None, CAMERA, edges) is None


def test_an_estimate_has_all_that_users_read(forest):
    frame = TEST[0]
    estimate = forest.predict(frame.depth, CAMERA, box=(30, 5, 66, 40))
    assert estimate.proposals.shape == (3, 3, 3)
    assert estimate.joints.dtype == np.float32
    assert ((estimate.confidence > 0) & (estimate.confidence <= 1)).all()
    assert ((estimate.probability > 0) & (estimate.probability < 1)).all()
    assert (estimate.spread >= 0).all()
    assert np.isfinite(estimate.joints_2d).all()


def test_the_same_question_has_the_same_answer(forest):
    first, again = (forest.predict(TEST[1].depth, CAMERA) for _ in range(2))
    np.testing.assert_array_equal(first.proposals, again.proposals)
    np.testing.assert_array_equal(first.spread, again.spread)


def test_any_number_of_threads_trains_the_same_bytes():
    few = FrameSubset(TRAINING, tuple(range(30)))
    config = replace(CONFIG, n_trees=2)
    assert_same(*(train(few, config, validation=TEST, n_threads=n) for n in (1, 2)))


def test_training_goes_on_from_its_checkpoint():
    few = FrameSubset(TRAINING, tuple(range(20)))
    kept, loaded, shares = {}, [], []

    class Store:
        def load(self, tree):
            loaded.append(tree in kept)
            return kept.get(tree)

        def save(self, tree, grown):
            kept[tree] = unpack_tree(pack_tree(grown), LABELS, CONFIG)

    whole = train(few, CONFIG, checkpoint=Store(), on_progress=shares.append)
    assert loaded == [False] * 3
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    del kept[2]
    assert_same(whole, train(few, CONFIG, checkpoint=Store()))
    assert loaded[3:] == [True, True, False]


def test_bodies_alone_or_some_joints_alone_can_be_learned():
    few = FrameSubset(TRAINING, tuple(range(20)))
    body = train(few, replace(CONFIG, layer="body"))
    assert not np.array_equal(body.experts.trees[2][0].probe, train(few, CONFIG).experts.trees[2][0].probe)
    some = train(few, replace(CONFIG, joints=("foot", "head")))
    assert some.joints == ("head", "foot")
    assert some.limbs.parent.tolist() == [-1, -1]
    with pytest.raises(ValueError, match="tail"):
        train(few, replace(CONFIG, joints=("tail",)))


def test_one_frame_is_enough_and_none_is_refused():
    one = FrameSubset(TRAINING, (0,))
    walker = Predictor(train(one, CONFIG, validation=one))
    joints = walker.predict(TRAINING.depth[0], CAMERA, start=TRAINING.joints[0, 1]).joints
    assert np.linalg.norm(joints - TRAINING.joints[0], axis=1).max() < 0.15
    with pytest.raises(ValueError, match="no training frames"):
        train(FrameSubset(TRAINING, ()), CONFIG)


def test_a_frame_that_shows_nothing_is_learned_from_without_harm():
    empty = FrameBatch(
        np.zeros((2, 72, 96), np.uint16), np.zeros((2, 72, 96), np.uint8), TRAINING.joints[:2], CAMERA, LABELS
    )
    joints = Predictor(train(empty, CONFIG, validation=empty)).predict(TEST.depth[0], CAMERA).joints
    assert np.isfinite(joints).all()


def test_an_empty_map_has_no_joints_and_starts_outside_have_some(forest):
    nothing = forest.predict(np.zeros((72, 96), np.uint16), CAMERA)
    assert np.isnan(nothing.joints).all()
    assert (nothing.confidence == 0).all()
    assert (nothing.probability == 0).all()
    for start in ((0, 0), (-500, 900), (3.0, 3.0, 1.0)):
        assert np.isfinite(forest.predict(TEST.depth[0], CAMERA, start=start).joints).all()


def test_what_is_no_depth_image_or_no_fitted_forest_is_refused(forest):
    with pytest.raises(ValueError, match="metres"):
        forest.predict(np.zeros((72, 96)), CAMERA)
    with pytest.raises(ValueError, match="fit"):
        RandomWalkForest(CONFIG).predict(TEST.depth[0], CAMERA)


def test_it_can_be_cloned_and_its_parameters_set():
    copy = clone(RandomWalkForest(CONFIG, 2))
    assert copy.config == CONFIG
    assert copy.set_params(config__growth__max_depth=3).get_params()["config__growth__max_depth"] == 3
    with pytest.raises(ValueError, match="unknown"):
        copy.set_params(config__colour=1)


def test_a_saved_forest_is_the_same_forest(forest, tmp_path):
    path = tmp_path / "forest.model"
    save_model(path, forest.model_, {"corpus": "toy"})
    loaded = load_model(path)
    assert_same(forest.model_, loaded)
    assert (loaded.config, loaded.labels, loaded.joints) == (CONFIG, LABELS, LABELS.joints)
    expected = forest.predict(TEST[0].depth, CAMERA)
    np.testing.assert_array_equal(Predictor(loaded).predict(TEST[0].depth, CAMERA).proposals, expected.proposals)
    with pytest.raises(ValueError, match="config"):
        save_model(path, forest.model_, {"config": 1})
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(ModelFileError):
        load_model(path)


@pytest.mark.parametrize(
    ("name", "place", "value"),
    [
        ("plan.order", 0, 7),
        ("plan.start_from", 0, 2),
        ("plan.start_from", 1, -2),
        ("plan.scatter_m", 0, np.nan),
        ("plan.bandwidth_m", 0, 0.0),
        ("plan.n_arriving", 0, 20),
        ("plan.gate_m", (0, 0, 0), np.nan),
        ("limbs.parent", 0, 3),
        ("limbs.length_m", (0, 0), np.nan),
        ("weights", (0, 0, 0), np.inf),
        ("weights", (2, 0, 0), -np.inf),
        ("tree0.is_leaf", 0, 255),
        ("tree0.is_leaf", -1, 0),
        ("tree1.is_last", 0, 255),
        ("tree1.is_last", -1, 0),
        ("tree1.vote", (0, 3), 0),
        ("tree1.vote", (0, 3), -1),
        ("units", 0, np.inf),
        ("units", 0, np.nan),
        ("units", 1, 1e-3),
        ("units", 1, 0.0),
        ("plan.n_walks", 1, 0),
        ("plan.n_walks", 1, 5000),
    ],
)
def test_no_file_makes_a_walk_read_out_of_bounds(forest, name, place, value):
    arrays = {key: values.copy() for key, values in pack_model(forest.model_).items()}
    arrays[name][place] = value
    with pytest.raises(ValueError, match=r"\w"):
        unpack_model(arrays, metadata_of(forest))


@pytest.mark.parametrize("walk", [None, {"n_walks": 1}, {"n_steps": 0}, {"n_steps": "4"}])
def test_no_metadata_makes_a_walk_read_out_of_bounds(forest, walk):
    with pytest.raises(ValueError, match=r"walk"):
        unpack_model(pack_model(forest.model_), metadata_of(forest) | {"walk": walk})


def test_a_forest_of_version_1_is_the_same_forest():
    grown = {}

    class Store:
        def load(self, tree):
            return None

        def save(self, tree, tree_grown):
            grown[tree] = tree_grown

    model = train(FrameSubset(TRAINING, tuple(range(20))), CONFIG, checkpoint=Store())
    arrays = {n: values for n, values in pack_model(model).items() if n != "units" and not n.startswith("tree")}
    for number, tree in grown.items():
        arrays |= {f"tree{number}.{name}": values for name, values in pack_tree(tree).items()}
    counts = {"n_steps": model.plan.n_steps}
    metadata = {"config": to_json(model.config), "labels": to_json(LABELS), "walk": counts}
    assert_same(unpack_model(arrays, metadata), model)
    for name, place, value in (("left", 0, 10**6), ("offsets", (0, 0), np.inf), ("share", (0, 0), np.nan)):
        damaged = arrays[f"tree0.{name}"].copy()
        damaged[place] = value
        with pytest.raises(ValueError, match=r"\w"):
            unpack_model(arrays | {f"tree0.{name}": damaged}, metadata)


def test_bits_that_are_no_forest_are_refused_or_walked(forest):
    """Random bytes in what tells the shape: every descent ends, or the file is refused."""
    rng = np.random.default_rng(3)
    arrays, n_refused = pack_model(forest.model_), 0
    for _ in range(60):
        name = str(rng.choice(["tree0.is_leaf", "tree0.is_last", "tree2.is_leaf"]))
        damaged = arrays[name].copy()
        damaged[rng.integers(len(damaged), size=2)] ^= rng.integers(1, 256, 2, np.uint8)
        try:
            model = unpack_model(arrays | {name: damaged}, metadata_of(forest))
        except ValueError:
            n_refused += 1
            continue
        assert np.isfinite(Predictor(model).predict(TEST[0].depth, CAMERA).joints).all()
    assert n_refused > 0


def metadata_of(forest: RandomWalkForest) -> dict:
    counts = {"n_steps": forest.model_.plan.n_steps}
    return {"config": to_json(CONFIG), "labels": to_json(LABELS), "walk": counts}


def test_joints_of_the_box_walk_with_fewer_walkers_and_files_of_before_with_as_many_for_all(forest):
    assert forest.model_.plan.n_walks.tolist() == [CONFIG.n_box_walks, CONFIG.n_box_walks, CONFIG.n_walks]
    arrays, metadata = pack_model(forest.model_), metadata_of(forest)
    del arrays["plan.n_walks"]
    before = unpack_model(arrays, metadata | {"walk": metadata["walk"] | {"n_walks": 7}})
    assert before.plan.n_walks.tolist() == [7, 7, 7]
    with pytest.raises(ValueError, match=r"n_walks=None"):
        unpack_model(arrays, metadata)


def test_votes_of_a_joint_are_those_that_its_walk_ends_with():
    predictor = Predictor(train(TRAINING, CONFIG), is_limbs_fitted=False)
    for frame in (TEST[0], TEST[1]):
        box = (20.0, 5.0, 76.0, 40.0)
        estimate = predictor.predict_joints(frame.depth, CAMERA, box)
        for joint in range(3):
            told = predictor.joint_votes(joint, frame.depth, CAMERA, box)
            n = len(told.modes)
            np.testing.assert_array_equal(told.modes, estimate.proposals[joint, :n])
            assert np.isnan(estimate.proposals[joint, n:]).all()
            off = ((told.points - told.modes[0]) ** 2).sum(axis=1)
            spread = np.sqrt((told.weight * off).sum() / told.weight.sum())
            np.testing.assert_allclose(spread, estimate.spread[joint], rtol=1e-3)
    nothing = predictor.joint_votes(0, np.zeros((72, 96), np.uint16), CAMERA)
    assert len(nothing.points) == len(nothing.modes) == 0
