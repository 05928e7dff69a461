from dataclasses import replace

import numpy as np
import pytest
import trimesh
import yourdfpy
from scipy.spatial import cKDTree

from synth.occluders.registry import GENERATORS, make, sample
from synth.occluders.urdf import joint_values, linkage, write_urdf

ARTICULATED = [kind for kind, g in GENERATORS.items() if g.linkage is not None]


def vertices_posed_by_yourdfpy(path, values):
    robot = yourdfpy.URDF.load(str(path), mesh_dir=str(path.parent))
    robot.update_cfg({name: values[name] for name in robot.actuated_joint_names})
    out = []
    for name in robot.link_map:
        mesh = trimesh.load(path.parent / robot.link_map[name].visuals[0].geometry.mesh.filename, process=False)
        out.append(trimesh.transform_points(mesh.vertices, robot.get_transform(name)))
    return np.concatenate(out)


def farthest(a, b):
    """Hausdorff distance of two sets of points."""
    return max(cKDTree(a).query(b)[0].max(), cKDTree(b).query(a)[0].max())


@pytest.mark.parametrize("kind", ARTICULATED)
def test_posing_the_urdf_by_yourdfpy_gives_the_object_that_make_builds(kind, tmp_path):
    spec = GENERATORS[kind].sample(np.random.default_rng(7))
    path = write_urdf(spec, tmp_path / "robot")
    posed = vertices_posed_by_yourdfpy(path, joint_values(spec))
    assert farthest(posed, make(spec).mesh.vertices) < 1e-6


def test_turning_the_urdf_hinge_equals_making_a_laptop_with_that_angle(tmp_path):
    spec = sample("laptop", np.random.default_rng(3), hinge_angle=1.5)
    path = write_urdf(spec, tmp_path)
    for angle in (0.0, 0.7, 2.2, np.pi):
        posed = vertices_posed_by_yourdfpy(path, {"hinge": angle})
        assert farthest(posed, make(replace(spec, hinge_angle=angle)).mesh.vertices) < 1e-6


@pytest.mark.parametrize("kind", ARTICULATED)
def test_joint_values_lie_within_the_limits_that_the_urdf_states(kind, tmp_path):
    rng = np.random.default_rng(0)
    for _ in range(5):
        for joint in linkage(GENERATORS[kind].sample(rng)).joints:
            if joint.kind != "continuous":
                assert joint.lower <= joint.value <= joint.upper
            assert np.linalg.norm(joint.axis) == pytest.approx(1)


def test_an_object_without_joints_is_refused_and_the_articulated_kinds_are_listed(tmp_path):
    spec = sample("suitcase", np.random.default_rng(0))
    with pytest.raises(ValueError, match="'suitcase' has no joints, only laptop, umbrella_stroller, pram"):
        write_urdf(spec, tmp_path)
