"""People who walk and sit: feet neither slide nor sink, knees bend forward, arms swing against the legs."""

import numpy as np
import pytest

from synth.bodies.motion.compose import Plan, composed
from synth.bodies.motion.curves import bump, eased, smooth_below, smoothed
from synth.bodies.motion.foot import foot_shapes
from synth.bodies.motion.gestures import draw_gesture
from synth.bodies.motion.itinerary import Itinerary, Stance, rounded, wrapped
from synth.bodies.motion.overlays import Sit
from synth.bodies.poses.draw import draw_base
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.rig.kinematics import joint_positions, link_transforms
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import DOF_IDX, JOINT_IDX, LINK_IDX, LOWER, UPPER
from synth.bodies.spec import sample_body

RATE = 60.0


@pytest.fixture(scope="module", params=[3, 8])
def walk(request):
    """A body, and its motion along a bent way with a turn."""
    rng = np.random.default_rng(request.param)
    body = make_body(sample_body(rng, 0.0))
    base = draw_base("standing", body, rng)
    leg = landmarks_of(body).leg
    way = Itinerary(Stance(leg, 0.08, 0.1), RATE, np.zeros(2), 0.0)
    way.stay(0.4)
    way.walk(np.array([(0.0, 0.0), (2.0, 0.0), (3.0, 1.5)]), 1.1)
    way.turn(3.0)
    way.walk(np.array([(3.0, 1.5), (0.5, 1.8)]), 0.8)
    way.stay(0.4)
    return body, way, composed(Plan(body, base, way), rng)


@pytest.fixture(scope="module")
def joints(walk):
    body, _, motion = walk
    return np.array([joint_positions(body.skeleton, motion.pose(k)) for k in range(len(motion))])


def ankles(body, motion, side):
    """(n, 2) where an ankle is, seen from above [m]."""
    link = LINK_IDX[f"{side}_ankle_inversion"]
    placed = zip(motion.angles, motion.T_world_root, strict=True)
    return np.array([link_transforms(body.skeleton, angles, T)[link, :2, 3] for angles, T in placed])


def test_a_foot_that_is_down_does_not_slide(walk):
    body, _, motion = walk
    flat = motion.contacts.reshape(len(motion), -1)[:, :4].reshape(-1, 2, 2)
    for k, side in enumerate("lr"):
        step = np.hypot(*np.diff(ankles(body, motion, side), axis=0).T)
        is_flat = flat[1:, k].all(axis=1) & flat[:-1, k].all(axis=1)
        landed = np.cumsum(np.diff(np.concatenate([[0], is_flat.astype(int)])) == 1)
        slides = np.bincount(landed[is_flat], weights=step[is_flat])
        assert is_flat.mean() > 0.12
        assert slides.max() < 0.01


def test_no_skin_sinks_into_the_floor(walk):
    body, _, motion = walk
    lowest = [float(pose_vertices(body, motion.pose(k))[:, 2].min()) for k in range(0, len(motion), 7)]
    assert min(lowest) > -0.006
    assert max(lowest) < 0.02


def test_angles_keep_their_limits_and_knees_bend_the_right_way(walk):
    motion = walk[2]
    assert (motion.angles >= LOWER).all()
    assert (motion.angles <= UPPER).all()
    for side in "lr":
        knee = np.degrees(motion.angles[:, DOF_IDX[f"{side}_knee_flexion"]])
        assert 45.0 < knee.max() < 100.0
        assert knee.min() < 20.0


def test_arms_swing_against_the_legs(walk, joints):
    """Along the walking direction each hand goes with the foot of the other side."""
    motion = walk[2]
    is_walk = np.array([name == "walk" for name in motion.activity])
    forward = motion.T_world_root[:, :2, 0]
    along = np.einsum("njk,nk->nj", joints[:, :, :2] - joints[:, [JOINT_IDX["torso"]], :2], forward)[is_walk]
    hands = along[:, JOINT_IDX["l_hand"]] - along[:, JOINT_IDX["r_hand"]]
    feet = along[:, JOINT_IDX["l_foot"]] - along[:, JOINT_IDX["r_foot"]]
    assert np.corrcoef(hands, feet)[0, 1] < -0.8


def test_walkers_get_where_they_go_and_move_smoothly(walk, joints):
    _, way, motion = walk
    np.testing.assert_allclose(way.place, (0.5, 1.8), atol=1e-6)
    assert np.hypot(*(motion.T_world_root[-1, :2, 3] - way.place)) < 0.03
    step = np.linalg.norm(np.diff(joints, axis=0), axis=2) * RATE
    assert step.max() < 5.5
    assert np.abs(np.diff(motion.T_world_root[:, 2, 3], 2)).max() * RATE**2 < 12.0


