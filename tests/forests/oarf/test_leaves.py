"""What a leaf knows is what its samples were: their classes, and where the joints lie as seen from them."""

import itertools

import numpy as np
import pytest

from forests.crops import Crops
from forests.growing import GrownTree
from forests.oarf.leaves import LeafRules, leaf_table, regrouped
from forests.samples import Samples, TrainingSet
from forests.tree import NODE_DTYPE
from tests import reference_forests_modes as twin

B, N_CLASSES, N_PARTS, N_JOINTS, N_FRAMES = 0.05, 5, 3, 4, 30
SIZES = (1, 2, 7, 40, 300, 90, 5, 700)


def world(sizes: tuple[int, ...] = SIZES, seed: int = 0) -> tuple[TrainingSet, np.ndarray, GrownTree]:
    """Samples scattered over leaves of the sizes given; joints of one person in four poses, a centimetre apart."""
    rng = np.random.default_rng(seed)
    n = sum(sizes)
    crops = Crops(
        np.zeros(0, np.uint16),
        np.zeros(N_FRAMES, np.int64),
        np.full(N_FRAMES, 100, np.int32),
        np.full(N_FRAMES, 100, np.int32),
        rng.integers(0, 50, (N_FRAMES, 2)).astype(np.int32),
        np.tile(np.float32([500.0, 510.0, 60.0, 50.0]), (N_FRAMES, 1)),
    )
    frame = np.sort(rng.integers(0, N_FRAMES, n)).astype(np.int32)
    x, y = rng.integers(45, 56, (2, n)).astype(np.int16)
    samples = Samples(frame, x, y, rng.integers(1990, 2010, n).astype(np.uint16), np.ones(n, np.uint8))
    pose = rng.normal([0, 0, 2], 0.3, (4, N_JOINTS, 3))
    joints = (pose[np.arange(N_FRAMES) % 4] + rng.normal(0, 0.01, (N_FRAMES, N_JOINTS, 3))).astype(np.float32)
    leaf_start = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    order = rng.permutation(n).astype(np.int32)
    for begin, end in itertools.pairwise(leaf_start):
        order[begin:end].sort()
    classes = rng.integers(0, N_CLASSES, n).astype(np.uint8)
    return TrainingSet(crops, samples, joints), classes, GrownTree(np.zeros(0, NODE_DTYPE), leaf_start, order)


RULES = LeafRules(N_CLASSES, N_PARTS, B, 3, 0, 0)


def table_of(training, classes, grown, n_threads=1, on_leaves=lambda n: None, **changes):
    return leaf_table(training, classes, grown, RULES._replace(**changes), n_threads, on_leaves)


def members_of(grown: GrownTree, leaf: int) -> np.ndarray:
    return grown.order[grown.leaf_start[leaf] : grown.leaf_start[leaf + 1]]


def offsets_of(training: TrainingSet, members: np.ndarray) -> np.ndarray:
    points = training.samples.points(training.crops)[members].astype(float)
    return training.joints[training.samples.frame[members]].astype(float) - points[:, None]


def test_class_shares_are_the_samples_shares():
    training, classes, grown = world()
    table = table_of(training, classes, grown)
    assert np.allclose(table.probability.sum(axis=1), 1.0, atol=1e-6)
    for leaf in range(len(SIZES)):
        share = np.bincount(classes[members_of(grown, leaf)], minlength=N_CLASSES) / SIZES[leaf]
        assert np.allclose(table.probability[leaf], share)


@pytest.mark.parametrize("n_parts", [N_PARTS, N_CLASSES])
def test_modes_are_those_of_the_slow_twin(n_parts):
    """Where all samples climb; sorted, as modes of equal weight may change places."""
    sizes = (1, 2, 7, 40, 90, 5, 120)
    training, classes, grown = world(sizes)
    table = table_of(training, classes, grown, n_parts=n_parts, n_starts=400)
    n_layers = 1 if n_parts == N_CLASSES else 2
    assert table.vote.shape == (len(sizes), n_layers, N_JOINTS, 3, 3)
    assert table.weight.shape == (len(sizes), n_layers, N_JOINTS, 3)
    for leaf in range(len(sizes)):
        members = members_of(grown, leaf)
        offsets, is_occluder = offsets_of(training, members), classes[members] >= n_parts
        mode, weight = twin.leaf_modes(offsets, is_occluder, B, 3, n_layers)
        assert np.abs(table.weight[leaf] - weight).max() < 1e-6 + 0.03 * (sizes[leaf] > 20)
        is_alone = (weight[..., 0] > weight[..., 1] + 0.05) & (weight[..., 0] > 0)
        apart = np.linalg.norm(table.vote[leaf, ..., 0, :] - mode[..., 0, :], axis=-1)
        assert (apart[is_alone] < 0.001).all()


