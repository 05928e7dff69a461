from functools import cache

import numpy as np
import pytest
import trimesh

from synth.bodies.body import Body, Pose
from synth.bodies.poses.draw import draw_arms, draw_base
from synth.bodies.poses.families import FAMILIES
from synth.bodies.poses.hands import HandTarget, HandTargets
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.poses.sit import seat_contact, seat_depth_of, seat_height_of
from synth.bodies.rig.collision import self_collides, worst_collision
from synth.bodies.rig.kinematics import joint_positions, link_transforms
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, N_DOFS, UPPER
from synth.bodies.spec import BodySpec
from synth.vocabulary import JOINT_NAMES

SPECS = (
    BodySpec(1.76, 72.0, 1.0, 35.0),
    BodySpec(1.62, 84.0, 0.0, 50.0),
    BodySpec(1.20, 23.0, 0.4, 7.0),
    BodySpec(1.70, 58.0, 0.0, 24.0),
)
STANDING = [name for name, family in FAMILIES.items() if family.posture == "standing"]
SITTING = [name for name, family in FAMILIES.items() if family.posture == "sitting"]
FREE = [name for name, family in FAMILIES.items() if family.context == "none"]
TABLE = [name for name, family in FAMILIES.items() if family.context == "table"]
ON_ONE_FOOT = ("walking", "exercising", "recorded_standing")
"""Families that may lift a foot."""
N_DRAWS = 24


@cache
def body(k: int) -> Body:
    return make_body(SPECS[k % len(SPECS)])


def targets_for(family: str, person: Body, base: Pose) -> HandTargets | None:
    """A table, laptop or handle where a scene would put it."""
    context, stature = FAMILIES[family].context, person.spec.stature
    skin = pose_vertices(person, base)
    if context == "none":
        return None
    if context == "stroller":
        bar = (0.25 * stature, 0.57 * stature)
        return HandTargets(
            left=HandTarget((bar[0], 0.18, bar[1]), "handle"), right=HandTarget((bar[0], -0.18, bar[1]), "handle")
        )
    marks = landmarks_of(person)
    arms = np.concatenate([np.r_[marks.side[s].hand, marks.side[s].forearm] for s in "lr"])
    trunk = np.delete(skin, arms, axis=0)
    if context == "laptop_lap":
        lap = trunk[(trunk[:, 0] > 0.4 * marks.thigh) & (trunk[:, 2] < base.T_world_root[2, 3] + 0.2)]
        height, x = float(lap[:, 2].max()) + 0.02, 0.75 * marks.thigh
    else:
        height = float(base.T_world_root[2, 3]) + 0.115 * stature
        near = trunk[(np.abs(trunk[:, 2] - height) < 0.05) & (np.abs(trunk[:, 1]) < 0.15)]
        x = float(near[:, 0].max()) + 0.04
    keys = [
        HandTarget((x + (0.17 if context == "laptop_table" else 0.05), y, height), "keyboard")
        for y in (0.07, -0.07)
    ]
    is_table = context == "table"
    return HandTargets(height, (x, x + 0.7, -0.6, 0.6), *((None, None) if is_table else keys))


@cache
def draws(family: str) -> list[tuple[Body, Pose, Pose | None, HandTargets | None]]:
    out = []
    for k in range(N_DRAWS):
        rng = np.random.default_rng([k, 7])
        person = body(k)
        base = draw_base(family, person, rng)
        targets = targets_for(family, person, base)
        out.append((person, base, draw_arms(family, person, base, rng, targets), targets))
    return out


def finished(family: str) -> list[tuple[Body, Pose, HandTargets | None]]:
    return [(person, pose, targets) for person, _, pose, targets in draws(family) if pose is not None]


@pytest.mark.parametrize("family", FAMILIES)
def test_draws_stay_within_the_joint_limits_and_do_not_collide(family):
    assert len(finished(family)) >= 0.8 * N_DRAWS
    for person, base, pose, _ in draws(family):
        for one in (base, pose or base):
            assert one.family == family
            assert np.all(one.angles >= LOWER - 1e-12)
            assert np.all(one.angles <= UPPER + 1e-12)
            np.testing.assert_allclose(one.T_world_root[:3, :3] @ one.T_world_root[:3, :3].T, np.eye(3), atol=1e-9)
            np.testing.assert_array_equal(one.T_world_root[:2, 3], 0.0)
        if pose is not None:
            assert not self_collides(person, pose), worst_collision(person, pose)


