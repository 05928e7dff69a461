import numpy as np
import pytest

from synth.bodies.rig.ik import CHAINS, Goal, solve_limb
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import LINK_IDX, LOWER, N_DOFS, UPPER, Lengths, make_skeleton

SKELETON = make_skeleton(Lengths.of_stature(1.75))
REST = np.clip(np.full(N_DOFS, 0.2), LOWER, UPPER)
POINT = np.array([0.01, 0.02, -0.05])


def reachable(limb: str, seed: int) -> tuple[np.ndarray, int]:
    """Link transforms of a random pose of the limb, well inside its limits."""
    rng = np.random.default_rng(seed)
    dof = CHAINS[limb].dof
    angles = REST.copy()
    angles[dof] = rng.uniform(0.8 * LOWER[dof], 0.8 * UPPER[dof])
    link = LINK_IDX[f"{limb[0]}_wrist_deviation" if limb.endswith("arm") else f"{limb[0]}_ankle_inversion"]
    return link_transforms(SKELETON, angles, np.eye(4)), link


def last_name(limb: str) -> str:
    return "wrist_deviation" if limb.endswith("arm") else "ankle_inversion"


@pytest.mark.parametrize("limb", CHAINS)
def test_a_reachable_point_is_reached_within_limits(limb):
    start = link_transforms(SKELETON, REST, np.eye(4))
    for seed in range(50):
        T, link = reachable(limb, seed)
        target = T[link, :3, :3] @ POINT + T[link, :3, 3]
        solution = solve_limb(SKELETON, limb, start, REST, [Goal(last_name(limb), POINT, target)], 0.003)
        assert solution.point_error < 5e-3
        reached = link_transforms(SKELETON, solution.angles, np.eye(4))[link]
        np.testing.assert_allclose(reached[:3, :3] @ POINT + reached[:3, 3], target, atol=5e-3)
        assert np.all(solution.angles >= LOWER)
        assert np.all(solution.angles <= UPPER)
        others = np.setdiff1d(np.arange(N_DOFS), CHAINS[limb].dof)
        np.testing.assert_array_equal(solution.angles[others], REST[others])


def test_most_reachable_hand_frames_are_reached_with_their_directions():
    start = link_transforms(SKELETON, REST, np.eye(4))
    solved = 0
    for seed in range(100):
        T, link = reachable("l_arm", seed)
        goals = [
            Goal("wrist_deviation", POINT, T[link, :3, :3] @ POINT + T[link, :3, 3]),
            Goal("wrist_deviation", (0, -1, 0), -T[link, :3, 1], 0.1, is_point=False),
            Goal("wrist_deviation", (0, 0, -1), -T[link, :3, 2], 0.1, is_point=False),
        ]
        solution = solve_limb(SKELETON, "l_arm", start, REST, goals, 0.002)
        solved += solution.point_error < 0.01 and solution.axis_error < 0.15
    assert solved >= 85


def test_mirrored_goals_give_mirrored_angles():
    target = np.array([0.35, 0.2, 0.3])
    flip = np.array([1, -1, 1])
    upright = link_transforms(SKELETON, np.zeros(N_DOFS), np.eye(4))
    left = solve_limb(SKELETON, "l_arm", upright, REST, [Goal("wrist_deviation", POINT, target)])
    right = solve_limb(SKELETON, "r_arm", upright, REST, [Goal("wrist_deviation", POINT * flip, target * flip)])
    np.testing.assert_allclose(left.angles[CHAINS["l_arm"].dof], right.angles[CHAINS["r_arm"].dof], atol=1e-6)


def test_an_unreachable_point_is_reported_by_its_error():
    start = link_transforms(SKELETON, REST, np.eye(4))
    solution = solve_limb(SKELETON, "r_arm", start, REST, [Goal("wrist_deviation", POINT, (3, 0, 0))])
    assert solution.point_error > 1.5


def test_unknown_limbs_and_links_are_named_with_the_known_ones():
    with pytest.raises(ValueError, match="'tail' is unknown; known are l_arm"):
        solve_limb(SKELETON, "tail", np.zeros((50, 4, 4)), REST, [Goal("elbow_flexion", POINT, POINT)])
    with pytest.raises(ValueError, match="'knee_flexion' is not on l_arm; known are clavicle_elevation"):
        solve_limb(SKELETON, "l_arm", np.zeros((50, 4, 4)), REST, [Goal("knee_flexion", POINT, POINT)])