def test_fewer_climbers_find_the_same_first_modes_with_nearly_the_same_weights():
    """On leaves larger than the number of climbers, where one pose has a clear lead."""
    training, classes, grown = world((100, 300, 400, 200))
    pose = training.joints[0]
    joints = training.joints.copy()
    joints[: N_FRAMES // 2] = pose
    training = training._replace(joints=joints)
    table = table_of(training, classes, grown)
    exact = table_of(training, classes, grown, n_starts=400)
    apart = np.linalg.norm(table.vote[..., 0, :] - exact.vote[..., 0, :], axis=-1)
    assert (apart < 0.01).mean() > 0.95
    assert np.abs(table.weight[..., 0] - exact.weight[..., 0]).mean() < 0.03
    assert not np.array_equal(table.weight, exact.weight)


@pytest.mark.parametrize("n_drawn", [400, 20])
def test_weights_are_shares_of_all_samples_of_the_leaf(n_drawn):
    """With room for every mode, a layer's weights add up to its share of the samples, drawn or not."""
    training, classes, grown = world()
    table = table_of(training, classes, grown, n_leaf_votes=60, n_drawn=n_drawn)
    total = table.weight.sum(axis=3)
    for leaf in range(len(SIZES)):
        share = (classes[members_of(grown, leaf)] >= N_PARTS).mean()
        assert total[leaf, 0] == pytest.approx(1.0 - share, abs=1e-5)
        assert total[leaf, 1] == pytest.approx(share, abs=1e-5)
    few = table_of(training, classes, grown, n_leaf_votes=2, n_drawn=n_drawn)
    assert np.array_equal(few.weight, table.weight[..., :2])
    assert np.array_equal(few.vote, table.vote[..., :2, :])


def test_modes_lie_where_the_joints_are_seen_from_the_samples():
    """One pose, samples in one place: the only mode is the offset."""
    training, classes, grown = world((50,))
    training = training._replace(
        joints=np.broadcast_to(training.joints[:1], training.joints.shape).copy(),
        crops=training.crops._replace(origin=np.zeros_like(training.crops.origin)),
        samples=training.samples._replace(
            x=np.full(50, 50, np.int16), y=np.full(50, 40, np.int16), z_mm=np.full(50, 2000, np.uint16)
        ),
    )
    table = table_of(training, classes, grown)
    point = np.array([(50 - 60) * 2.0 / 500, (40 - 50) * 2.0 / 510, 2.0])
    assert np.allclose(table.vote[0, :, :, 0], training.joints[0] - point, atol=1e-5)
    assert (table.weight[..., 1:] == 0).all()
    assert (table.vote[..., 1:, :] == 0).all()


def test_a_leaf_of_occluder_samples_has_no_body_modes():
    training, classes, grown = world()
    classes[members_of(grown, 3)] = N_PARTS
    classes[members_of(grown, 4)] = 0
    table = table_of(training, classes, grown)
    for leaf, empty in ((3, 0), (4, 1)):
        assert (table.weight[leaf, empty] == 0).all()
        assert (table.vote[leaf, empty] == 0).all()
        assert (table.weight[leaf, 1 - empty, :, 0] > 0).all()


def test_a_leaf_without_samples_knows_nothing():
    table = table_of(*world((4, 0, 3)))
    assert np.allclose(table.probability[1], 1 / N_CLASSES)
    assert (table.weight[1] == 0).all()


def facings() -> np.ndarray:
    angle = np.random.default_rng(5).uniform(-np.pi, np.pi, N_FRAMES)
    out = np.stack([np.cos(angle), np.sin(angle)], axis=1).astype(np.float32)
    out[::7] = 0.0
    return out


def test_votes_know_which_way_the_people_face_who_cast_them():
    training, classes, grown = world()
    facing = facings()
    table = leaf_table(training, classes, grown, RULES, facing=facing)
    plain = table_of(training, classes, grown)
    assert plain.facing is None
    assert np.array_equal(table.vote, plain.vote)
    for leaf in (3, 5, 6):
        members = members_of(grown, leaf)
        offsets, is_occluder = offsets_of(training, members), classes[members] >= N_PARTS
        for layer, joint, k in np.ndindex(table.weight.shape[1:]):
            own = offsets[is_occluder == (layer == 1), joint]
            near = np.exp(-((own - table.vote[leaf, layer, joint, k]) ** 2).sum(axis=1) / B**2)
            of = facing[training.samples.frame[members][is_occluder == (layer == 1)]]
            mean = (near @ of) / near.sum() if table.weight[leaf, layer, joint, k] > 0 else np.zeros(2)
            assert np.allclose(table.facing[leaf, layer, joint, k], mean, atol=1e-4)


def test_leaves_learned_anew_from_a_part_are_those_of_a_tree_that_has_only_that_part():
    training, classes, grown = world()
    leaf = np.empty(len(classes), np.int32)
    for number in range(len(SIZES)):
        leaf[members_of(grown, number)] = number
    is_kept = training.samples.frame < N_FRAMES // 2
    part = regrouped(grown.nodes, len(SIZES), leaf, is_kept)
    for number in range(len(SIZES)):
        members = members_of(grown, number)
        assert np.array_equal(members_of(part, number), members[is_kept[members]])
    table = table_of(training, classes, part)
    alone = training._replace(samples=Samples(*(values[is_kept] for values in training.samples)))
    place = np.cumsum(is_kept) - 1
    again = table_of(alone, classes[is_kept], part._replace(order=place[part.order].astype(np.int32)))
    for one, two in zip(table[:3], again[:3], strict=True):
        assert np.array_equal(one, two)


def test_any_number_of_threads_gives_the_same_bytes():
    """More leaves than one task has."""
    training, classes, grown = world((3, 9, 1, 30) * 600)
    told: list[int] = []
    one = leaf_table(training, classes, grown, RULES, facing=facings())
    two = leaf_table(training, classes, grown, RULES, 2, told.append, facings())
    assert sum(told) == 2400
    assert len(told) > 1
    for a, b in zip(one, two, strict=True):
        assert a.tobytes() == b.tobytes()


def test_which_samples_are_drawn_depends_on_seed_and_tree():
    training, classes, grown = world()
    first = table_of(training, classes, grown, n_drawn=20)
    for changes in ({"seed": 1}, {"tree": 1}):
        other = table_of(training, classes, grown, n_drawn=20, **changes)
        is_small = np.array(SIZES) <= 20
        assert np.array_equal(other.vote[is_small], first.vote[is_small])
        assert not np.array_equal(other.vote[~is_small], first.vote[~is_small])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n_parts": 6}, "n_parts=6 and n_classes=5 must be in 1..256, parts not above classes"),
        ({"n_leaf_votes": 0}, "n_leaf_votes=0 must be at least 1"),
        ({"n_threads": 0}, "n_threads=0 must be at least 1"),
        ({"n_drawn": 0}, "n_drawn=0 must be at least 1"),
        ({"n_starts": -1}, "n_starts=-1 must be at least 1"),
        ({"classes": np.zeros(3, np.uint8)}, r"classes are uint8 \(3,\), must be uint8 \(1145,\)"),
        ({"classes": np.full(1145, 5, np.uint8)}, r"class 5 is not in 0..4"),
    ],
)
def test_wrong_arguments_are_refused(changes, message):
    training, classes, grown = world()
    given = {"training": training, "classes": classes, "grown": grown, **changes}
    with pytest.raises(ValueError, match=message):
        table_of(**given)


@pytest.mark.parametrize("bandwidth", [0.0, -1.0, np.inf, np.nan])
def test_the_bandwidth_is_a_length(bandwidth):
    training, classes, grown = world((3,))
    with pytest.raises(ValueError, match="must be above 0 and finite"):
        table_of(training, classes, grown, bandwidth_m=bandwidth)
