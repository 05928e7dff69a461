"""Skeletons of several cameras: the laws of fusing them, and a slow twin."""

import numpy as np
import pytest

from pipelines.metrics.fusing import FusionConfig, fuse

EYES = np.array([[3.0, 0.0, 2.0], [-3.0, 0.5, 2.2], [0.0, 3.0, 1.9], [0.3, -3.2, 2.1]])


def answers(seed=0, n_joints=15, spread=0.05):
    """Truth, answers of four cameras and their probabilities."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform((-0.5, -0.5, 0.5), (0.5, 0.5, 1.5), (n_joints, 3))
    joints = truth + rng.normal(0.0, spread, (len(EYES), n_joints, 3))
    return truth, joints, rng.uniform(0.2, 1.0, (len(EYES), n_joints))


def test_the_same_answer_several_times_is_as_good_as_once():
    _, joints, sure = answers()
    place, told = fuse(
        np.repeat(joints[:1], 4, axis=0), np.repeat(sure[:1], 4, axis=0), np.repeat(EYES[:1], 4, axis=0)
    )
    assert place == pytest.approx(joints[0], abs=1e-12)
    assert told == pytest.approx(sure[0], abs=1e-12)


def test_all_answers_several_times_change_nothing():
    _, joints, sure = answers()
    once = fuse(joints, sure, EYES)
    thrice = fuse(np.tile(joints, (3, 1, 1)), np.tile(sure, (3, 1)), np.tile(EYES, (3, 1)))
    for a, b in zip(once, thrice, strict=True):
        assert a == pytest.approx(b, abs=1e-12)


def test_a_view_of_probability_0_has_no_say():
    _, joints, sure = answers()
    sure[2] = 0.0
    joints[2] += 0.03
    kept = [0, 1, 3]
    for a, b in zip(fuse(joints, sure, EYES), fuse(joints[kept], sure[kept], EYES[kept]), strict=True):
        assert a == pytest.approx(b, abs=1e-12)


def test_a_joint_that_is_not_found_has_no_say():
    _, joints, sure = answers()
    joints[1, :7] = np.nan
    sure[3, :7] = 0.0
    some, _ = fuse(joints, sure, EYES)
    assert some[:7] == pytest.approx(fuse(joints[[0, 2]], sure[[0, 2]], EYES[[0, 2]])[0][:7], abs=1e-12)
    joints[:, 4] = np.nan
    place, told = fuse(joints, sure, EYES)
    assert np.isnan(place[4]).all()
    assert told[4] == 0.0
    assert np.isfinite(np.delete(place, 4, axis=0)).all()


@pytest.mark.parametrize("order", [[3, 2, 1, 0], [1, 3, 0, 2]])
def test_the_order_of_cameras_changes_nothing(order):
    _, joints, sure = answers()
    for a, b in zip(fuse(joints, sure, EYES), fuse(joints[order], sure[order], EYES[order]), strict=True):
        assert a == pytest.approx(b, abs=1e-12)


def test_moving_the_world_moves_the_answer():
    _, joints, sure = answers()
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    shift = np.array([1.0, -2.0, 0.3])
    moved, told = fuse(joints @ turn.T + shift, sure, EYES @ turn.T + shift)
    place, sure_of = fuse(joints, sure, EYES)
    assert moved == pytest.approx(place @ turn.T + shift, abs=1e-9)
    assert told == pytest.approx(sure_of, abs=1e-9)


def test_cameras_across_each_other_correct_each_others_depth():
    eyes = np.array([[3.0, 0.0, 1.0], [0.0, 3.0, 1.0]])
    truth = np.array([[0.0, 0.0, 1.0]])
    joints = np.stack([truth - (0.08, 0.0, 0.0), truth - (0.0, 0.08, 0.0)])  # both too deep
    place, _ = fuse(joints, np.ones((2, 1)), eyes, FusionConfig(along_m=0.1))
    plain = joints.mean(axis=0)
    assert np.linalg.norm(place - truth) < 0.6 * np.linalg.norm(plain - truth)


def test_an_answer_far_off_is_left_out():
    truth, joints, sure = answers(spread=0.01)
    joints[0] += (0.0, 0.0, 1.0)
    place, _ = fuse(joints, np.full_like(sure, 0.7), EYES)
    assert np.linalg.norm(place - truth, axis=1).max() < 0.03


def test_of_two_that_contradict_each_other_the_surer_one_counts():
    eyes, joints = EYES[:2], np.array([[[0.0, 0.0, 1.0]], [[0.0, 0.0, 1.8]]])
    place, told = fuse(joints, np.array([[0.3], [0.9]]), eyes)
    assert place[0] == pytest.approx(joints[1, 0], abs=1e-3)
    assert told[0] == pytest.approx(0.9, abs=1e-3)


def test_the_fused_place_is_a_fixed_point_of_the_written_out_sum():
    _, joints, sure = answers(seed=3)
    config = FusionConfig(n_steps=300)
    place, told = fuse(joints, sure, EYES, config)
    for j in range(joints.shape[1]):
        total, pull, shares = np.zeros((3, 3)), np.zeros(3), []
        for v in range(len(EYES)):
            ray = joints[v, j] - EYES[v]
            ray /= np.linalg.norm(ray)
            covariance = config.across_m**2 * np.eye(3)
            covariance += (config.along_m**2 - config.across_m**2) * np.outer(ray, ray)
            away = np.linalg.norm(joints[v, j] - place[j])
            share = sure[v, j] * np.exp(-(away**2) / (2 * config.reach_m**2))
            total += share * np.linalg.inv(covariance)
            pull += share * np.linalg.inv(covariance) @ joints[v, j]
            shares.append(share)
        assert place[j] == pytest.approx(np.linalg.inv(total) @ pull, abs=1e-9)
        assert told[j] == pytest.approx(np.average(sure[:, j], weights=shares), abs=1e-9)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda joints, sure, eyes: (joints[0], sure, eyes), "must be"),
        (lambda joints, sure, eyes: (joints, sure[:, :3], eyes), "must be"),
        (lambda joints, sure, eyes: (joints, sure, eyes[:3]), "eyes"),
        (lambda joints, sure, eyes: (joints, sure * 2.0, eyes), "0..1"),
        (lambda joints, sure, eyes: (joints, sure * np.nan, eyes), "0..1"),
    ],
)
def test_wrong_input_is_refused(change, sentence):
    _, joints, sure = answers()
    with pytest.raises(ValueError, match=sentence):
        fuse(*change(joints, sure, EYES))


@pytest.mark.parametrize("name", ["across_m", "along_m", "reach_m", "n_steps"])
def test_settings_must_be_above_0(name):
    with pytest.raises(ValueError, match=name):
        FusionConfig(**{name: 0})
