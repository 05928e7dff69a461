"""Visibility labels: each state from images made by hand, laws on random scenes, a slow twin."""

import numpy as np
import pytest

from synth.camera import Camera
from synth.render.labels import IS_PART_OF_JOINT, JOINT_RADIUS, Visibility, measure_visibility
from synth.render.rasterize import Renderer
from synth.render.records import RenderedPair
from synth.vocabulary import JOINT_NAMES, MIRRORED_JOINT, MIRRORED_PART, PART, JointState
from tests.reference_render import measure_joints_slow
from tests.render_scenes import NEAR, random_scene

CAMERA = Camera(100, 80, 100.0, 100.0, 50.0, 40.0)
DEPTH = 2.0
HAND = JOINT_NAMES.index("r_hand")


def pair_of(body_part: np.ndarray, instance: np.ndarray, body_depth: float = DEPTH) -> RenderedPair:
    """Flat layers: the person at `body_depth`, objects half a metre before it."""
    millimetres = np.uint16(body_depth * 1000)
    body = np.where(body_part > 0, millimetres, 0).astype(np.uint16)
    depth = np.where(instance > 0, millimetres - 500, body).astype(np.uint16)
    part = np.where(instance > 0, 0, body_part).astype(np.uint8)
    alone = np.bincount(instance.ravel(), minlength=3)
    alone[0] = 0
    return RenderedPair(depth, part, (instance > 0).astype(np.uint8), instance, body, body_part, 2 * alone)


def images() -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((80, 100), np.uint8), np.zeros((80, 100), np.uint8)


def measure(body_part: np.ndarray, instance: np.ndarray, joint: tuple[float, float, float]) -> Visibility:
    joints = np.tile(np.array((0.0, 0.0, DEPTH)), (15, 1))
    joints[HAND] = joint
    return measure_visibility(pair_of(body_part, instance), joints, CAMERA, NEAR)


@pytest.mark.parametrize(
    ("covered_to", "state", "fraction"),
    [(0, JointState.VISIBLE, 1.0), (50, JointState.VISIBLE, 0.6), (53, JointState.OCCLUDED, 0.0)],
)
def test_an_object_over_more_than_half_of_a_joint_occludes_it(
    covered_to: int, state: JointState, fraction: float
) -> None:
    body_part, instance = images()
    body_part[30:50, 40:60] = PART["r_hand"]
    instance[:, :covered_to] = 1
    found = measure(body_part, instance, (0.0, 0.0, DEPTH))
    assert found.joint_state[HAND] == state
    # a disc of 2.5 px: 21 pixels, 8 of them left of the middle column
    assert found.joint_visible_fraction[HAND] == pytest.approx(fraction if fraction != 0.6 else 13 / 21)


def test_a_joint_behind_its_own_body_is_self_occluded() -> None:
    body_part, instance = images()
    body_part[30:50, 40:60] = PART["lu_torso"]
    found = measure(body_part, instance, (0.0, 0.0, DEPTH))
    assert found.joint_state[HAND] == JointState.SELF_OCCLUDED
    assert found.joint_visible_fraction[HAND] == 0.0


def test_an_object_wins_over_the_own_body() -> None:
    body_part, instance = images()
    body_part[30:50, 40:60] = PART["lu_torso"]
    instance[35:45, 45:55] = 1
    assert measure(body_part, instance, (0.0, 0.0, DEPTH)).joint_state[HAND] == JointState.OCCLUDED


def test_the_right_part_at_the_wrong_depth_is_another_piece_of_it() -> None:
    body_part, instance = images()
    body_part[30:50, 40:60] = PART["r_hand"]
    assert measure(body_part, instance, (0.0, 0.0, DEPTH + 0.19)).joint_state[HAND] == JointState.VISIBLE
    assert measure(body_part, instance, (0.0, 0.0, DEPTH + 0.3)).joint_state[HAND] == JointState.SELF_OCCLUDED


@pytest.mark.parametrize(
    "joint", [(0, 0, -1.0), (0, 0, 0.2), (0, 0, 0), (-1.02, 0, DEPTH), (0.992, 0, DEPTH), (0, -0.82, DEPTH)]
)
def test_a_joint_outside_the_image_or_behind_the_near_plane_is_outside(joint: tuple[float, float, float]) -> None:
    body_part, instance = images()
    body_part[:] = PART["r_hand"]
    assert measure(body_part, instance, joint).joint_state[HAND] == JointState.OUTSIDE


