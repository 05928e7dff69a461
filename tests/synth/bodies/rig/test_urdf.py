import numpy as np
import pytest
import trimesh
import yourdfpy

from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.rig.urdf import link_name, skin_pieces, write_urdf
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import AXES, DOFS, LOWER, N_DOFS, N_LINKS, UPPER
from synth.bodies.spec import BodySpec

BODY = make_body(BodySpec(1.76, 72.0, 1.0, 35.0))


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    path = write_urdf(BODY, tmp_path_factory.mktemp("body"))
    return yourdfpy.URDF.load(str(path))


def test_yourdfpy_reads_the_hinges_with_their_axes_and_limits(robot):
    assert robot.base_link == "root"
    assert robot.num_actuated_joints == N_DOFS
    for i, dof in enumerate(DOFS):
        joint = robot.joint_map[dof.name]
        np.testing.assert_array_equal(joint.axis, AXES[i])
        np.testing.assert_allclose((joint.limit.lower, joint.limit.upper), (LOWER[i], UPPER[i]), atol=1e-12)
        assert joint.limit.effort > 0
        assert joint.limit.velocity > 0


@pytest.mark.parametrize("seed", range(5))
def test_our_kinematics_equal_yourdfpys(robot, seed):
    angles = np.random.default_rng(seed).uniform(LOWER, UPPER)
    robot.update_cfg({dof.name: angle for dof, angle in zip(DOFS, angles, strict=True)})
    ours = link_transforms(BODY.skeleton, angles, np.eye(4))
    theirs = np.stack([robot.get_transform(link_name(i), "root") for i in range(N_LINKS)])
    np.testing.assert_allclose(ours, theirs, atol=1e-6)


def test_masses_sum_to_the_bodys_and_inertias_are_physical(robot):
    inertials = [link.inertial for link in robot.robot.links]
    assert sum(inertial.mass for inertial in inertials) == pytest.approx(BODY.spec.mass, rel=1e-9)
    for inertial in inertials:
        a, b, c = np.diag(inertial.inertia)
        assert min(a, b, c) > 0
        assert max(a, b, c) <= a + b + c - max(a, b, c) + 1e-9


def test_the_pieces_put_together_are_the_bind_pose_skin():
    pieces = skin_pieces(BODY)
    assert sum(len(faces) for _, faces in pieces.values()) == len(BODY.mesh.faces)
    T = link_transforms(BODY.skeleton, BODY.bind_angles, np.eye(4))
    parts = [trimesh.Trimesh(v @ T[i, :3, :3].T + T[i, :3, 3], f, process=False) for i, (v, f) in pieces.items()]
    whole = trimesh.Trimesh(BODY.mesh.vertices, BODY.mesh.faces, process=False)
    assert sum(part.area for part in parts) == pytest.approx(whole.area, rel=1e-6)


def test_the_meshes_load_where_the_skin_is(robot):
    robot.update_cfg({dof.name: angle for dof, angle in zip(DOFS, BODY.bind_angles, strict=True)})
    bounds = robot.scene.bounds
    np.testing.assert_allclose(bounds[0], BODY.mesh.vertices.min(axis=0), atol=2e-3)
    np.testing.assert_allclose(bounds[1], BODY.mesh.vertices.max(axis=0), atol=2e-3)
