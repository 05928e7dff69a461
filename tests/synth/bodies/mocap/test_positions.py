"""Recordings without a T-pose: limbs point from joint to joint, and what is up is told by the motion."""

from dataclasses import replace

import numpy as np
import pytest

from synth.bodies.mocap.bvh import Bvh, MocapError, parse_bvh
from synth.bodies.mocap.ground import find_support
from synth.bodies.mocap.retarget import retarget
from synth.bodies.mocap.source import Source, read_source, read_source_from_positions
from synth.bodies.skeleton import DOF_IDX
from synth.geometry import axis_angle
from tests.mocap_files import STAND, T_POSE, bvh_text, degrees, random_angles, standing_root, with_axes_anywhere

pytestmark = pytest.mark.filterwarnings("ignore:Gimbal lock")
A_POSE = degrees(shoulder_abduction=45.0)
N_POSES = 30
TO_FORWARD = axis_angle((0.0, 1.0, 0.0), 0.5 * np.pi)
"""Turns up to forward, and who stands onto the face."""


def motion(rest: np.ndarray = T_POSE) -> Bvh:
    """Lively poses between upright ones, in several headings, with hands of 8 cm."""
    rng = np.random.default_rng(3)
    frames = []
    for k in range(N_POSES):
        angles = STAND + (degrees(l_hip_flexion=4.0) if k % 2 else random_angles(rng))
        frames.append((angles, standing_root(angles, axis_angle((0.0, 0.0, 1.0), 0.7 * k))))
    bvh = parse_bvh(bvh_text(frames, rest=rest))
    hands = {"LeftHand_end": (8.0, 0.0, 0.0), "RightHand_end": (-8.0, 0.0, 0.0)}
    return replace(bvh, joints=tuple(replace(j, offset=hands.get(j.name, j.offset)) for j in bvh.joints))


def without_first(bvh: Bvh) -> Bvh:
    return replace(bvh, values=bvh.values[1:], frame=bvh.frame[1:])


@pytest.fixture(scope="module")
def truth() -> Source:
    return read_source(without_first(motion()))


@pytest.fixture(scope="module")
def tangled() -> Source:
    return read_source(with_axes_anywhere(without_first(motion()), np.random.default_rng(1)))


def angles_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1.0, 1.0)))


def in_pelvis(source: Source, directions: np.ndarray) -> np.ndarray:
    return np.einsum("nba,n...b->n...a", source.pelvis, directions)


def test_joints_whose_axes_point_anywhere_give_the_same_limbs(truth, tangled):
    assert truth.has_rest
    assert not tangled.has_rest
    assert tangled.unit == truth.unit
    for name in ("limb", "fingers"):
        ours, theirs = (getattr(source, name).reshape(N_POSES, -1, 3) for source in (tangled, truth))
        assert np.allclose(ours[:, :, 2], theirs[:, :, 2], atol=1e-3), name  # whatever the heading of the world
        grams = [v @ np.swapaxes(v, 1, 2) for v in (ours, theirs)]
        assert np.allclose(*grams, atol=1e-3), name


def test_feet_trunk_and_head_come_nearly_back_from_lines_between_joints(truth, tangled):
    for name, limit in (("toes", 6.0), ("sole", 6.0)):
        ours, theirs = getattr(tangled, name), getattr(truth, name)
        assert np.abs(np.degrees(np.arcsin(ours[..., 2]) - np.arcsin(theirs[..., 2]))).max() < limit, name
    for name, limit in (("pelvis", 8.0), ("thorax", 10.0), ("head", 20.0)):
        tilts = [getattr(source, name)[:, :, 2][:, 2] for source in (tangled, truth)]
        assert np.median(np.abs(np.degrees(np.arccos(tilts[0]) - np.arccos(tilts[1])))) < limit, name


def test_the_body_takes_nearly_the_same_pose(truth, tangled):
    ours, theirs = retarget(tangled).angles, retarget(truth).angles
    bends = [DOF_IDX[f"{s}_{name}"] for s in "lr" for name in ("elbow_flexion", "knee_flexion")]
    assert np.degrees(np.abs(ours - theirs)[:, bends]).max() < 4.0
    support, true_support = (find_support(source, 1.0 / 30.0) for source in (tangled, truth))
    assert (support.is_standing == true_support.is_standing).mean() > 0.9


