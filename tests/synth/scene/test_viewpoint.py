"""Views keep to the bearings and distances asked for, near and far, through every camera."""

import numpy as np
import pytest

from synth.bodies.body import Pose
from synth.bodies.rig.kinematics import joint_positions
from synth.bodies.skeleton import DOF_IDX, N_DOFS, Lengths, make_skeleton
from synth.geometry import inverse, transform_points
from synth.render.presets import CAMERAS, camera_named
from synth.scene.config import SceneConfig
from synth.scene.viewpoint import LEAST_GAP, NEAR, Viewpoint, draw_azimuth, draw_viewpoint
from synth.vocabulary import JOINT_NAMES


def joints(stature: float = 1.75) -> np.ndarray:
    T = np.eye(4)
    T[2, 3] = 0.53 * stature
    angles = np.zeros(N_DOFS)
    angles[DOF_IDX["l_shoulder_flexion"]] = np.pi / 2
    return joint_positions(make_skeleton(Lengths.of_stature(stature)), Pose(angles, T))


def views(config: SceneConfig, n: int, stature: float = 1.75) -> list[Viewpoint]:
    rng = np.random.default_rng(5)
    camera, body = config.make_camera(), joints(stature)
    drawn = [draw_viewpoint(config, camera, body, draw_azimuth(config, rng), rng) for _ in range(n)]
    return [view for view in drawn if view is not None]


def test_half_of_the_bearings_are_near_the_front_and_all_sides_occur() -> None:
    def bearings(share: float) -> np.ndarray:
        rng = np.random.default_rng(0)
        return np.degrees([draw_azimuth(SceneConfig(frontal_share=share), rng) for _ in range(2000)])

    even, frontal = bearings(0.0), bearings(0.5)
    assert np.mean(np.abs(even) < 45) == pytest.approx(0.25, abs=0.03)
    assert np.mean(np.abs(frontal) < 45) == pytest.approx(0.5 * 0.25 + 0.5 * 0.683, abs=0.04)
    assert (np.histogram(frontal, np.arange(-180, 181, 30))[0] > 30).all()


def test_bearings_stay_in_the_range_also_if_it_leaves_the_front_out() -> None:
    rng = np.random.default_rng(0)
    config = SceneConfig(azimuth=(2.0, 3.0), frontal_share=1.0)
    assert all(2.0 <= draw_azimuth(config, rng) <= 3.0 for _ in range(50))


@pytest.mark.parametrize("camera", sorted(CAMERAS))
@pytest.mark.parametrize("stature", [1.1, 1.95])
def test_near_views_cut_the_body_off_but_show_head_and_neck(camera: str, stature: float) -> None:
    config, body = SceneConfig(camera=camera, near_share=1.0), joints(stature)
    drawn = views(config, 60, stature)
    assert len(drawn) >= 20
    n_cut = 0
    for view in drawn:
        assert NEAR[0] <= view.distance <= NEAR[1]
        seen = transform_points(inverse(view.T_world_camera), body)
        assert np.linalg.norm(seen, axis=1).min() >= LEAST_GAP
        u, v = camera_named(camera).project(seen[[JOINT_NAMES.index("head"), JOINT_NAMES.index("neck")]]).T
        assert ((u >= 0) & (u < config.make_camera().width) & (v >= 0) & (v < config.make_camera().height)).all()
        feet = camera_named(camera).project(np.maximum(seen[-2:], (-np.inf, -np.inf, 0.1)))
        n_cut += bool((feet[:, 1] > config.make_camera().height).all())
    assert n_cut > 0.4 * len(drawn)


def test_near_views_keep_to_the_distances_and_heights_asked_for() -> None:
    config = SceneConfig(near_share=1.0, distance=(1.2, 4.0), height=(1.0, 1.1))
    drawn = views(config, 60)
    assert drawn
    assert all(1.2 <= view.distance <= NEAR[1] and 1.0 <= view.T_world_camera[2, 3] <= 1.1 for view in drawn)
    assert views(SceneConfig(near_share=1.0, distance=(2.0, 4.0)), 10) == []
