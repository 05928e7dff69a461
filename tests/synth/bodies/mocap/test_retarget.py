"""Poses of our own skeleton, written as a recording, come back; others come as near as the limits let them."""

import numpy as np
import pytest

from synth.bodies.mocap.ball_joint import ball_miss, ball_start, other_start
from synth.bodies.mocap.bvh import parse_bvh
from synth.bodies.mocap.retarget import Retargeted, retarget
from synth.bodies.mocap.retarget_kernels import HAND_WEIGHT, LIMB_WEIGHT
from synth.bodies.mocap.select import unlike_poses
from synth.bodies.mocap.source import Source, read_source
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, MIRRORED_DOF, MIRRORED_SIGN, UPPER
from synth.geometry import axis_angle
from tests.mocap_files import SKELETON, STAND, bvh_text, degrees, random_angles, standing_root
from tests.reference_mocap import best_directions, misses, unlike_poses_slow

N_POSES = 40
LIMBS = ("shoulder_rotation", "elbow_flexion", "wrist_deviation", "hip_rotation", "knee_flexion")
DOWN, FORWARD, LEFT = -np.eye(3)[2], np.eye(3)[0], np.eye(3)[1]


def poses(seed: int = 3) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [random_angles(rng) for _ in range(N_POSES)]


def read(all_angles: list[np.ndarray], R: np.ndarray | None = None, **kwargs: float) -> Source:
    return read_source(parse_bvh(bvh_text([(a, standing_root(a, R)) for a in all_angles], **kwargs)))


@pytest.fixture(scope="module")
def back() -> Retargeted:
    return retarget(read(poses()))


def link_axes(angles: np.ndarray) -> np.ndarray:
    return link_transforms(SKELETON, angles, np.eye(4))[:, :3, :3]


def test_limbs_of_our_own_poses_come_back(back):
    for given, found in zip(poses(), back.angles[1:], strict=True):
        before, after = link_axes(given), link_axes(found)
        for side in "lr":
            for limb in LIMBS:
                i = LINK_IDX[f"{side}_{limb}"]
                assert before[i, :, 2] @ after[i, :, 2] > np.cos(np.radians(3.0)), limb
        for link in ("thorax_rotation", "head_rotation"):
            assert np.allclose(before[LINK_IDX[link]], after[LINK_IDX[link]], atol=0.02)


def test_hinges_that_nothing_can_stand_in_for_come_back(back):
    names = [f"{side}_{name}" for side in "lr" for name in ("elbow_flexion", "knee_flexion", "clavicle_elevation")]
    index = [DOF_IDX[name] for name in names]
    off = np.array([found[index] - given[index] for given, found in zip(poses(), back.angles[1:], strict=True)])
    assert np.degrees(np.abs(off)).max() < 3.0


def test_angles_stay_within_the_limits_whatever_is_recorded():
    wild = degrees(
        knee_flexion=-40.0, elbow_flexion=-50.0, head_rotation=85.0, hip_abduction=80.0, l_ankle_flexion=70
    )
    found = retarget(read([wild, 2.0 * random_angles(np.random.default_rng(1))])).angles
    assert (found >= LOWER - 1e-12).all()
    assert (found <= UPPER + 1e-12).all()
    assert found[1, DOF_IDX["l_knee_flexion"]] < np.radians(12.0)


def test_a_person_who_faces_elsewhere_is_in_the_same_pose(back):
    turned = retarget(read(poses(), axis_angle((0, 0, 1), 2.0)))
    assert np.allclose(turned.angles, back.angles, atol=1e-4)
    assert np.allclose(turned.root, back.root, atol=1e-5)


def test_the_root_keeps_its_lean_but_not_its_heading():
    R = axis_angle((0, 0, 1), -1.2) @ axis_angle((0, 1, 0), 0.7)
    found = retarget(read([STAND], R))
    assert np.allclose(found.root[1], axis_angle((0, 1, 0), 0.7), atol=1e-5)


def test_a_mirrored_recording_gives_the_mirrored_pose(back):
    mirrored = retarget(read([a[MIRRORED_DOF] * MIRRORED_SIGN for a in poses()]))
    assert np.allclose(mirrored.angles[:, MIRRORED_DOF] * MIRRORED_SIGN, back.angles, atol=2e-3)


@pytest.mark.parametrize(
    ("unit", "scale", "found"),
    [
        (1.0, 1.0, 1.0),
        (0.01, 1.1, 0.01),
        (0.001, 0.85, 0.001),
        (0.0254 / 0.45, 1.0, 0.0254 / 0.45),
        (0.0254, 1.0, 0.0254),
    ],
)
def test_the_unit_is_found_out_and_the_pose_does_not_depend_on_it(back, unit, scale, found):
    source = read(poses(), unit=unit, scale=scale)
    assert source.unit == pytest.approx(found)
    assert np.allclose(retarget(source).angles, back.angles, atol=1e-3)


