"""Points, clusters, limbs, starts and smoothing of random walks."""

import numpy as np
import pytest

from forests.boxes import upper_body_box
from forests.crops import Crops, crop_image
from forests.frames import Intrinsics
from forests.growing import DIRECTION_ONE, GrownTree
from forests.rwf.clusters import leaf_clusters
from forests.rwf.config import UPPER_BODY, RWFConfig
from forests.rwf.points import draw_way_points, farthest_behind, growth_targets
from forests.rwf.skeleton import chosen_joints, fit_limbs, measure_limbs
from forests.rwf.start import start_point
from forests.skeleton.kinematics import SKELETON, parents_first, parents_of
from forests.smoothing import SkeletonSmoother, SmoothingConfig

CAMERA = Intrinsics(100.0, 100.0, 47.5, 35.5)
NAMES = tuple(name for name, _ in SKELETON)
PARENTS = parents_of(NAMES, SKELETON)


def wall_with_hole() -> np.ndarray:
    depth = np.zeros((72, 96), np.uint16)
    depth[10:60, 20:80] = 2000
    return depth


def drawn(n_points=400, near_share=0.5, gate=(0.0, np.inf), noise_m=0.0):
    crops = crop_image(wall_with_hole(), CAMERA)
    joint, start = np.float32([[0.05, 0.02, 2.2]]), np.float32([[-0.3, -0.2, 2.05]])
    points = draw_way_points(crops, joint, start, np.float32(gate), n_points, near_share, 0.4, noise_m, 3, 1)
    return points, points.samples.points(crops), joint[0], start[0]


def test_offsets_lead_from_the_point_to_the_joint():
    points, places, joint, _ = drawn()
    # A pixel at 2 m spans 2 cm: a point is known from its pixel to 1 cm a side.
    off = np.abs(points.offsets - (joint - places))
    assert off.max() < 0.016
    assert np.linalg.norm(points.offsets, axis=1).max() > 0.3


def test_trees_are_grown_by_directions_far_away_and_by_offsets_near():
    offsets = np.float32([[3.0, 4.0, 0.0], [0.0, 0.0, 0.01], [0.0, 0.0, 0.0]])
    targets = growth_targets(offsets, 0.1) / DIRECTION_ONE
    np.testing.assert_allclose(targets[0], [0.6, 0.8, 0.0], atol=1e-3)
    np.testing.assert_allclose(targets[1], [0.0, 0.0, 0.1], atol=1e-3)
    np.testing.assert_array_equal(targets[2], 0.0)
    alone = growth_targets(offsets, 0.0) / DIRECTION_ONE
    np.testing.assert_allclose(np.linalg.norm(alone, axis=1), [1, 1, 0], atol=1e-4)


def test_points_lie_in_the_ball_or_on_the_way():
    _, near, joint, _ = drawn(near_share=1.0)
    radius = np.linalg.norm(near - joint, axis=1)
    assert radius.max() < 0.42
    assert 0.17 < radius.mean() < 0.23
    _, way, joint, start = drawn(near_share=0.0)
    share = (way - joint) @ (start - joint) / ((start - joint) @ (start - joint))
    assert np.linalg.norm(way - joint - share[:, None] * (start - joint), axis=1).max() < 0.025
    assert share.min() > -0.05
    assert share.max() < 1.05


def test_points_near_the_surface_are_put_on_it_and_others_moved_into_the_gate():
    for gate, expected in (((9.0, 9.0), {2000}), ((0.1, 0.15), {2000, *range(2100, 2151)})):
        points, _, _, _ = drawn(gate=gate)
        image_x, image_y = points.samples.x + 19, points.samples.y + 9
        on_wall = (image_x >= 20) & (image_x < 80) & (image_y >= 10) & (image_y < 60)
        assert on_wall.sum() > 100
        assert set(np.unique(points.samples.z_mm[on_wall])) <= expected


def test_points_repeat_and_are_in_image_order():
    first, again = drawn()[0], drawn()[0]
    for a, b in zip((*first.samples, first.offsets), (*again.samples, again.offsets), strict=True):
        np.testing.assert_array_equal(a, b)
    order = np.lexsort((first.samples.x, first.samples.y, first.samples.frame))
    np.testing.assert_array_equal(order, np.arange(len(order)))


def test_the_gate_ends_where_few_joints_lie_farther_behind_what_the_image_shows():
    crops = crop_image(wall_with_hole(), CAMERA)
    behind = np.float32([[0, 0, 2.01 + 0.01 * k] for k in range(101)])
    many = Crops(crops.pixels, *(np.repeat(values, 101, axis=0) for values in crops[1:]))
    assert farthest_behind(many, behind, 0.1) == pytest.approx(0.91, abs=1e-5)
    assert farthest_behind(crops, np.float32([[5, 0, 2.07]]), 0.1) == np.inf
    assert farthest_behind(crops, np.float32([[0, 0, 1.9]]), 0.1) == 0


