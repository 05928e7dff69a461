import numpy as np
import pytest
import trimesh

from synth.bodies.body import Body, Pose, SkinWeights
from synth.bodies.rig.skinning import DUAL_SHARE, pose_vertices, posed_mesh
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, N_DOFS, UPPER, Lengths, make_skeleton
from synth.geometry import LabelledMesh, rotation_about, transform_points, translation
from tests.reference_bodies import skin_slow


def arm_tube(lower: str, upper: str, length: float) -> Body:
    """A tube along the left arm whose skin goes over from link `upper` to link `lower` at the elbow."""
    skeleton = make_skeleton(Lengths.of_stature(1.75))
    shoulder = skeleton.offsets[[DOF_IDX["lumbar_flexion"], DOF_IDX["thorax_flexion"]]].sum(axis=0)
    shoulder = (
        shoulder
        + skeleton.offsets[DOF_IDX["l_clavicle_elevation"]]
        + skeleton.offsets[DOF_IDX["l_shoulder_flexion"]]
    )
    elbow = shoulder + skeleton.offsets[DOF_IDX["l_elbow_flexion"]]
    tube = trimesh.creation.cylinder(radius=0.04, height=0.5, sections=32)
    tube = trimesh.Trimesh(*trimesh.remesh.subdivide_to_size(tube.vertices, tube.faces, 0.02))
    vertices = tube.vertices + elbow
    share = np.clip(0.5 - tube.vertices[:, 2] / length, 0.0, 1.0)
    n = len(vertices)
    weights = SkinWeights(
        np.arange(0, 2 * n + 1, 2, dtype=np.int32),
        np.tile([LINK_IDX[upper], LINK_IDX[lower]], n).astype(np.int32),
        np.stack([1 - share, share], axis=1).ravel().astype(np.float32),
    )
    faces = tube.faces.astype(np.int32)
    mesh = LabelledMesh(vertices.astype(np.float32), faces, np.ones(len(faces), np.uint8), True)
    return Body(None, skeleton, mesh, np.zeros(N_DOFS), weights)


def volume(body: Body, angles: np.ndarray) -> float:
    mesh = posed_mesh(body, Pose(angles, np.eye(4)))
    return abs(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume)


TUBE = arm_tube("l_elbow_flexion", "l_shoulder_rotation", 0.08)


@pytest.mark.parametrize("seed", range(3))
def test_the_skin_is_where_the_slow_twin_puts_it(seed):
    rng = np.random.default_rng(seed)
    angles = rng.uniform(LOWER, UPPER)
    root = translation(*rng.normal(size=3)) @ rotation_about((0, 0, 1), rng.uniform(-3, 3))
    slow = skin_slow(TUBE, angles, root, DUAL_SHARE)
    np.testing.assert_allclose(pose_vertices(TUBE, Pose(angles, root)), slow, atol=2e-6)


def test_the_bind_pose_gives_the_bind_skin():
    skin = pose_vertices(TUBE, Pose(TUBE.bind_angles, np.eye(4)))
    np.testing.assert_allclose(skin, TUBE.mesh.vertices, atol=1e-6)


def test_moving_the_root_moves_the_skin_rigidly():
    rng = np.random.default_rng(1)
    angles = rng.uniform(LOWER, UPPER)
    root = translation(1, 2, 3) @ rotation_about((0, 0, 1), 2.0)
    still = pose_vertices(TUBE, Pose(angles, np.eye(4)))
    np.testing.assert_allclose(pose_vertices(TUBE, Pose(angles, root)), transform_points(root, still), atol=2e-6)


def test_chosen_vertices_equal_those_of_the_whole_skin():
    angles = np.random.default_rng(2).uniform(LOWER, UPPER)
    chosen = np.array([5, 0, 77])
    pose = Pose(angles, np.eye(4))
    np.testing.assert_array_equal(pose_vertices(TUBE, pose, chosen), pose_vertices(TUBE, pose)[chosen])


@pytest.mark.parametrize("degrees", [45, 90, 135])
def test_a_bent_elbow_keeps_its_volume(degrees):
    angles = np.zeros(N_DOFS)
    angles[DOF_IDX["l_elbow_flexion"]] = np.radians(degrees)
    assert volume(TUBE, angles) > 0.93 * volume(TUBE, np.zeros(N_DOFS))


def test_a_twisted_arm_keeps_its_girth():
    tube = arm_tube("l_forearm_pronation", "l_elbow_flexion", 0.2)
    angles = np.zeros(N_DOFS)
    angles[DOF_IDX["l_forearm_pronation"]] = np.radians(85)
    assert volume(tube, angles) > 0.93 * volume(tube, np.zeros(N_DOFS))
