"""A bent pose is no T-pose, whichever limb is bent; limbs point along the file's joints all the same."""

from dataclasses import replace

import numpy as np
import pytest

from synth.bodies.mocap.bvh import Bvh, parse_bvh
from synth.bodies.mocap.reach import limb_errors
from synth.bodies.mocap.retarget import retarget
from synth.bodies.mocap.source import Source, read_source, read_source_from_positions
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import LINK_IDX, LOWER, UPPER
from synth.geometry import axis_angle
from tests.mocap_files import SKELETON, STAND, T_POSE, bvh_text, degrees, standing_root

LIMBS = ("shoulder_rotation", "elbow_flexion", "hip_rotation", "knee_flexion")
A_POSE = degrees(shoulder_abduction=50.0)
BENT = {
    "both elbows": degrees(elbow_flexion=38.0), "left elbow": degrees(l_elbow_flexion=20.0),
    "right elbow": degrees(r_elbow_flexion=14.0), "left knee": degrees(l_hip_flexion=10.0, l_knee_flexion=20.0),
    "right knee": degrees(r_hip_flexion=6.0, r_knee_flexion=14.0),
    "elbows and knees": degrees(elbow_flexion=38.0, hip_flexion=12.0, knee_flexion=26.0),
    "arms forward": degrees(shoulder_flexion=30.0, shoulder_abduction=-30.0),
    "one arm down": degrees(l_shoulder_abduction=-45.0), "one leg apart": degrees(r_hip_abduction=25.0),
    "a bow": degrees(lumbar_flexion=30.0, thorax_flexion=20.0),
}  # fmt: skip


def motion(first: np.ndarray, rest: np.ndarray) -> tuple[Bvh, list[np.ndarray]]:
    """A recording that begins with a pose, and the angles of all its frames."""
    steps = [STAND + degrees(shoulder_abduction=15.0 * k, l_elbow_flexion=10.0 * k) for k in range(5)]
    angles = [first, *steps, T_POSE + degrees(l_shoulder_abduction=-60.0)]
    bvh = parse_bvh(bvh_text([(a, standing_root(a)) for a in angles], rest=rest))
    return replace(bvh, values=bvh.values[1:], frame=bvh.frame[1:]), angles


def off_truth(source: Source, angles: list[np.ndarray]) -> np.ndarray:
    """(n, 8) angles between retargeted limbs and those of the poses that were recorded [degrees]."""
    links = [LINK_IDX[f"{s}_{limb}"] for s in "lr" for limb in LIMBS]
    found = retarget(source)
    out = []
    for own, given in zip(found.angles, angles, strict=True):
        a, b = (link_transforms(SKELETON, x, np.eye(4))[links, :3, 2] for x in (own, np.clip(given, LOWER, UPPER)))
        out.append(np.degrees(np.arccos(np.clip((a * b).sum(axis=1), -1.0, 1.0))))
    return np.array(out)


@pytest.mark.parametrize("name", BENT)
@pytest.mark.parametrize("rest", [T_POSE, A_POSE])
def test_a_bent_first_frame_is_a_pose_like_any_other(name, rest):
    bvh, angles = motion(T_POSE + BENT[name], rest)
    source = read_source(bvh)
    assert not source.is_t_pose.any()
    assert source.has_rest == (rest is T_POSE)
    assert off_truth(source, angles).max() < (3.0 if source.has_rest else 10.0)
    assert np.percentile(off_truth(source, angles), 90) < 3.0


@pytest.mark.parametrize("bend", [0.0, 4.0, 8.0])
def test_a_first_frame_bent_by_a_hair_is_a_t_pose_and_its_bend_is_seen(bend):
    bvh, angles = motion(T_POSE + degrees(elbow_flexion=bend), A_POSE)
    source = read_source(bvh)
    assert source.has_rest
    assert source.is_t_pose.tolist() == [True] + [False] * 6
    assert off_truth(source, angles)[1:].max() < 3.0