def test_clusters_of_two_bundles_are_their_means_shares_and_spreads():
    rng = np.random.default_rng(0)
    right = np.array([0.3, 0, 0]) + 0.02 * rng.normal(size=(60, 3))
    down = np.array([0, 0.3, 0]) + 0.01 * rng.normal(size=(20, 3))
    offsets = np.concatenate([right, down, [[0.0, 0.0, 0.2]]]).astype(np.float32)
    grown = GrownTree(np.empty(0), np.array([0, 80, 81]), np.arange(81, dtype=np.int32))
    mean, share, spread = leaf_clusters(grown, offsets, 3, 0.1)
    np.testing.assert_allclose(mean[0, :2], [right.mean(axis=0), down.mean(axis=0)], atol=1e-6)
    np.testing.assert_allclose(share, [[0.75, 0.25, 0], [1, 0, 0]])
    np.testing.assert_allclose(mean[1, 0], [0, 0, 0.2], atol=1e-6)
    exact = [np.sqrt(bundle.var(axis=0).sum()) for bundle in (right, down)]
    np.testing.assert_allclose(spread, [[*exact, 0], [0, 0, 0]], atol=1e-4)


def test_a_leaf_without_samples_stands_still():
    grown = GrownTree(np.empty(0), np.array([0, 0]), np.empty(0, np.int32))
    mean, share, spread = leaf_clusters(grown, np.empty((0, 3), np.float32), 2, 0.1)
    np.testing.assert_array_equal(mean, 0)
    np.testing.assert_array_equal(share, [[1, 0]])
    np.testing.assert_array_equal(spread, 0)


def test_parents_skip_joints_that_have_no_expert():
    assert parents_of(("head", "r_hand", "torso"), SKELETON).tolist() == [-1, -1, -1]
    assert parents_of(("neck", "r_hand", "head"), SKELETON).tolist() == [-1, 0, 0]
    order = parents_first(PARENTS).tolist()
    assert sorted(order) == list(range(15))
    assert all(PARENTS[j] < 0 or order.index(PARENTS[j]) < order.index(j) for j in order)
    with pytest.raises(ValueError, match="own ancestor"):
        parents_first(np.array([1, 0], np.int32))


def test_unknown_joints_are_named():
    assert chosen_joints(NAMES, UPPER_BODY).tolist() == [0, 1, 2, 3, 4, 5, 6, 7, 8]
    with pytest.raises(ValueError, match="tail"):
        chosen_joints(NAMES, ("tail",))


def test_fitted_limbs_have_possible_lengths_and_possible_limbs_stay():
    rng = np.random.default_rng(0)
    training = rng.normal(size=(300, 15, 3)).astype(np.float32)
    limbs = measure_limbs(training, PARENTS, 0.2)
    order = parents_first(PARENTS)
    joints = (3 * rng.normal(size=(15, 3))).astype(np.float32)
    fit_limbs(joints, order, limbs.parent, limbs.length_m)
    has_parent = PARENTS >= 0
    length = np.linalg.norm(joints - joints[PARENTS], axis=1)[has_parent]
    low, high = limbs.length_m[has_parent].T
    assert (length > low - 1e-5).all()
    assert (length < high + 1e-5).all()
    again = joints.copy()
    fit_limbs(again, order, limbs.parent, limbs.length_m)
    np.testing.assert_allclose(again, joints, atol=1e-5)


def test_limits_of_limbs_leave_out_the_given_share():
    joints = np.zeros((101, 2, 3), np.float32)
    joints[:, 1, 0] = np.arange(101)
    limbs = measure_limbs(joints, np.array([-1, 0], np.int32), 0.1)
    np.testing.assert_allclose(limbs.length_m[1], [10, 90])
    assert limbs.length_m[0].tolist() == [0, np.inf]


def test_starts_lie_where_the_box_the_pixel_or_the_point_says():
    depth = wall_with_hole()
    np.testing.assert_allclose(start_point(depth, CAMERA, start=(40, 30)), [-0.15, -0.11, 2.0], atol=1e-6)
    np.testing.assert_allclose(start_point(depth, CAMERA, start=(0.1, 0.2, 1.5)), [0.1, 0.2, 1.5], atol=1e-6)
    np.testing.assert_allclose(start_point(depth, CAMERA, box=(30, 20, 51, 41)), [-0.15, -0.11, 2.0], atol=1e-6)
    np.testing.assert_allclose(start_point(depth, CAMERA), [0.04, -0.02, 2.0], atol=1e-6)
    np.testing.assert_allclose(start_point(depth, CAMERA, start=(2, 2)), [-0.91, -0.67, 2.0], atol=1e-6)
    np.testing.assert_allclose(start_point(depth, CAMERA, start=(-50, 900))[2], 2.0)
    empty = np.zeros_like(depth)
    assert start_point(empty, CAMERA) is None
    assert start_point(empty, CAMERA, box=(1, 2, 3, 4)) is None
    assert start_point(empty, CAMERA, start=(3, 4)) is None