@pytest.mark.parametrize("family", STANDING)
def test_standing_feet_touch_the_ground(family):
    for person, base, _, _ in draws(family):
        skin = pose_vertices(person, base)
        assert skin[:, 2].min() == pytest.approx(0.0, abs=1e-3)
        lows = [skin[landmarks_of(person).side[side].foot, 2].min() for side in "lr"]
        assert min(lows) == pytest.approx(0.0, abs=1e-3)
        if FAMILIES[family].context == "none" and family not in ON_ONE_FOOT:
            assert max(lows) < 0.01


@pytest.mark.parametrize("family", SITTING)
@pytest.mark.parametrize("lift", [0.0, 0.04])
def test_the_seated_rest_on_the_seat(family, lift):
    for k in range(4):
        person = body(k)
        height = seat_height_of(person) + lift
        pose = draw_base(family, person, np.random.default_rng(k), height)
        contact = seat_contact(person, pose)
        assert contact[2] == pytest.approx(height, abs=1e-3)
        assert -0.25 < contact[0] < seat_depth_of(person)
        skin = pose_vertices(person, pose)
        assert skin[:, 2].min() > -0.005


def test_seated_feet_reach_the_floor_from_a_fitting_seat():
    for person, base, _, _ in draws("sitting_feet_down"):
        skin = pose_vertices(person, base)
        for side in "lr":
            assert abs(skin[landmarks_of(person).side[side].foot, 2].min()) < 0.01


def test_feet_dangle_from_a_seat_that_is_too_high():
    person = body(2)
    pose = draw_base("sitting_feet_down", person, np.random.default_rng(0), seat_height_of(person) + 0.15)
    skin = pose_vertices(person, pose)
    assert skin[:, 2].min() > 0.03
    assert seat_contact(person, pose)[2] == pytest.approx(seat_height_of(person) + 0.15, abs=1e-3)


@pytest.mark.parametrize("family", SITTING)
def test_thighs_lie_about_level(family):
    for person, base, _, _ in draws(family):
        joints = joint_positions(person.skeleton, base)
        for side in "lr" if family not in ("sitting_legs_crossed", "recorded_sitting") else "":
            thigh = joints[JOINT_NAMES.index(f"{side}_knee")] - joints[JOINT_NAMES.index(f"{side}_hip")]
            assert abs(np.degrees(np.arcsin(thigh[2] / np.linalg.norm(thigh)))) < 15


@pytest.mark.parametrize("family", [*TABLE, "typing_table", "typing_lap"])
def test_hands_touch_the_surface_and_stay_out_of_it(family):
    for person, pose, targets in finished(family):
        skin = pose_vertices(person, pose)
        marks = landmarks_of(person)
        x_min, x_max, y_min, y_max = targets.surface
        lows = []
        for side in "lr":
            arm = skin[np.concatenate([marks.side[side].hand, marks.side[side].forearm])]
            over = arm[(arm[:, 0] > x_min) & (arm[:, 0] < x_max) & (arm[:, 1] > y_min) & (arm[:, 1] < y_max)]
            in_lap = family == "table_hands" and len(over) and over[:, 2].max() < targets.surface_height - 0.05
            if len(over) and not in_lap:
                lows.append(over[:, 2].min() - targets.surface_height)
        assert min(lows) > -0.006
        assert min(lows) < 0.01
        if family.startswith("typing"):
            assert max(lows) < 0.011


def test_typing_fingers_are_on_their_keys():
    for person, pose, targets in finished("typing_table"):
        T = link_transforms(person.skeleton, pose.angles, pose.T_world_root)
        for side, target in (("l", targets.left), ("r", targets.right)):
            tips = T[LINK_IDX[f"{side}_fingertips_flexion"]]
            end = tips[:3, :3] @ landmarks_of(person).side[side].fingertip + tips[:3, 3]
            assert np.linalg.norm(end[:2] - target.position[:2]) < 0.02


@pytest.mark.parametrize("family", ["pushing_both_hands", "pushing_one_hand"])
def test_fists_close_around_the_handle(family):
    for person, pose, targets in finished(family):
        skin = pose_vertices(person, pose)
        held = []
        for side, target in (("l", targets.left), ("r", targets.right)):
            hand = skin[landmarks_of(person).side[side].hand] - np.asarray(target.position)
            near = np.hypot(hand[:, 0], hand[:, 2]).min() - 0.5 * target.diameter
            held.append(abs(near) < 0.01)
        assert sum(held) == 2 if family == "pushing_both_hands" else sum(held) >= 1


