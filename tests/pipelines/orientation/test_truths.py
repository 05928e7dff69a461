"""Which way people truly face, by hand and by rotations of an independent library."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nets.orientation.config import POSTURES
from pipelines.orientation.truths import head_angles, head_rotations, headings, postures, read_orientations
from synth.bodies.skeleton import DOF_IDX, N_DOFS
from synth.geometry import look_at
from synth.vocabulary import JOINT_NAMES


def root(yaw, place=(0.0, 0.0, 0.9), pitch=0.0):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("ZYX", [yaw, pitch, 0.0]).as_matrix()
    T[:3, 3] = place
    return T


@pytest.mark.parametrize("camera", [(3.0, 0.0, 1.0), (0.0, -2.0, 2.5), (-2.0, 2.0, 0.3)])
def test_who_turns_left_turns_towards_the_images_right(camera):
    """As in a photograph: who faces the camera has the left hand at the image's right."""
    T_world_camera = look_at(camera, (0.0, 0.0, 0.9))
    towards = np.arctan2(camera[1], camera[0])
    for turn in np.linspace(-3.0, 3.0, 13):
        T = root(towards + turn)
        heading = headings(T[None], T_world_camera[None])[0]
        np.testing.assert_allclose(heading, turn, atol=1e-9)
        ahead = T_world_camera[:3, :3].T @ T[:3, 0]
        assert np.sign(round(np.sin(turn), 6)) == np.sign(round(ahead[0], 6))


def test_who_lies_has_no_heading():
    camera = look_at((3.0, 0.0, 1.0), (0.0, 0.0, 0.5))
    assert np.isnan(headings(root(0.0, pitch=-1.5)[None], camera[None])[0])


@pytest.mark.parametrize("head", [(0.0, 0.0, 2.0), (0.8, -0.4, 1.5), (-0.5, 0.9, 3.0)])
def test_the_angles_of_a_head_rebuild_its_rotation(head):
    rng = np.random.default_rng(2)
    ray = np.array(head) / np.linalg.norm(head)
    for pan, tilt, roll in rng.uniform(-1.3, 1.3, (8, 3)):
        towards = -ray
        right = np.cross(towards, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        frame = np.stack([towards, right, np.cross(towards, right)], axis=1)
        R = frame @ Rotation.from_euler("ZYX", [pan, -tilt, roll]).as_matrix()
        given = head_angles(R[None], np.array([head]))[0]
        np.testing.assert_allclose(given, (pan, tilt, roll), atol=1e-9)


def test_a_head_that_looks_into_the_camera_has_no_angles():
    """Camera axes: the head's forward axis is -z, its left x, its up -y."""
    R = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    np.testing.assert_allclose(head_angles(R[None], np.array([[0.0, 0.0, 2.0]]))[0], 0.0, atol=1e-12)
    up = R @ Rotation.from_euler("Y", -0.3).as_matrix()  # nose up
    assert up[1, 0] < 0.0, "the image's y points down"
    np.testing.assert_allclose(head_angles(up[None], np.array([[0.0, 0.0, 2.0]]))[0], (0.0, 0.3, 0.0), atol=1e-12)


def test_heads_turn_with_the_hinges_of_trunk_and_neck():
    angles = np.zeros((2, N_DOFS))
    angles[1, DOF_IDX["head_rotation"]], angles[1, DOF_IDX["thorax_rotation"]] = 0.3, 0.2
    R = head_rotations(angles, np.stack([root(0.5), root(0.5)]))
    np.testing.assert_allclose(R[0], root(0.5)[:3, :3], atol=1e-12)
    np.testing.assert_allclose(R[1], root(1.0)[:3, :3], atol=1e-12)


def person(hips=0.9, neck=(0.0, 0.0, 1.5), knee=(0.0, 0.0, 0.45)):
    joints = np.zeros((15, 3))
    at = {name: k for k, name in enumerate(JOINT_NAMES)}
    joints[at["neck"]] = neck
    for side, y in (("r", -0.1), ("l", 0.1)):
        joints[at[f"{side}_hip"]] = (0.0, y, hips)
        joints[at[f"{side}_knee"]] = (knee[0], y, knee[2])
        joints[at[f"{side}_foot"]] = (0.0, y, 0.0)
    return joints


def test_postures_follow_from_trunk_legs_and_seat():
    upright, bent = person(), person(neck=(0.6, 0.0, 1.0))
    squatting = person(hips=0.4, neck=(0.1, 0.0, 0.9), knee=(0.4, 0.0, 0.4))
    joints = np.stack([upright, bent, squatting, squatting, upright])
    codes = postures(joints, np.array([0, 0, 0, 1, -1]))
    assert [POSTURES[code] for code in codes[:4]] == ["standing", "bent", "squatting", "sitting"]
    assert codes[4] == -1


def test_a_corpus_of_another_skeleton_tells_headings_alone(toy_corpus):
    truths = read_orientations(toy_corpus, toy_corpus.indices[:20])
    assert np.isfinite(truths.heading).all()
    assert np.isnan(truths.head).all()
    assert (truths.posture == -1).all()
