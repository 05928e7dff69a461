"""Laws of decoding, and the slow twin of its dynamic programming."""

import itertools

import numpy as np
import pytest

from forests.skeleton.decode import MISSING, MOST_DEVIATIONS, SLACK, choose_candidates, limit_limbs
from forests.skeleton.kinematics import mirrored_joints, parents_first, parents_of
from forests.skeleton.prior import measure_bodies

NAMES = ("neck", "head", "r_shoulder", "l_shoulder", "r_elbow", "l_elbow")
WEIGHT = 0.7


def bodies(rng, n=80):
    """People of several sizes in random poses: limbs of one length times the size, and 5 % of noise."""
    parent = parents_of(NAMES)
    joints = np.zeros((n, len(NAMES), 3))
    size = rng.uniform(0.8, 1.2, n)
    for joint in parents_first(parent):
        if parent[joint] < 0:
            joints[:, joint] = rng.normal((0, 0, 3), 0.2, (n, 3))
            continue
        way = rng.normal(size=(n, 3))
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        length = 0.3 * size * rng.normal(1.0, 0.05, n)
        joints[:, joint] = joints[:, parent[joint]] + way * length[:, None]
    return joints.astype(np.float32)


PRIOR = measure_bodies(bodies(np.random.default_rng(0)), NAMES)


def sum_of(candidates, score, choice, size):
    """What a choice scores for one size of the person: the definition, slowly."""
    total = sum(score[joint, k] for joint, k in enumerate(choice))
    for joint, above in enumerate(PRIOR.parent):
        if above < 0:
            continue
        gap = candidates[joint, choice[joint]].astype(float) - candidates[above, choice[above]]
        if np.isnan(gap).any():
            continue
        length = max(np.linalg.norm(gap), 0.01)
        t = (np.log(length) - PRIOR.log_length[joint] - size) / PRIOR.deviation[joint]
        total -= 0.5 * WEIGHT * min(abs(t), MOST_DEVIATIONS) ** 2
    return total


def best_of_all(candidates, score):
    n_joints, n = score.shape
    return max(
        sum_of(candidates, score, choice, size)
        for choice in itertools.product(range(n), repeat=n_joints)
        for size in PRIOR.log_size
    )


def chosen(candidates, score):
    choice = np.empty(len(score), np.int64)
    return choose_candidates(candidates, score, PRIOR, WEIGHT, choice), choice


def drawn(rng, n=3):
    body = bodies(rng, 1)[0]
    candidates = (body[:, None] + rng.normal(0, 0.15, (len(NAMES), n, 3))).astype(np.float32)
    return candidates, rng.normal(0, 1, (len(NAMES), n))


@pytest.mark.parametrize("seed", range(12))
def test_the_choice_is_the_best_of_all_choices(seed):
    rng = np.random.default_rng(seed)
    candidates, score = drawn(rng)
    if seed % 3 == 1:
        candidates[rng.integers(len(NAMES)), 1] = np.nan
    if seed % 3 == 2:
        score[rng.integers(len(NAMES)), :2] = MISSING
    total, choice = chosen(candidates, score)
    np.testing.assert_allclose(total, best_of_all(candidates, score), rtol=1e-5)
    np.testing.assert_allclose(max(sum_of(candidates, score, choice, s) for s in PRIOR.log_size), total, rtol=1e-5)


def test_the_order_of_candidates_does_not_matter():
    rng = np.random.default_rng(3)
    candidates, score = drawn(rng, 4)
    total, choice = chosen(candidates, score)
    order = rng.permutation(4)
    total_again, again = chosen(np.ascontiguousarray(candidates[:, order]), np.ascontiguousarray(score[:, order]))
    assert total == pytest.approx(total_again)
    assert (order[again] == choice).all()


def test_a_mirrored_frame_gives_the_mirrored_choice():
    candidates, score = drawn(np.random.default_rng(4), 4)
    _, choice = chosen(candidates, score)
    mirror = mirrored_joints(NAMES)
    _, mirrored = chosen(np.ascontiguousarray(candidates[mirror] * np.float32([-1, 1, 1])), score[mirror].copy())
    assert (mirrored == choice[mirror]).all()


def test_without_any_candidate_nothing_is_chosen_wrongly():
    candidates, score = drawn(np.random.default_rng(5))
    candidates[:] = np.nan
    score[:] = MISSING
    _, choice = chosen(candidates, score)
    assert ((choice >= 0) & (choice < 3)).all()


def test_bodies_are_measured_alike_left_and_right_and_without_what_is_unknown():
    joints = bodies(np.random.default_rng(1))
    mirror = mirrored_joints(NAMES)
    prior = measure_bodies(joints, NAMES)
    np.testing.assert_array_equal(prior.length_m, prior.length_m[mirror])
    np.testing.assert_allclose(prior.log_length[1:], np.log(0.3), atol=0.05)
    np.testing.assert_allclose(prior.deviation[1:], 0.05, atol=0.02)
    assert prior.deviation[0] == np.inf
    assert (np.diff(prior.log_size) > 0).all()
    joints[:, 1] = np.nan
    partial = measure_bodies(joints, NAMES)
    assert partial.deviation[1] == np.inf
    assert partial.length_m[1].tolist() == [0.0, np.inf]


@pytest.mark.parametrize("seed", range(5))
def test_limbs_become_possible_and_possible_ones_stay(seed):
    rng = np.random.default_rng(seed)
    joints = (bodies(rng, 1)[0] + rng.normal(0, 0.3, (len(NAMES), 3))).astype(np.float32)
    joints[5] = joints[3]
    moved = joints.copy()
    limit_limbs(moved, rng.uniform(0.5, 2.0, len(NAMES)), PRIOR)
    length = np.linalg.norm(moved - moved[PRIOR.parent], axis=1)[1:]
    assert (length >= PRIOR.length_m[1:, 0] / SLACK - 1e-4).all()
    assert (length <= PRIOR.length_m[1:, 1] * SLACK + 1e-4).all()
    again = moved.copy()
    limit_limbs(again, np.ones(len(NAMES)), PRIOR)
    np.testing.assert_allclose(again, moved, atol=1e-4)


def test_what_is_nowhere_stays_nowhere_and_moves_nothing():
    joints = bodies(np.random.default_rng(2), 1)[0]
    joints[2] = np.nan
    moved = joints.copy()
    limit_limbs(moved, np.ones(len(NAMES)), PRIOR)
    np.testing.assert_array_equal(moved, joints)
