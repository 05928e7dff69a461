"""The model of recorded life keeps the laws of poses, and coverage is what it says."""

import numpy as np
import pytest

from synth.bodies.body import Pose
from synth.bodies.life.coverage import nearest_distances, places_of
from synth.bodies.life.model import (
    ARMS,
    HEAD,
    LEGS,
    N_ANGLES,
    N_FEET_STATES,
    NAMES,
    POSTURES,
    LifeDraw,
    life_model,
    mirrored,
    mirrored_feet,
    vectors_of,
)
from synth.bodies.rig.kinematics import joint_positions
from synth.bodies.skeleton import DOF_IDX, LOWER, UPPER, Lengths, make_skeleton
from synth.vocabulary import JOINT_NAMES


def many(posture: str, n: int = 300, spread: float = 1.0) -> list[LifeDraw]:
    rng = np.random.default_rng(3)
    return [life_model().draw(posture, rng, spread) for _ in range(n)]


@pytest.mark.parametrize("posture", POSTURES)
def test_draws_keep_the_joint_limits_and_turn_the_root_by_a_rotation(posture: str) -> None:
    for drawn in many(posture):
        assert (drawn.angles >= LOWER).all()
        assert (drawn.angles <= UPPER).all()
        np.testing.assert_allclose(drawn.R_world_root @ drawn.R_world_root.T, np.eye(3), atol=1e-12)
        assert set(drawn.feet) <= {0, 1, 2}


@pytest.mark.parametrize("posture", POSTURES)
def test_a_seed_gives_the_same_draws(posture: str) -> None:
    for a, b in zip(many(posture, 5), many(posture, 5), strict=True):
        assert a.angles.tobytes() == b.angles.tobytes()
        assert a.R_world_root.tobytes() == b.R_world_root.tobytes()


@pytest.mark.parametrize("posture", POSTURES)
def test_the_shipped_numbers_are_a_mixture_and_hold_no_single_pose(posture: str) -> None:
    mixture = life_model().mixtures[posture]
    k = len(mixture.weight)
    assert mixture.weight.sum() == pytest.approx(1.0, abs=1e-3)
    assert mixture.mean.shape == mixture.noise.shape == (k, N_ANGLES)
    assert mixture.feet.shape == (k, N_FEET_STATES)
    assert all(np.isfinite(array).all() for array in mixture)
    assert (mixture.noise >= 0.0).all()
    assert life_model().n_poses[posture] >= 8 * k
    assert "mocap.cs.cmu.edu" in life_model().source


def test_draws_without_spread_are_means_and_mirrored_ones() -> None:
    mixture = life_model().mixtures["sitting"]
    means = np.concatenate([mixture.mean, mirrored(mixture.mean)])
    rng = np.random.default_rng(0)
    for _ in range(20):
        angles, _ = mixture.draw(rng, 0.0)
        assert np.abs(means - angles).max(axis=1).min() == 0.0


def test_the_mirror_undoes_itself_and_mirrors_the_joints() -> None:
    rng = np.random.default_rng(1)
    vector = rng.normal(0.0, 0.3, N_ANGLES)
    np.testing.assert_array_equal(mirrored(mirrored(vector)), vector)
    assert [mirrored_feet(mirrored_feet(k)) for k in range(N_FEET_STATES)] == list(range(N_FEET_STATES))
    np.testing.assert_array_equal(mirrored(vector)[ARMS[0]], vector[ARMS[1]])
    np.testing.assert_array_equal(mirrored(vector)[LEGS[1]], vector[LEGS[0]])
    drawn = many("standing", 1)[0]
    other = mirrored(vectors_of(drawn.angles[None], drawn.R_world_root[None]))[0]
    angles = drawn.angles.copy()
    for name, value in zip(NAMES[3:], other[3:], strict=True):
        angles[DOF_IDX[name]] = value
    R = drawn.R_world_root * np.outer((1, -1, 1), (1, -1, 1))
    here, there = places_of(np.stack([drawn.angles, angles]), np.stack([drawn.R_world_root, R]))
    swapped = [JOINT_NAMES.index({"l": "r", "r": "l"}[n[0]] + n[1:] if n[1] == "_" else n) for n in JOINT_NAMES]
    np.testing.assert_allclose(there, here[swapped] * (1, -1, 1), atol=1e-9)


def test_vectors_tell_the_angles_that_poses_were_made_of() -> None:
    drawn = many("sitting", 40)
    vectors = vectors_of(np.stack([d.angles for d in drawn]), np.stack([d.R_world_root for d in drawn]))
    for vector, one in zip(vectors, drawn, strict=True):
        np.testing.assert_array_equal(vector[3:], [one.angles[DOF_IDX[name]] for name in NAMES[3:]])
    assert set(np.concatenate([HEAD, *ARMS, *LEGS]).tolist()) <= set(range(3, N_ANGLES))


def test_the_legs_of_seated_draws_are_no_copies() -> None:
    vectors = np.stack([one.angles for one in many("sitting")])
    knees = np.degrees(np.abs(vectors[:, DOF_IDX["l_knee_flexion"]] - vectors[:, DOF_IDX["r_knee_flexion"]]))
    assert np.quantile(knees, 0.95) > 25.0


def test_the_nearest_distance_is_the_mean_over_joints_of_the_nearest_pose() -> None:
    rng = np.random.default_rng(2)
    asked, known = rng.normal(size=(7, 15, 3)), rng.normal(size=(23, 15, 3))
    slow = [min(float(np.linalg.norm(a - b, axis=1).mean()) for b in known) for a in asked]
    np.testing.assert_allclose(nearest_distances(asked, known), slow, rtol=1e-5)
    assert (nearest_distances(known[:3], known) == 0.0).all()
    with pytest.raises(ValueError, match="with others"):
        nearest_distances(asked, known[:0])


def test_places_forget_the_heading_alone() -> None:
    drawn = many("standing", 4)
    angles, roots = np.stack([d.angles for d in drawn]), np.stack([d.R_world_root for d in drawn])
    c, s = np.cos(1.1), np.sin(1.1)
    turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ roots
    np.testing.assert_allclose(places_of(angles, turned), places_of(angles, roots), atol=1e-12)
    T = np.eye(4)
    yaw = np.arctan2(roots[0, 1, 0], roots[0, 0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    T[:3, :3] = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ roots[0]
    expected = joint_positions(make_skeleton(Lengths.of_stature(1.7)), Pose(angles[0], T))
    np.testing.assert_allclose(places_of(angles, roots)[0], expected, atol=1e-12)