def test_an_exact_pose_without_turns_goes_before_a_first_frame_that_is_nearly_one():
    first = T_POSE + degrees(shoulder_abduction=-12.0, elbow_flexion=7.0, head_rotation=20.0)
    source = read_source(motion(first, T_POSE)[0])
    assert source.has_rest
    facing = np.degrees(np.arccos(np.clip(source.head[0, 0, 0], -1.0, 1.0)))
    assert facing == pytest.approx(20.0, abs=0.5)


def daz_named(text: str) -> str:
    names = {
        "Hips": "hip", "Spine1": "chest", "Spine": "abdomen", "Neck1": "neck", "Head": "head", "Shoulder": "Collar",
        "ForeArm": "ForeArm", "Arm": "Shldr", "Hand": "Hand", "UpLeg": "Thigh", "Leg": "Shin", "Foot": "Foot",
        "ToeBase": "Foot_end",
    }  # fmt: skip
    for word, side in (("Left", "l"), ("Right", "r")):
        for old, new in names.items():
            text = text.replace(f" {word}{old}\n", f" {side}{new}\n")
    for old, new in names.items():
        text = text.replace(f" {old}\n", f" {new}\n")
    return text


def test_arms_drawn_straight_in_the_daz_naming_are_as_drawn_and_arms_drawn_bent_turn_as_straight_ones():
    angles = [STAND, STAND + degrees(l_elbow_flexion=40.0)]
    frames = [(a, standing_root(a)) for a in angles]
    straight = read_source(parse_bvh(daz_named(bvh_text(frames))))
    assert off_truth(straight, [T_POSE, *angles]).max() < 1.0
    drawn = T_POSE + degrees(elbow_flexion=17.2)
    bent = read_source(
        parse_bvh(daz_named(bvh_text([(drawn + degrees(l_knee_flexion=30.0), np.eye(4))], rest=drawn)))
    )
    assert bent.is_t_pose.tolist() == [True, False]
    level = np.array([0.0, np.cos(np.radians(8.0)), -np.sin(np.radians(8.0))])
    assert np.allclose(bent.limb[0, 0, :2], level)


def with_toes_below(bvh: Bvh, end: tuple[float, float, float]) -> Bvh:
    """The toes' joints straight below the ankles, their end sites at an offset from there."""
    offsets = {f"{side}ToeBase": (0.0, -6.0, 0.0) for side in ("Left", "Right")}
    offsets |= {f"{side}ToeBase_end": end for side in ("Left", "Right")}
    return replace(bvh, joints=tuple(replace(j, offset=offsets.get(j.name, j.offset)) for j in bvh.joints))


@pytest.mark.parametrize("end", [(0.0, 0.0, 18.0), (0.0, -1.0, 10.0), (0.0, 0.0, 0.0), (0.0, -2.0, 0.0)])
@pytest.mark.parametrize("reads", [read_source, read_source_from_positions])
def test_feet_whose_toe_joints_are_straight_below_the_ankles_point_where_their_ends_do(end, reads):
    angles = [STAND + degrees(l_hip_rotation=3.0 * k, r_knee_flexion=8.0 * k) for k in range(9)]
    text = bvh_text([(a, standing_root(a, axis_angle((0.0, 0.0, 1.0), 0.2 * k))) for k, a in enumerate(angles)])
    truth = read_source(parse_bvh(text))
    toes = reads(with_toes_below(parse_bvh(text), end)).toes
    off = np.degrees(
        np.arcsin(np.clip(toes[..., 2], -1.0, 1.0)) - np.arcsin(np.clip(truth.toes[..., 2], -1.0, 1.0))
    )
    assert np.abs(off).max() < 6.0


def test_what_retargeting_cannot_reach_is_measured():
    fine = STAND + degrees(l_elbow_flexion=60.0)
    wrong = STAND + degrees(l_shoulder_abduction=50.0, l_knee_flexion=-45.0)
    source = read_source(parse_bvh(bvh_text([(a, standing_root(a)) for a in (fine, wrong)])))
    errors = np.degrees(limb_errors(source, retarget(source)))
    assert errors.shape == (3, 2, 4)
    assert errors[1].max() < 2.0
    assert errors[2, 0].max() > 20.0
    assert errors[2, 1].max() < 2.0
