"""Legs in closed form: forward kinematics takes them back to the foot that was asked for."""

import numpy as np
import pytest

from synth.bodies.motion.legs import LEG_DOFS, LEG_HINGES, solve_legs
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import LINK_IDX, LOWER, N_DOFS, UPPER, Lengths, make_skeleton
from synth.geometry import axis_angle

SKELETON = make_skeleton(Lengths.of_stature(1.74))


def drawn_feet(side, rng, n):
    """Random leg angles off their limits, roots, and the feet that follow."""
    dofs = LEG_DOFS[side]
    low, high = LOWER[dofs] + 0.05, UPPER[dofs] - 0.05
    low[LEG_HINGES.index("knee_flexion")] = 0.15
    angles = rng.uniform(low, high, (n, 6))
    roots, feet = np.tile(np.eye(4), (n, 1, 1)), np.empty((n, 4, 4))
    for k in range(n):
        whole = np.zeros(N_DOFS)
        whole[dofs] = angles[k]
        axis = rng.standard_normal(3)
        roots[k, :3, :3] = axis_angle(axis / np.linalg.norm(axis), rng.uniform(0, 3))
        roots[k, :3, 3] = rng.uniform(-2, 2, 3)
        feet[k] = link_transforms(SKELETON, whole, roots[k])[LINK_IDX[f"{side}_ankle_inversion"]]
    return angles, roots, feet


@pytest.mark.parametrize("side", ["l", "r"])
def test_solved_legs_put_the_foot_where_it_shall_be(side):
    angles, roots, feet = drawn_feet(side, np.random.default_rng(3), 300)
    solved, missed = solve_legs(SKELETON, side, roots, feet)
    assert missed.max() < 1e-6
    for k in range(len(solved)):
        whole = np.zeros(N_DOFS)
        whole[LEG_DOFS[side]] = solved[k]
        T = link_transforms(SKELETON, whole, roots[k])[LINK_IDX[f"{side}_ankle_inversion"]]
        np.testing.assert_allclose(T, feet[k], atol=1e-6)
    assert np.abs(solved - angles).max() < 1e-5


def test_a_foot_out_of_reach_is_missed_by_what_is_missing():
    root = np.tile(np.eye(4), (1, 1, 1))
    foot = np.tile(np.eye(4), (1, 1, 1))
    foot[0, :3, 3] = SKELETON.offsets[LEG_DOFS["l"][0]] + (0.0, 0.0, -2.0)
    length = -SKELETON.offsets[LEG_DOFS["l"][[3, 4]], 2].sum()
    angles, missed = solve_legs(SKELETON, "l", root, foot)
    assert missed[0] == pytest.approx(2.0 - length, abs=1e-6)
    assert abs(angles[0, 3]) < 1e-3


def test_angles_stay_within_their_limits_unless_told_otherwise():
    root = np.tile(np.eye(4), (1, 1, 1))
    foot = np.tile(np.eye(4), (1, 1, 1))
    foot[0, :3, 3] = SKELETON.offsets[LEG_DOFS["l"][0]] + (-0.6, 0.0, -0.5)
    limited, missed = solve_legs(SKELETON, "l", root, foot)
    free, _ = solve_legs(SKELETON, "l", root, foot, is_limited=False)
    assert missed[0] > 0.01
    assert (limited >= LOWER[LEG_DOFS["l"]]).all()
    assert (free < LOWER[LEG_DOFS["l"]]).any()
