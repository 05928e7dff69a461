import numpy as np
import pytest

from synth.bodies.body import Pose
from synth.bodies.rig.kinematics import joint_positions, link_transforms, mirror_pose
from synth.bodies.skeleton import DOF_IDX, LOWER, N_DOFS, UPPER, Lengths, make_skeleton
from synth.geometry import rotation_about, translation
from synth.vocabulary import JOINT_NAMES, MIRRORED_JOINT
from tests.reference_bodies import link_transforms_slow

SKELETON = make_skeleton(Lengths.of_stature(1.75))


def random_pose(seed: int) -> Pose:
    rng = np.random.default_rng(seed)
    root = translation(*rng.normal(size=3)) @ rotation_about((0, 0, 1), rng.uniform(-3, 3))
    return Pose(rng.uniform(LOWER, UPPER), root @ rotation_about((0, 1, 0), rng.uniform(-1, 1)))


@pytest.mark.parametrize("seed", range(10))
def test_links_are_where_the_slow_twin_puts_them(seed):
    pose = random_pose(seed)
    slow = link_transforms_slow(SKELETON, pose.angles, pose.T_world_root)
    np.testing.assert_allclose(link_transforms(SKELETON, pose.angles, pose.T_world_root), slow, atol=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_a_mirrored_pose_mirrors_the_joints(seed):
    pose = random_pose(seed)
    mirrored = joint_positions(SKELETON, mirror_pose(pose))[list(MIRRORED_JOINT)]
    np.testing.assert_allclose(mirrored * (1, -1, 1), joint_positions(SKELETON, pose), atol=1e-12)


def test_mirroring_twice_changes_nothing():
    pose = random_pose(3)
    again = mirror_pose(mirror_pose(pose))
    np.testing.assert_array_equal(again.angles, pose.angles)
    np.testing.assert_array_equal(again.T_world_root, pose.T_world_root)


def moved_joint(dof: str, angle: float, joint: str) -> np.ndarray:
    angles = np.zeros(N_DOFS)
    start = joint_positions(SKELETON, Pose(angles, np.eye(4)))
    angles = angles.copy()
    angles[DOF_IDX[dof]] = angle
    return (joint_positions(SKELETON, Pose(angles, np.eye(4))) - start)[JOINT_NAMES.index(joint)]


@pytest.mark.parametrize(
    ("dof", "joint", "direction"),
    [
        ("lumbar_flexion", "neck", (1, 0, 0)),
        ("l_shoulder_flexion", "l_hand", (1, 0, 0)),
        ("r_shoulder_abduction", "r_hand", (0, -1, 0)),
        ("l_elbow_flexion", "l_hand", (1, 0, 0)),
        ("r_hip_flexion", "r_knee", (1, 0, 0)),
        ("l_knee_flexion", "l_foot", (-1, 0, 0)),
        ("l_ankle_flexion", "l_foot", (0, 0, 1)),
        ("thorax_rotation", "l_shoulder", (-1, 0, 0)),
        ("thorax_lateral", "neck", (0, -1, 0)),
    ],
)
def test_a_positive_angle_bends_the_way_its_name_says(dof, joint, direction):
    assert moved_joint(dof, 0.5, joint) @ direction > 0.02


def test_wrong_shapes_are_refused_with_both_shapes():
    with pytest.raises(ValueError, match=r"angles have shape \(3,\), must be \(49,\)"):
        link_transforms(SKELETON, np.zeros(3), np.eye(4))