def test_the_same_seed_gives_the_same_bytes():
    for family in FREE:
        poses = []
        for _ in range(2):
            rng = np.random.default_rng(11)
            base = draw_base(family, body(0), rng)
            poses.append((base, draw_arms(family, body(0), base, rng)))
        (base_a, arms_a), (base_b, arms_b) = poses
        assert base_a.angles.tobytes() == base_b.angles.tobytes()
        assert base_a.T_world_root.tobytes() == base_b.T_world_root.tobytes()
        assert (arms_a is None) == (arms_b is None)
        if arms_a is not None:
            assert arms_a.angles.tobytes() == arms_b.angles.tobytes()


def test_draws_differ_in_every_hinge():
    angles = np.array([base.angles for family in FAMILIES for _, base, _, _ in draws(family)])
    still = np.flatnonzero(angles.std(axis=0) < np.radians(0.3))
    assert {name for name, i in DOF_IDX.items() if i in still} <= {
        "l_clavicle_protraction",
        "r_clavicle_protraction",
    }


@pytest.mark.parametrize("family", ["recorded_standing", "exercising"])
def test_free_hands_are_fists_flat_or_between(family):
    rng = np.random.default_rng(8)
    bend = DOF_IDX["l_fingers_flexion"]
    angles = np.degrees(
        [draw_arms(family, body(0), draw_base(family, body(0), rng), rng).angles[bend] for _ in range(40)]
    )
    assert 0.05 < (angles > 65).mean() < 0.5
    assert (angles < 20).any()
    assert ((angles > 25) & (angles < 60)).any()


def test_a_hand_pushed_into_the_belly_collides_and_the_bind_pose_does_not():
    person = body(0)
    assert not self_collides(person, Pose(person.bind_angles, np.eye(4)))
    angles = np.zeros(N_DOFS)
    angles[DOF_IDX["l_shoulder_rotation"]] = np.radians(85)
    angles[DOF_IDX["l_elbow_flexion"]] = np.radians(80)
    angles[DOF_IDX["l_shoulder_flexion"]] = np.radians(-20)
    assert self_collides(person, Pose(angles, np.eye(4)))


@pytest.mark.parametrize("family", ["standing", "carrying", "sitting_feet_down"])
def test_no_hand_is_inside_the_trunk_by_an_independent_library(family):
    """Hand vertices against the closed trunk-and-thigh part of the skin, by trimesh's signed distance."""
    for person, _, pose, _ in draws(family)[:4]:
        if pose is None:
            continue
        skin = pose_vertices(person, pose).astype(np.float64)
        marks = landmarks_of(person)
        hands = np.concatenate([marks.side[side].hand for side in "lr"])
        is_arm = np.zeros(len(skin), bool)
        is_arm[np.concatenate([np.r_[marks.side[s].hand, marks.side[s].forearm] for s in "lr"])] = True
        faces = person.mesh.faces[~is_arm[person.mesh.faces].any(axis=1)]
        trunk = trimesh.Trimesh(skin, faces, process=False)
        trunk.remove_unreferenced_vertices()
        trimesh.repair.fill_holes(trunk)
        sample = skin[hands[:: max(1, len(hands) // 60)]]
        nearest, distance, face = trimesh.proximity.closest_point(trunk, sample)
        inward = np.einsum("ij,ij->i", nearest - sample, trunk.face_normals[face]) > 0
        assert distance[inward].max(initial=0.0) < 0.025


def test_bad_requests_say_what_is_known():
    with pytest.raises(ValueError, match="'flying' is unknown; known are standing"):
        draw_base("flying", body(0), np.random.default_rng(0))
    with pytest.raises(ValueError, match="stands, but seat_height"):
        draw_base("standing", body(0), np.random.default_rng(0), 0.45)
    with pytest.raises(ValueError, match=r"must be in \[0.05, 1.5\]"):
        draw_base("sitting_feet_down", body(0), np.random.default_rng(0), 9.0)
    base = draw_base("table_hands", body(0), np.random.default_rng(0))
    with pytest.raises(ValueError, match="need targets with surface_height"):
        draw_arms("table_hands", body(0), base, np.random.default_rng(0))
