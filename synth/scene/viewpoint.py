"""Where the camera stands: bearing, distance, height and aim, within a mounting's ranges."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.geometry import inverse, look_at, transform_points, translation
from synth.render.presets import mounting_named
from synth.scene.config import SceneConfig
from synth.vocabulary import JOINT_NAMES

CROPPED_SHARE = 0.15
"""Share of the viewpoints that may cut a part of the person off."""
MIN_JOINTS_INSIDE = 9
"""A view that cuts the person off still shows this many of the 15 joints."""
FRONTAL_SPREAD = np.radians(45.0)
"""Standard deviation of the bearing of a view near the front [rad]."""
N_FRONTAL_DRAWS = 8
"""Draws near the front before a bearing is drawn evenly: the range may leave the front out."""
NEAR = (0.6, 1.5)
"""Distance of a near view [m]."""
NEAR_AIM = (0.35, 0.15)
"""Mean and standard deviation of how far above the middle of the person a near view aims [m]."""
NEAR_PITCH = np.radians(20.0)
"""A near camera stands at such a height that it looks up or down by at most this [rad]."""
MIN_JOINTS_NEAR = 5
"""A near view shows at least this many of the 15 joints, head and neck among them."""
LEAST_EYE = 0.25
"""A near camera stands at least this high above the floor [m]."""
LEAST_GAP = 0.35
"""No joint is nearer to a near camera than this [m]."""
BORDER = 8.0
"""A view that shows the whole person keeps the joints this far from the border [px]."""

TOP = (2.6, 3.2)
"""Range of the height of a camera that looks straight down [m]; ITOP's (Haque et al. 2016) hung at about 3 m."""
BASELINE = 0.12
"""Distance of the two heads of a stereo pair [m]; ours."""


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
    if config.frontal_share > 0.0 and rng.random() < config.frontal_share:
        low, high = config.azimuth
        for _ in range(N_FRONTAL_DRAWS):
            azimuth = float(rng.normal(0.0, FRONTAL_SPREAD))
            if low <= azimuth <= high:
                return azimuth
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
    if config.near_share > 0.0 and rng.random() < config.near_share:
        return _draw_near(config, camera, joints, azimuth, rng)
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


def _draw_near(
    config: SceneConfig, camera: Camera, joints: NDArray[np.float64], azimuth: float, rng: np.random.Generator
) -> Viewpoint | None:
    """A view of the upper body from near; arguments as of `draw_viewpoint`."""
    least, most = config.distance or (0.0, np.inf)
    low, high = max(NEAR[0], least), min(NEAR[1], most)
    if low > high:
        return None
    distance = float(rng.uniform(low, high))
    centre = 0.5 * (joints.min(axis=0) + joints.max(axis=0))
    head = joints[_UPPER].mean(axis=0)
    rise = float(rng.normal(*NEAR_AIM))
    aim = np.array([head[0], head[1], min(centre[2] + rise, head[2])]) + rng.normal(0.0, (0.06, 0.06, 0.06))
    pitch = float(rng.uniform(-NEAR_PITCH, NEAR_PITCH))
    ahead = np.array([np.cos(azimuth), np.sin(azimuth), np.tan(pitch)])
    eye = aim + distance * ahead
    eye[2] = np.clip(eye[2], *(config.height or (LEAST_EYE, np.inf)))
    if np.linalg.norm(joints - eye, axis=1).min() < LEAST_GAP:
        return None
    roll = float(np.clip(rng.normal(0.0, 0.02), -0.05, 0.05))
    viewpoint = Viewpoint(look_at(eye, aim, roll), azimuth, distance)
    in_camera = transform_points(inverse(viewpoint.T_world_camera), joints)
    is_shown = _n_inside(camera, in_camera[_UPPER], 0.0) == len(_UPPER)
    return viewpoint if is_shown and _n_inside(camera, in_camera, 0.0) >= MIN_JOINTS_NEAR else None


def further_viewpoint(
    config: SceneConfig,
    camera: Camera,
    joints: NDArray[np.float64],
    first: Viewpoint,
    number: int,
    rng: np.random.Generator,
) -> Viewpoint | None:
    """Draws the viewpoint of a further camera of a scene.

    Args:
        config: How many cameras there are, and how they are put up.
        camera: Intrinsics.
        joints: (15, 3) the person's joints, world frame [m].
        first: The first camera.
        number: Of the camera, from 1.
        rng: Source of randomness.

    Returns:
        The viewpoint, or None if too few joints are inside its image.
    """
    if config.rig == "corners":
        azimuth = first.azimuth + 2.0 * np.pi * number / config.cameras + float(rng.normal(0.0, 0.15))
        return draw_viewpoint(replace(config, near_share=0.0), camera, joints, azimuth, rng)
    if config.rig == "stereo":
        return replace(first, T_world_camera=beside(first.T_world_camera))
    middle = 0.5 * (joints.min(axis=0) + joints.max(axis=0))
    T = looking_down(middle[:2], float(rng.uniform(*TOP)), first.T_world_camera)
    in_camera = transform_points(inverse(T), joints)
    is_seen = _n_inside(camera, in_camera, 0.0) >= MIN_JOINTS_INSIDE
    return Viewpoint(T, first.azimuth, 0.0) if is_seen else None


def beside(T_world_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) the right head of a stereo pair, whose left head is given."""
    return T_world_camera @ translation(BASELINE, 0.0, 0.0)


def looking_down(
    place: NDArray[np.float64], height: float, T_world_first: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(4, 4) a camera that looks straight down; up in its image is the way that the first camera looks.

    Args:
        place: (2,) below it [m].
        height: Above the floor [m].
        T_world_first: (4, 4) the first camera.
    """
    x, y = T_world_first[:2, 2] / np.linalg.norm(T_world_first[:2, 2])
    T = np.eye(4)
    T[:3, :3] = np.array([[y, -x, 0.0], [-x, -y, 0.0], [0.0, 0.0, -1.0]])
    T[:3, 3] = (place[0], place[1], height)
    return T


_UPPER = [JOINT_NAMES.index(name) for name in ("head", "neck")]


def _n_inside(camera: Camera, joints: NDArray[np.float64], border: float) -> int:
    z = joints[:, 2]
    u, v = camera.project(np.where(z[:, None] > 0.1, joints, (0.0, 0.0, 1.0))).T
    is_inside = (
        (u >= border) & (u <= camera.width - 1 - border) & (v >= border) & (v <= camera.height - 1 - border)
    )
    return int(np.count_nonzero(is_inside & (z > 0.1)))