@pytest.mark.parametrize("joint", [(-1.0, 0, DEPTH), (0.98, 0, DEPTH), (0, -0.8, DEPTH), (0, 0.78, DEPTH)])
def test_a_joint_on_the_border_is_inside(joint: tuple[float, float, float]) -> None:
    body_part, instance = images()
    body_part[:] = PART["r_hand"]
    found = measure(body_part, instance, joint)
    assert found.joint_state[HAND] == JointState.VISIBLE
    assert found.joint_visible_fraction[HAND] == 1.0


def test_shares_count_pixels() -> None:
    body_part, instance = images()
    body_part[10:20, 10:20] = PART["r_foot"]
    body_part[20:30, 10:20] = PART["l_foot"]
    instance[10:20, 10:15] = 1
    instance[60:70, 0:10] = 2
    found = measure(body_part, instance, (0.0, 0.0, DEPTH))
    expected = np.zeros(32, np.float32)
    expected[PART["r_foot"]], expected[PART["l_foot"]] = 0.5, 1.0
    assert np.array_equal(found.part_visible_fraction, expected)
    assert found.visible_fraction == 0.75
    assert found.object_visible_fraction.tolist() == [0.0, 0.5, 0.5]


def test_without_a_person_nothing_is_visible() -> None:
    body_part, instance = images()
    found = measure(body_part, instance, (0.0, 0.0, DEPTH))
    assert (found.joint_state == JointState.SELF_OCCLUDED).all()
    assert found.visible_fraction == 0.0
    assert not found.part_visible_fraction.any()


def test_left_joints_have_the_left_twins_of_the_right_joints_parts() -> None:
    mirrored = IS_PART_OF_JOINT[np.array(MIRRORED_JOINT)][:, np.array(MIRRORED_PART)]
    assert np.array_equal(IS_PART_OF_JOINT, mirrored)
    assert np.array_equal(np.array(JOINT_RADIUS), np.array(JOINT_RADIUS)[np.array(MIRRORED_JOINT)])
    assert IS_PART_OF_JOINT[:, 1:].any(axis=0).all()
    assert not IS_PART_OF_JOINT[:, 0].any()


@pytest.mark.parametrize("seed", range(10))
def test_labels_equal_the_slow_twin_and_keep_their_laws(seed: int) -> None:
    scene = random_scene(seed)
    pair = Renderer(scene.camera, NEAR).render(scene.T_camera_world, scene.body, scene.objects)
    rng = np.random.default_rng(seed)
    pixels = rng.uniform((-5, -5), (scene.camera.width + 5, scene.camera.height + 5), (15, 2))
    on_body = np.argwhere(pair.body_part > 0)
    chosen = on_body[rng.integers(len(on_body), size=11)]
    pixels[:11] = chosen[:, ::-1]
    depth = rng.uniform(0.1, 4.0, 15)
    depth[:11] = pair.body_depth[chosen[:, 0], chosen[:, 1]] * 1e-3 + 0.05
    joints = scene.camera.backproject(pixels, depth)
    found = measure_visibility(pair, joints, scene.camera, NEAR)
    state, fraction = measure_joints_slow(pair, joints, scene.camera, NEAR)
    assert np.array_equal(found.joint_state, state)
    assert np.allclose(found.joint_visible_fraction, fraction)
    is_seen = found.joint_state == JointState.VISIBLE
    assert (found.joint_visible_fraction[is_seen] >= 0.5).all()
    assert (found.joint_visible_fraction[~is_seen] < 0.5).all()
    for share in (found.part_visible_fraction, found.object_visible_fraction, np.array(found.visible_fraction)):
        assert ((share >= 0) & (share <= 1)).all()


def test_wrong_shapes_are_refused() -> None:
    pair = pair_of(*images())
    with pytest.raises(ValueError, match=r"joints have shape \(14, 3\), must be \(15, 3\)"):
        measure_visibility(pair, np.ones((14, 3)), CAMERA)
    with pytest.raises(ValueError, match=r"images have shape \(80, 100\), the camera's is \(50, 60\)"):
        measure_visibility(pair, np.ones((15, 3)), Camera(60, 50, 50, 50, 30, 25))