def test_an_unusual_unit_is_what_makes_the_legs_an_adults():
    assert read([STAND], unit=0.2).unit == pytest.approx(0.2, rel=0.02)


def test_the_t_pose_and_no_other_is_taken_for_one():
    assert np.flatnonzero(read(poses()).is_t_pose).tolist() == [0]


def test_the_closed_form_of_a_ball_joint_points_the_limb():
    rng = np.random.default_rng(5)
    for _ in range(200):
        limb, beyond = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
        side, bend = rng.choice([-1.0, 1.0]), rng.choice([-1.0, 1.0])
        flexion, abduction, rotation, elbow = ball_start(limb, beyond, bend, side)
        R = axis_angle(-LEFT, flexion) @ axis_angle(side * FORWARD, abduction)
        assert np.allclose(R @ DOWN, limb, atol=1e-9)
        if np.sin(elbow) > 0.3:
            R = R @ axis_angle(side * DOWN, rotation) @ axis_angle(-bend * LEFT, elbow)
            assert np.allclose(R @ DOWN, beyond, atol=1e-9)


def test_the_other_angles_of_a_ball_joint_point_the_limb_as_well():
    rng = np.random.default_rng(6)
    for _ in range(200):
        limb, beyond = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
        side, bend = rng.choice([-1.0, 1.0]), rng.choice([-1.0, 1.0])
        start = ball_start(limb, beyond, bend, side, 0.0)
        for angles in (start, other_start(start)):
            assert ball_miss(angles, limb, beyond, bend, side) < 1e-6
        turned = (start[0] + 0.3, *start[1:])
        R = axis_angle(-LEFT, 0.3)
        assert ball_miss(turned, R @ limb, R @ beyond, bend, side) < 1e-6
        assert ball_miss((*start[:3], start[3] + 0.2), limb, beyond, bend, side) == pytest.approx(0.2, abs=1e-6)


@pytest.mark.parametrize("bend", [4.0, 8.0, 14.0, 20.0, 30.0])
def test_slight_bends_of_level_arms_come_back(bend):
    angles = degrees(shoulder_abduction=90.0, elbow_flexion=bend)
    found = retarget(read([angles]))
    elbows = [DOF_IDX[f"{s}_elbow_flexion"] for s in "lr"]
    assert np.allclose(np.degrees(found.angles[1, elbows]), bend, atol=1.0)


def test_a_straight_limb_has_no_rotation_of_its_own():
    assert ball_start(FORWARD, FORWARD, 1.0, 1.0)[2] == 0.0


def test_arms_out_of_reach_come_as_near_as_a_library_optimiser_gets_them():
    source = read([np.clip(1.6 * a, -2.5, 2.5) for a in poses(8)[:8]])
    found = retarget(source)
    names = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion", "forearm_pronation")
    dofs = np.array([DOF_IDX[f"l_{n}"] for n in (*names, "wrist_flexion", "wrist_deviation")])
    rng = np.random.default_rng(2)
    ratios = []
    for f in range(1, 9):
        into = source.pelvis[f].T
        goals = [
            ("l_shoulder_rotation", DOWN, into @ source.limb[f, 0, 0], LIMB_WEIGHT),
            ("l_elbow_flexion", DOWN, into @ source.limb[f, 0, 1], LIMB_WEIGHT),
            ("l_wrist_deviation", DOWN, into @ source.fingers[f, 0], HAND_WEIGHT),
            ("l_wrist_deviation", -LEFT, into @ source.palm[f, 0], HAND_WEIGHT),
        ]
        best = best_directions(SKELETON, dofs, found.angles[f], goals, rng)
        ratios.append((float((misses(SKELETON, found.angles[f], goals) ** 2).sum()) + 1e-4) / (best + 1e-4))
    assert np.median(ratios) < 1.1
    assert max(ratios) < 3.0


def test_poses_alike_are_dropped_as_by_the_slow_twin():
    rng = np.random.default_rng(7)
    places = np.cumsum(rng.normal(0.0, 0.01, (150, 15, 3)), axis=0)
    is_open = rng.random(150) < 0.8
    for distance in (0.0, 0.03, 0.08, 10.0):
        kept = unlike_poses(places, is_open, distance)
        assert kept.tolist() == unlike_poses_slow(places, is_open, distance)
        assert is_open[kept].all()
    assert len(unlike_poses(places, np.zeros(150, np.bool_), 0.1)) == 0
    with pytest.raises(ValueError, match="distance=-1"):
        unlike_poses(places, is_open, -1.0)