@pytest.mark.parametrize(
    "given",
    [
        {"start": (1, 2), "box": (0, 0, 2, 2)},
        {"start": (1, 2, 3, 4)},
        {"start": (np.nan, 2)},
        {"start": (0, 0, -1)},
        {"box": (5, 0, 5, 2)},
        {"box": (0, 0, np.inf, 2)},
    ],
)
def test_starts_of_another_form_are_refused(given):
    with pytest.raises(ValueError, match=r"start|box"):
        start_point(wall_with_hole(), CAMERA, **given)


def test_an_upper_body_box_holds_the_joints():
    joints = np.float32([[0.1, 0.2, 2.0], [-0.3, -0.1, 2.0]])
    left, top, right, bottom = upper_body_box(joints, CAMERA, 0.1)
    np.testing.assert_allclose([left, top, right, bottom], [32.5 - 5, 30.5 - 5, 52.5 + 6, 45.5 + 6], atol=1e-4)


@pytest.mark.parametrize(
    "wrong",
    [
        {"n_trees": 0},
        {"scatter_m": 0.0},
        {"gate_share": 0.5},
        {"bandwidth_m": 0.0},
        {"snap_m": ()},
        {"snap_m": (0.3, -0.1)},
        {"n_arriving": 16},
        {"near_share": 2.0},
    ],
)
def test_a_config_refuses_what_makes_no_sense(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        RWFConfig(n_steps=16, **wrong)


def test_smoothing_is_exact_on_constant_input():
    joints = np.random.default_rng(0).normal(size=(15, 3)).astype(np.float32)
    smoother = SkeletonSmoother()
    for confidence in (0.9, 0.1, 0.5, 0.9):
        np.testing.assert_array_equal(smoother.update(joints, np.full(15, confidence), 1 / 30), joints)


def test_smoothing_reduces_the_jitter_of_a_noisy_still_sequence_and_its_error():
    rng = np.random.default_rng(1)
    truth = rng.normal(size=(15, 3))
    noisy = truth + 0.04 * rng.normal(size=(120, 15, 3))
    smoother = SkeletonSmoother()
    smooth = np.stack([smoother.update(frame, np.ones(15), 1 / 30) for frame in noisy])

    def jitter(path):
        return np.linalg.norm(np.diff(path, axis=0), axis=2).mean()

    assert jitter(smooth) < 0.4 * jitter(noisy)
    assert np.abs(smooth[20:] - truth).mean() < 0.7 * np.abs(noisy[20:] - truth).mean()


def test_smoothing_follows_steady_motion_without_lag():
    smoother = SkeletonSmoother(SmoothingConfig(noise_m=0.01))
    for frame in range(120):
        place = np.full((1, 3), 0.8 * frame / 30)
        smooth = smoother.update(place, np.ones(1), 1 / 30)
    np.testing.assert_allclose(smooth, place, atol=1e-3)


def test_an_unsure_estimate_moves_a_joint_less_than_a_sure_one():
    moved = []
    for confidence in (1.0, 0.1):
        smoother = SkeletonSmoother()
        for _ in range(10):
            smoother.update(np.zeros((1, 3)), np.ones(1), 1 / 30)
        moved.append(smoother.update(np.full((1, 3), 0.02), np.full(1, confidence), 1 / 30)[0, 0])
    assert moved[0] > 5 * moved[1] > 0


def test_a_joint_that_is_missing_goes_on_and_one_never_seen_is_missing():
    smoother = SkeletonSmoother()
    missing = np.full((2, 3), np.nan)
    assert np.isnan(smoother.update(missing, np.zeros(2), 0.1)).all()
    smoother.update([[1, 2, 3], [np.nan] * 3], [1, 0], 0.1)
    after = smoother.update(missing, np.zeros(2), 0.1)
    np.testing.assert_allclose(after[0], [1, 2, 3])
    assert np.isnan(after[1]).all()


def test_smoothing_refuses_what_is_no_next_frame():
    smoother = SkeletonSmoother()
    smoother.update(np.zeros((2, 3)), np.ones(2), 0.1)
    for joints, confidence, seconds in (
        (np.zeros((3, 3)), np.ones(3), 0.1),
        (np.zeros((2, 2)), np.ones(2), 0.1),
        (np.zeros((2, 3)), np.ones(2), 0.0),
    ):
        with pytest.raises(ValueError, match=r"joints|seconds"):
            smoother.update(joints, confidence, seconds)
    smoother.reset()
    assert len(smoother.update(np.zeros((3, 3)), np.ones(3), 0.1)) == 3