def test_palms_are_not_known_and_forearms_stay_untwisted(tangled):
    assert not tangled.palm.any()
    pronation = [DOF_IDX[f"{s}_forearm_pronation"] for s in "lr"]
    assert np.degrees(np.abs(retarget(tangled).angles[:, pronation])).max() < 15.0


def test_an_a_pose_without_turns_gives_trunk_and_head_by_their_turns(truth):
    made = read_source(without_first(motion(A_POSE)))
    assert not made.has_rest
    for name in ("thorax", "head"):
        ours, theirs = (np.swapaxes(s.pelvis, 1, 2) @ getattr(s, name) for s in (made, truth))
        assert np.allclose(ours, theirs, atol=1e-3), name
    assert angles_between(in_pelvis(made, made.limb), in_pelvis(truth, truth.limb)).max() < 0.2


def test_hands_without_fingers_go_on_along_the_forearms():
    bvh = without_first(motion(A_POSE))
    bvh = replace(
        bvh, joints=tuple(replace(j, offset=(0.0, 0.0, 1.0)) if "Hand_" in j.name else j for j in bvh.joints)
    )
    made = read_source(bvh)
    assert np.allclose(made.fingers, made.limb[:, :, 1])


@pytest.mark.parametrize(("rest", "has_rest"), [(T_POSE, True), (A_POSE, False)])
def test_who_lies_in_the_first_frame_is_not_taken_for_upright(truth, rest, has_rest):
    lying = parse_bvh(bvh_text([(T_POSE, standing_root(T_POSE, TO_FORWARD))], rest=rest)).values[1:]
    bvh = motion(rest)
    made = read_source(replace(bvh, values=np.concatenate([lying, bvh.values[1:]])))
    assert made.has_rest == has_rest
    assert not made.is_t_pose[0]
    assert np.allclose(made.limb[1:, :, :, 2], truth.limb[:, :, :, 2], atol=2e-3)


def test_who_only_lies_lies_though_the_first_frame_is_a_t_pose():
    frames = [(angles, standing_root(angles, TO_FORWARD)) for angles in (T_POSE, STAND, STAND)]
    made = read_source(without_first(parse_bvh(bvh_text(frames))))
    assert made.has_rest
    assert not made.is_t_pose.any()
    assert np.abs(made.pelvis[:, 2, 2]).max() < 1e-3


def test_a_motion_with_another_axis_up_than_the_pose_without_turns():
    frames = []
    for k in range(20):
        angles = STAND + degrees(l_hip_flexion=float(k), r_elbow_flexion=2.0 * k)
        T = standing_root(angles)
        T[1, 3] = 0.1 * k
        turned = np.eye(4)
        turned[:3, :3] = TO_FORWARD
        frames.append((T, turned @ T, angles))
    ours = read_source(without_first(parse_bvh(bvh_text([(angles, T) for _, T, angles in frames]))))
    theirs = read_source(without_first(parse_bvh(bvh_text([(angles, T) for T, _, angles in frames]))))
    assert ours.has_rest
    assert np.allclose(in_pelvis(ours, ours.limb), in_pelvis(theirs, theirs.limb), atol=1e-4)
    assert np.allclose(ours.pelvis[:, 2, 2], 1.0, atol=1e-4)
    assert np.allclose(retarget(ours).angles, retarget(theirs).angles, atol=1e-3)


def test_a_recording_that_shows_nobody_upright_is_refused():
    turns = [axis_angle((0.0, 1.0, 0.0), sign * 0.5 * np.pi) for sign in (1.0, -1.0)]
    bvh = parse_bvh(bvh_text([(STAND, standing_root(STAND, R)) for R in turns], rest=A_POSE))
    with pytest.raises(MocapError, match="no T-pose, and too few frames with an upright person"):
        read_source(without_first(bvh))


def test_joints_that_coincide_are_refused():
    bvh = motion(A_POSE)
    bvh = replace(
        bvh, joints=tuple(replace(j, offset=(0.0, 0.0, 0.0)) if j.name == "LeftHand" else j for j in bvh.joints)
    )
    with pytest.raises(MocapError, match="joints that coincide"):
        read_source_from_positions(bvh)
