"""Skin and objects do not sink into each other by more than 1 cm, as an independent library sees it."""

import dataclasses

import igl
import numpy as np
import pytest

from synth.bodies.rig.skinning import posed_mesh
from synth.geometry import LabelledMesh, surface_points
from synth.scene import FrameSource, SceneConfig, SceneWeights
from synth.scene.replay import occluder_of, person_of


def deepest(mesh: LabelledMesh, points: np.ndarray) -> float:
    """How deep the deepest point is inside a closed mesh [m]; negative if all are outside."""
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    return -float(igl.signed_distance(points.astype(np.float64), vertices, faces)[0].min())


@pytest.mark.parametrize("family", ["table", "laptop_table", "laptop_lap", "stroller", "clutter"])
def test_nothing_sinks_into_the_person(family: str) -> None:
    weights = SceneWeights(*[float(name == family) for name in SceneWeights.names()])
    config = dataclasses.replace(SceneConfig(camera="kinect_v1_qvga"), scenes=weights)
    for frame in FrameSource(config, 8, 6):
        body, pose = person_of(frame)
        skin = posed_mesh(body, pose)
        assert frame.info.objects
        for record in frame.info.objects:
            mesh = occluder_of(record).mesh.transformed(record.T_world_object)
            assert deepest(skin, surface_points(mesh, 0.02)) < 0.01
            if mesh.is_closed:
                assert deepest(mesh, skin.vertices) < 0.01
