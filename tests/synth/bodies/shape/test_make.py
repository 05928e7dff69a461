"""The skin: closed, symmetric, labelled, weighted, with the joints inside."""

import dataclasses

import numpy as np
import pytest
import trimesh

from synth.bodies.body import Pose
from synth.bodies.rig.kinematics import joint_positions, link_transforms
from synth.bodies.rig.markers import markers
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.shape.figure import enclosed_volume
from synth.bodies.shape.make import evened, make_body
from synth.bodies.shape.template import template
from synth.bodies.skeleton import BONE_LINKS, DOF_IDX, LINK_IDX, LOWER, N_DOFS, UPPER
from synth.bodies.spec import BodySpec, sample_body
from synth.vocabulary import MIRRORED_PART, N_PARTS, PART

TEMPLATES = ("template", "template_skirt", "template_long_skirt")


@pytest.fixture(scope="module")
def people():
    rng = np.random.default_rng(11)
    return [make_body(sample_body(rng, child_share=0.25)) for _ in range(30)]


def mirror_of(body):
    name = {"skirt": "template_skirt", "long_skirt": "template_long_skirt"}.get(body.spec.bottom, "template")
    return template(name).mirror


def test_every_skin_is_one_closed_outward_surface_of_8k_to_25k_triangles(people):
    for body in people:
        mesh = trimesh.Trimesh(body.mesh.vertices, body.mesh.faces, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume > 0
        assert mesh.body_count == 1
        assert 8_000 <= len(mesh.faces) <= 25_000


def test_all_joint_centres_lie_inside(people):
    for body in people:
        mesh = trimesh.Trimesh(body.mesh.vertices, body.mesh.faces, process=False)
        joints = joint_positions(body.skeleton, Pose(body.bind_angles, np.eye(4)))
        assert mesh.contains(joints).all(), body.spec
        nearest = np.linalg.norm(joints[:, None] - body.mesh.vertices[None].astype(np.float64), axis=2).min(axis=1)
        assert nearest.min() > 0.008, body.spec


def test_a_body_is_its_own_mirror_image(people):
    for body in people[:6]:
        mirror = mirror_of(body)
        assert np.array_equal(mirror[mirror], np.arange(len(mirror)))
        image = body.mesh.vertices[mirror] * np.float32([1, -1, 1])
        assert np.array_equal(image, body.mesh.vertices)


@pytest.mark.parametrize("name", TEMPLATES)
def test_labels_are_all_there_and_mirror_with_the_faces(name):
    skin = template(name)
    assert set(skin.face_label) == set(range(1, N_PARTS + 1))
    faces = {tuple(sorted(f)): label for f, label in zip(skin.faces.tolist(), skin.face_label, strict=True)}
    for face, label in faces.items():
        image = tuple(sorted(skin.mirror[list(face)].tolist()))
        assert faces[image] == MIRRORED_PART[label] or image == face


@pytest.mark.parametrize("name", TEMPLATES)
def test_weights_sum_to_one_are_positive_and_hang_on_bones_alone(name):
    weights = template(name).weights
    sums = np.add.reduceat(weights.weight.astype(np.float64), weights.indptr[:-1])
    assert np.abs(sums - 1).max() < 1e-5
    assert weights.weight.min() > 0
    assert set(weights.link) <= {LINK_IDX[bone] for bone in BONE_LINKS}


@pytest.mark.parametrize("name", TEMPLATES)
def test_no_weight_leaks_from_one_limb_to_another(name):
    skin = template(name)
    weights = skin.weights
    row = np.repeat(np.arange(len(skin.mirror)), np.diff(weights.indptr))

    def share(prefixes):
        links = [i for n, i in LINK_IDX.items() if n.startswith(prefixes)]
        return np.bincount(row, weights.weight * np.isin(weights.link, links), minlength=len(skin.mirror))

    left_hand, right_hand = share(("l_wrist", "l_finger", "l_thumb")), share(("r_wrist", "r_finger", "r_thumb"))
    arms = share(("l_elbow", "r_elbow", "l_forearm", "r_forearm")) + left_hand + right_hand
    legs = share(("l_hip", "r_hip", "l_knee", "r_knee", "l_ankle", "r_ankle", "l_toes", "r_toes"))
    assert (left_hand * right_hand).max() == 0
    assert (arms * legs).max() < 1e-6
    feet = share(("l_ankle", "l_toes")) * share(("r_ankle", "r_toes"))
    assert feet.max() == 0


def test_hands_and_feet_are_where_the_labels_say():
    body = make_body(BodySpec(1.75, 75.0, 0.5, 30.0))
    T = link_transforms(body.skeleton, body.bind_angles, np.eye(4))
    centre = body.mesh.vertices[body.mesh.faces].mean(axis=1)
    for part, link in (
        ("l_hand", "l_fingers_flexion"),
        ("r_foot", "r_ankle_inversion"),
        ("l_knee", "l_knee_flexion"),
    ):
        found = centre[body.mesh.face_label == PART[part]]
        assert np.linalg.norm(found.mean(axis=0) - T[LINK_IDX[link], :3, 3]) < 0.12


@pytest.mark.parametrize(
    ("degrees", "least"),
    [
        ({"elbow_flexion": 140}, 0.96),
        ({"knee_flexion": 130}, 0.95),
        ({"hip_flexion": 100, "knee_flexion": 90}, 0.93),
        ({"shoulder_flexion": 170}, 0.94),
        ({"forearm_pronation": 80}, 0.98),
        ({}, 0.96),
    ],
)
def test_volume_does_not_collapse_in_bent_joints(degrees, least):
    body = make_body(BodySpec(1.75, 75.0, 1.0, 30.0))
    angles = np.zeros(N_DOFS)
    for name, value in degrees.items():
        for side in "lr":
            angles[DOF_IDX[f"{side}_{name}"]] = np.radians(value)
    posed = pose_vertices(body, Pose(angles, np.eye(4))).astype(np.float64)
    rest = enclosed_volume(body.mesh.vertices.astype(np.float64), body.mesh.faces)
    assert least < enclosed_volume(posed, body.mesh.faces) / rest < 1.06


def test_the_bind_pose_lies_within_the_joint_limits():
    body = make_body(BodySpec(1.75, 75.0, 1.0, 30.0))
    assert np.all((body.bind_angles >= LOWER) & (body.bind_angles <= UPPER))


def test_evening_keeps_constants_and_matches_its_slow_twin():
    skin = template("template")
    rng = np.random.default_rng(0)
    field = rng.standard_normal((len(skin.on_plane), 3))
    rings = (skin.ring_start, skin.ring, skin.ring_weight)
    slow = field.copy()
    for _ in range(2):
        mean = np.zeros_like(slow)
        rows = np.repeat(np.arange(len(slow)), np.diff(skin.ring_start))
        np.add.at(mean, rows, skin.ring_weight[:, None] * slow[skin.ring])
        slow = 0.5 * slow + 0.5 * mean
    np.testing.assert_allclose(evened(field, *rings, 2), slow, atol=1e-12)
    constant = np.full_like(field, 0.3)
    np.testing.assert_allclose(evened(constant, *rings, 5), constant, atol=1e-5)


def test_markers_lie_on_the_skin_and_mirror():
    body = make_body(BodySpec(1.7, 68.0, 0.0, 40.0, top="shirt", top_ease=0.012, shoes="shoe", sole=0.02))
    T = link_transforms(body.skeleton, body.bind_angles, np.eye(4))
    found = markers(body)
    mesh = trimesh.Trimesh(body.mesh.vertices, body.mesh.faces, process=False)
    points = np.stack([T[link, :3, :3] @ offset + T[link, :3, 3] for link, offset in found.values()])
    nearest = trimesh.proximity.ProximityQuery(mesh).vertex(points)[0]
    assert nearest.max() < 0.03
    for name, point in zip(found, points, strict=True):
        if name.startswith("l_"):
            image = points[list(found).index("r_" + name[2:])]
            np.testing.assert_allclose(image, point * (1, -1, 1), atol=1e-9)


def test_clothes_only_add():
    naked = BodySpec(1.7, 70.0, 0.5, 30.0)
    worn = dataclasses.replace(naked, top="jacket", top_ease=0.03, bottom="loose", bottom_ease=0.02)
    volumes = [
        enclosed_volume(b.mesh.vertices.astype(np.float64), b.mesh.faces)
        for b in (make_body(naked), make_body(worn))
    ]
    assert volumes[1] > 1.15 * volumes[0]