def test_feet_roll_on_what_touches_the_floor(walk):
    """At every pitch the lowest skin is on the floor: the heel's when the toes are up, the toes' when the heel is."""
    shape = foot_shapes(walk[0])["l"]
    pitch = np.radians(np.array([-20.0, 0.0, 30.0]))
    T = shape.placed(np.zeros((3, 3)), pitch, np.zeros(3))
    heel = np.array([shape.heel, 0.0, -shape.ankle, 1.0])
    ball = np.array([shape.ball, 0.0, shape.ball_height - shape.ankle, 1.0])
    np.testing.assert_allclose((T[0] @ heel)[:3], (shape.heel, 0.0, 0.0), atol=1e-9)
    np.testing.assert_allclose((T[2] @ ball)[:3], (shape.ball, 0.0, shape.ball_height), atol=1e-9)
    np.testing.assert_allclose(T[1, :3, 3], (0.0, 0.0, shape.ankle), atol=1e-9)


def test_who_sits_down_ends_on_the_seat_with_the_feet_where_they_were(walk):
    body = walk[0]
    rng = np.random.default_rng(5)
    pose = draw_base("sitting_feet_down", body, rng)
    T = link_transforms(body.skeleton, pose.angles, pose.T_world_root)
    feet, middles = {}, []
    for side in "lr":
        foot = T[LINK_IDX[f"{side}_ankle_inversion"]]
        feet[side] = (float(foot[0, 3]), float(foot[1, 3]), float(np.arctan2(foot[1, 0], foot[0, 0])))
        middles.append(foot[:2, 3])
    way = Itinerary(Stance(landmarks_of(body).leg, 0.08, 0.1), RATE, np.mean(middles, axis=0), 0.0, dict(feet))
    way.stay(0.5)
    way.stay(1.8, "sit_down")
    down, moment = 0.5, way.seconds
    way.stay(1.0, "sit")
    motion = composed(
        Plan(body, draw_base("standing", body, rng), way, [Sit(down, moment, np.inf, np.inf, pose)]), rng
    )
    np.testing.assert_allclose(motion.T_world_root[-1], pose.T_world_root, atol=1e-6)
    assert motion.contacts[-1, 4]
    assert not motion.contacts[0, 4]
    assert motion.contacts[:, :4].all()
    for side in "lr":
        assert np.ptp(ankles(body, motion, side), axis=0).max() < 0.01


def test_gestures_leave_no_limb_in_another_and_come_back(walk):
    body, rng = walk[0], np.random.default_rng(1)
    base = draw_base("standing", body, rng)
    drawn = [draw_gesture(body, base, 1.0, 4.0, rng, is_seated=False) for _ in range(4)]
    gestures = [one for one in drawn if one is not None]
    assert gestures
    for _, gesture in gestures:
        share = gesture.share(np.array([0.9, 1.0 + gesture.moving, gesture.end + 0.01]))
        np.testing.assert_allclose(share, (0.0, 1.0, 0.0), atol=1e-9)
    assert draw_gesture(body, base, 0.0, 0.5, rng, is_seated=False) is None


def test_curves_keep_what_they_promise():
    u = np.linspace(0, 1, 1001)
    assert eased(0.5) == 0.5
    assert eased(-1.0) == 0.0
    assert eased(2.0) == 1.0
    assert np.abs(np.gradient(eased(u), u)[[0, -1]]).max() < 1e-4
    assert bump(0.5) == 1.0
    assert bump(0.0) == bump(1.0) == 0.0
    rough = np.random.default_rng(0).random(300)
    below = smooth_below(rough, 0.05, 60.0)
    assert (below <= rough + 1e-12).all()
    assert smoothed(np.ones(50), 0.1, 60.0) == pytest.approx(1.0)


def test_rounded_paths_keep_their_ends_and_have_no_corner():
    path, along = rounded(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0)]))
    np.testing.assert_allclose(path[[0, -1]], [(0.0, 0.0), (2.0, 2.0)])
    ways = np.diff(path, axis=0)
    turn = np.diff(np.unwrap(np.arctan2(ways[:, 1], ways[:, 0])))
    assert np.abs(turn).max() < np.radians(10.0)
    assert 3.4 < along[-1] < 4.0
    assert wrapped(3.5) == pytest.approx(3.5 - 2 * np.pi)
