import gc
import weakref

import numpy as np
import pytest

from synth.bodies.body import Pose, kept_with_body
from synth.bodies.rig.collision import (
    MIN_SHARE,
    SEGMENTS,
    _held_by,
    dominant_links,
    excess_depth,
    excess_of_limb,
    fit_of,
    link_shares,
    moved_by,
)
from synth.bodies.rig.collision_profiles import MIN_CELL_POINTS, N_DIRECTIONS, N_HEIGHTS, _fill
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.rig.skinning import lowest_before, pose_links, pose_skin
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, N_DOFS, UPPER
from synth.bodies.spec import sample_body

BODY = make_body(sample_body(np.random.default_rng(4)))
SHARES = link_shares(BODY)


def filled_slowly(local: np.ndarray, low: float, high: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Axis, sums and counts of a profile's cells, by one mask a height."""
    step = max(high - low, 1e-6) / (N_HEIGHTS - 1)
    row = np.clip(np.rint((local[:, 2] - low) / step).astype(int), 0, N_HEIGHTS - 1)
    centre, total = np.zeros((N_HEIGHTS, 2)), np.zeros((N_HEIGHTS, N_DIRECTIONS))
    count = np.zeros((N_HEIGHTS, N_DIRECTIONS), int)
    for h in range(N_HEIGHTS):
        reach = 0
        while np.count_nonzero(np.abs(row - h) <= reach) < min(MIN_CELL_POINTS, len(local)):
            reach += 1
        own = local[np.abs(row - h) <= reach, :2]
        centre[h] = 0.5 * (own.min(axis=0) + own.max(axis=0))
        x, y = (own - centre[h]).T
        d = np.rint(np.arctan2(y, x) / (2 * np.pi) * N_DIRECTIONS).astype(int) % N_DIRECTIONS
        np.add.at(total[h], d, np.hypot(x, y))
        np.add.at(count[h], d, 1)
    return centre, total, count


@pytest.mark.parametrize("n", [5, 40, 900])
def test_profiles_hold_the_mean_radius_of_each_cell(n):
    local = np.random.default_rng(n).normal(0, 0.1, (n, 3))
    centre, radius = np.zeros((N_HEIGHTS, 2)), np.zeros((N_HEIGHTS, N_DIRECTIONS))
    _fill(local, -0.2, 0.15, centre, radius)
    want, total, count = filled_slowly(local, -0.2, 0.15)
    np.testing.assert_array_equal(centre, want)
    np.testing.assert_allclose(radius[count > 0], (total[count > 0] / count[count > 0]), atol=1e-12)


def test_the_dominant_link_is_that_of_the_greatest_share():
    np.testing.assert_array_equal(dominant_links(BODY), SHARES.argmax(axis=1))


@pytest.mark.parametrize("links", [("root",), ("l_hip_abduction", "l_hip_rotation"), ("r_toes_extension",)])
def test_vertices_moved_by_links_are_those_they_dominate_in_order(links):
    want = np.flatnonzero(np.isin(SHARES.argmax(axis=1), [LINK_IDX[link] for link in links]))
    assert len(want)
    np.testing.assert_array_equal(moved_by(BODY, links), want)


@pytest.mark.parametrize("segment", ["pelvis", "l_forearm", "r_foot"])
def test_vertices_held_by_a_segment_have_its_least_share(segment):
    links = np.array([LINK_IDX[link] for link in SEGMENTS[segment][1]])
    want = np.flatnonzero(SHARES[:, links].sum(axis=1) >= MIN_SHARE)
    np.testing.assert_array_equal(_held_by(SHARES, links, MIN_SHARE), want)


def test_links_placed_without_checks_are_those_placed_with_them():
    rng = np.random.default_rng(0)
    angles, root = rng.uniform(LOWER, UPPER), np.eye(4)
    want = link_transforms(BODY.skeleton, angles, root)
    np.testing.assert_array_equal(pose_links(BODY, angles, root), want)
    np.testing.assert_array_equal(pose_skin(BODY, angles, root, np.array([0]))[0], want)


def test_the_lowest_point_before_a_front_is_found():
    skin = np.random.default_rng(1).normal(size=(50, 3)).astype(np.float32)
    assert lowest_before(skin, np.inf) == float(skin[:, 2].min())
    assert lowest_before(skin, 0.3) == float(skin[skin[:, 0] < 0.3, 2].min())
    assert lowest_before(skin, -9.0) == np.inf


def test_the_worst_collision_is_that_of_the_worst_limb():
    rng = np.random.default_rng(2)
    for _ in range(5):
        angles = rng.uniform(0.6 * LOWER, 0.6 * UPPER)
        limbs = [
            excess_of_limb(BODY, angles, np.eye(4), f"{side}_{limb}") for side in "lr" for limb in ("arm", "leg")
        ]
        assert excess_depth(BODY, Pose(angles, np.eye(4))) == max(limbs)


def test_an_arm_laid_through_the_trunk_collides():
    angles = np.zeros(N_DOFS)
    assert excess_of_limb(BODY, BODY.bind_angles, np.eye(4), "l_arm") <= 0.0
    angles[[DOF_IDX["l_shoulder_abduction"], DOF_IDX["l_elbow_flexion"]]] = (
        LOWER[DOF_IDX["l_shoulder_abduction"]],
        1.5,
    )
    angles[DOF_IDX["l_shoulder_rotation"]] = UPPER[DOF_IDX["l_shoulder_rotation"]]
    assert excess_of_limb(BODY, angles, np.eye(4), "l_arm") > 0.01


def test_what_is_kept_with_a_body_is_made_once_and_goes_with_it():
    made = []

    @kept_with_body
    def value_of(body):
        made.append(weakref.ref(body))
        return np.zeros(3)

    body = make_body(BODY.spec)
    assert value_of(body) is value_of(body)
    assert value_of(BODY) is not value_of(body)
    assert len(made) == 2
    fit_of(body)
    del body
    gc.collect()
    assert made[0]() is None
