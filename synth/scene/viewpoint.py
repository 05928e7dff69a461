"""Where the camera stands: bearing, distance, height and aim, within a mounting's ranges."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.geometry import inverse, look_at, transform_points
from synth.render.presets import mounting_named
from synth.scene.config import SceneConfig

CROPPED_SHARE = 0.15
"""Share of the viewpoints that may cut a part of the person off."""
MIN_JOINTS_INSIDE = 9
"""A view that cuts the person off still shows this many of the 15 joints."""
BORDER = 8.0
"""A view that shows the whole person keeps the joints this far from the border [px]."""


@dataclass(frozen=True)
class Viewpoint:
    """A camera that stands in the scene.

    Attributes:
        T_world_camera: (4, 4) float64.
        azimuth: Bearing of the camera seen from the person, 0 in front, left positive [rad].
        distance: Horizontal distance from the person [m].
    """

    T_world_camera: NDArray[np.float64]
    azimuth: float
    distance: float


def draw_azimuth(config: SceneConfig, rng: np.random.Generator) -> float:
    """Draws the camera's bearing seen from the person [rad]."""
    return float(rng.uniform(*config.azimuth))


def draw_viewpoint(
    config: SceneConfig, camera: Camera, joints: NDArray[np.float64], azimuth: float, rng: np.random.Generator
) -> Viewpoint | None:
    """Draws distance, height and aim of a camera at a given bearing.

    Args:
        config: Ranges.
        camera: Intrinsics, which decide what is inside the image.
        joints: (15, 3) the person's joints, world frame [m]; the person faces x.
        azimuth: Bearing of the camera [rad].
        rng: Source of randomness.

    Returns:
        The viewpoint, or None if too few joints are inside its image.
    """
    mounting = mounting_named(config.mounting)
    distance = float(rng.uniform(*(config.distance or mounting.distance)))
    height = float(rng.uniform(*(config.height or mounting.height)))
    is_cropped = rng.random() < CROPPED_SHARE
    aim = rng.normal(0.0, (0.08, 0.08, 0.10))
    roll = float(np.clip(rng.normal(0.0, 0.02), -0.05, 0.05))
    centre = 0.5 * (joints.min(axis=0) + joints.max(axis=0))
    eye = np.array([centre[0] + distance * np.cos(azimuth), centre[1] + distance * np.sin(azimuth), height])
    pitch = float(np.clip(np.arctan((height - centre[2] - aim[2]) / distance), *mounting.pitch))
    target = np.array([centre[0] + aim[0], centre[1] + aim[1], height - distance * np.tan(pitch)])
    viewpoint = Viewpoint(look_at(eye, target, roll), azimuth, distance)
    in_camera = transform_points(inverse(viewpoint.T_world_camera), joints)
    n_inside = _n_inside(camera, in_camera, 0.0 if is_cropped else BORDER)
    return viewpoint if n_inside >= (MIN_JOINTS_INSIDE if is_cropped else len(joints)) else None


def _n_inside(camera: Camera, joints: NDArray[np.float64], border: float) -> int:
    z = joints[:, 2]
    u, v = camera.project(np.where(z[:, None] > 0.1, joints, (0.0, 0.0, 1.0))).T
    is_inside = (
        (u >= border) & (u <= camera.width - 1 - border) & (v >= border) & (v <= camera.height - 1 - border)
    )
    return int(np.count_nonzero(is_inside & (z > 0.1)))
