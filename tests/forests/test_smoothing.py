"""Joints that are not found while a body moves on."""

import numpy as np
import pytest

from forests.smoothing import SkeletonSmoother, SmoothingConfig

STEP = 1 / 30


def walked(config=None, n=90, hidden=15, swing=0.0):
    """Four joints that go along x with 0.9 m/s, the last also along y; (truth, smoothed) of the hidden steps."""
    smoother = SkeletonSmoother(config or SmoothingConfig())
    speed = np.array([[0.9, 0.0, 0.0]] * 3 + [[0.9, swing, 0.0]])
    truth, smooth = [], []
    for step in range(n + hidden):
        joints = speed * step * STEP + np.arange(4)[:, None]
        seen = joints if step < n else np.full_like(joints, np.nan)
        smooth.append(smoother.update(seen, np.ones(4), STEP))
        truth.append(joints)
    return np.array(truth)[n:], np.array(smooth)[n:]


def test_a_hidden_body_goes_on_as_it_moved():
    truth, smooth = walked()
    assert smooth == pytest.approx(truth, abs=2e-3)


@pytest.mark.parametrize("fading_s", [0.05, 0.1, 0.4])
def test_a_hidden_limb_comes_to_move_as_the_body(fading_s):
    truth, smooth = walked(SmoothingConfig(fading_s=fading_s), hidden=60, swing=1.2)
    body_y = smooth[:, :3, 1].mean(axis=1) - smooth[0, :3, 1].mean()
    off = smooth[:, 3, 1] - smooth[0, 3, 1] - body_y
    # What the limb's speed differs by from that of the whole body falls by exp(-t / fading_s): the sum of the steps.
    kept = np.exp(-STEP / fading_s)
    expected = 1.2 * STEP * kept * np.cumsum(np.r_[0.0, kept ** np.arange(59)])
    assert off == pytest.approx(expected, abs=4e-3)
    assert smooth[:, 3, 0] == pytest.approx(truth[:, 3, 0], abs=5e-3)


def test_joints_that_are_found_are_smoothed_as_ever():
    rng = np.random.default_rng(3)
    places = np.cumsum(rng.normal(0.0, 0.02, (40, 5, 3)), axis=0)
    smoothers = [SkeletonSmoother(SmoothingConfig(fading_s=fading_s)) for fading_s in (0.05, 1e6)]
    for joints in places:
        first, second = (smoother.update(joints, np.full(5, 0.8), STEP) for smoother in smoothers)
        assert first.tobytes() == second.tobytes()


def test_a_body_that_comes_back_is_found_at_once():
    smoother = SkeletonSmoother()
    for step in range(60):
        joints = np.full((4, 3), 0.9 * step * STEP)
        smoother.update(joints if step % 30 < 15 else np.full((4, 3), np.nan), np.ones(4), STEP)
    assert smoother.update(np.full((4, 3), 1.8), np.ones(4), STEP) == pytest.approx(np.full((4, 3), 1.8), abs=0.02)


def test_fading_must_be_above_0():
    with pytest.raises(ValueError, match="fading_s"):
        SmoothingConfig(fading_s=0.0)
