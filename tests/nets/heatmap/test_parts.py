"""Places of joints in patches and maps: laws, and slow twins."""

import numpy as np
import pytest

from forests.frames import Intrinsics
from nets.heatmap.config import SIGMA, STRIDE, VIEW, HeatmapConfig
from nets.heatmap.decode import N_PEAKS, N_STEPS, NEAR, REACH, WIDTH, find_peaks, shares_of
from nets.heatmap.samples import from_patch, mirrored_order, to_patch
from nets.patches import Window

CAMERA = Intrinsics(365.0, 360.0, 255.5, 211.5)


def test_joints_come_back_out_of_the_patch():
    rng = np.random.default_rng(0)
    joints = rng.uniform((-1.0, -1.0, 1.5), (1.0, 1.0, 4.0), (40, 3))
    window = Window(200.3, 190.8, 2.4)
    places = to_patch(joints, CAMERA, window, VIEW)
    np.testing.assert_allclose(from_patch(places, CAMERA, window, VIEW), joints, atol=1e-9)
    straight = to_patch(
        np.array([[(200.3 - 255.5) * 2.4 / 365.0, (190.8 - 211.5) * 2.4 / 360.0, 2.4]]), CAMERA, window, VIEW
    )
    np.testing.assert_allclose(straight[0], ((VIEW.patch[0] - 1) / 2, (VIEW.patch[1] - 1) / 2, 0.0), atol=1e-9)


def test_the_other_side_of_the_other_side_is_this_side():
    names = ("head", "r_hand", "l_hand", "r_knee", "torso", "lu_leg", "lw_leg", "rw_leg", "ru_leg", "lap_desk")
    order = mirrored_order(names)
    assert order.tolist() == [0, 2, 1, 3, 4, 8, 7, 6, 5, 9]
    assert order[order].tolist() == list(range(len(names)))


def slow_peaks(share, depth):
    """As the docstring says it, for one joint."""
    left, out = share.astype(np.float64).copy(), []
    v, u = np.mgrid[: left.shape[0], : left.shape[1]]

    def around(r, c, n):
        return (abs(v - r) <= n) & (abs(u - c) <= n)

    for _ in range(N_PEAKS):
        held = np.array([[left[around(r, c, NEAR)].sum() for c in u[0]] for r in v[:, 0]])
        r, c = np.unravel_index(np.where(left > 0.0, held, 0.0).argmax(), left.shape)
        if left[r, c] <= 0.0:
            break
        at = np.array([r, c, 0.0])
        for _ in range(N_STEPS):
            bell = np.exp(-0.5 * ((v - at[0]) ** 2 + (u - at[1]) ** 2) / WIDTH**2)
            weight = left * bell * around(r, c, REACH)
            at = np.array([(weight * of).sum() for of in (v, u, depth)]) / weight.sum()
        out.append((held[r, c], *at))
        left[around(r, c, NEAR)] = 0.0
    return out


def test_peaks_are_those_of_the_slow_twin():
    rng = np.random.default_rng(1)
    share = rng.random((4, 20, 17)).astype(np.float32) ** 8
    share[3] = 0.0
    share[3, 0, 16] = 1.0
    share /= share.sum(axis=(1, 2), keepdims=True)
    depth = rng.normal(0.0, 0.3, share.shape).astype(np.float32)
    peaks = find_peaks(share, depth)
    for joint in range(4):
        slow = slow_peaks(share[joint], depth[joint])
        assert np.isfinite(peaks.place[joint]).all(axis=1).sum() == len(slow)
        for k, (heat, *place) in enumerate(slow):
            assert peaks.heat[joint, k] == pytest.approx(heat, rel=1e-4)
            np.testing.assert_allclose(peaks.place[joint, k], place, rtol=1e-3, atol=1e-4)
    assert peaks.spread[3] == pytest.approx(0.0, abs=1e-5)
    assert (np.diff(peaks.heat, axis=1) <= 0.0).all()


@pytest.mark.parametrize("kind", ["mse", "cross_entropy"])
def test_a_bell_between_cells_is_found_between_cells(kind):
    v, u = np.mgrid[:30, :24]
    bell = np.exp(-0.5 * ((v - 12.3) ** 2 + (u - 7.6) ** 2) / SIGMA**2)[None].astype(np.float32)
    heat = bell if kind == "mse" else np.log(bell + 1e-6)
    peaks = find_peaks(shares_of(heat, kind), np.full_like(bell, 0.4))
    np.testing.assert_allclose(peaks.place[0, 0], (12.3, 7.6, 0.4), atol=0.12)
    assert peaks.spread[0] == pytest.approx(SIGMA, abs=0.15)


@pytest.mark.parametrize("name", ["channels", "blocks"])
def test_three_scales_are_needed(name):
    with pytest.raises(ValueError, match=f"{name}=\\[8, 8\\] must be three numbers"):
        HeatmapConfig(**{name: (8, 8)})
    assert VIEW.height % (4 * STRIDE) == VIEW.width % (4 * STRIDE) == 0
