"""Where a recorded camera and person are in the world, as far as recordings tell."""

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.vocabulary import JOINT_NAMES

_R_SHOULDER, _L_SHOULDER = JOINT_NAMES.index("r_shoulder"), JOINT_NAMES.index("l_shoulder")
_TRUNK = [JOINT_NAMES.index(name) for name in ("torso", "r_hip", "l_hip")]


def camera_pose(height_m: float, tilt_deg: float) -> NDArray[np.float64]:
    """(4, 4) T_world_camera: above the world's origin, looking along x, turned down by the tilt."""
    c, s = np.cos(np.radians(tilt_deg)), np.sin(np.radians(tilt_deg))
    T = np.eye(4)
    T[:3, :3] = np.array([[0.0, -s, c], [-1.0, 0.0, 0.0], [0.0, -c, -s]])
    T[2, 3] = height_m
    return T


def person_pose(
    depth: NDArray[np.uint16], places: NDArray[np.float64], camera: Camera, T_world_camera: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(4, 4) T_world_root, upright: at the hips, else amid the points; facing as the shoulders, else the camera.

    Args:
        depth: (height, width) uint16, the person [mm].
        places: (15, 3) joints and guides, camera frame [m]; NaN where unknown.
        camera: Intrinsics.
        T_world_camera: (4, 4).
    """
    trunk = places[_TRUNK]
    if np.isfinite(trunk).all():
        centre = trunk[1:].mean(axis=0)
    else:
        v, u = np.nonzero(depth)
        centre = np.median(camera.backproject(np.stack([u, v], axis=1), depth[v, u] * 1e-3), axis=0)
    across = T_world_camera[:3, :3] @ (places[_L_SHOULDER] - places[_R_SHOULDER])
    across[2] = 0.0
    length = np.linalg.norm(across)
    left = across / length if length > 1e-6 else np.array([0.0, -1.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    T = np.eye(4)
    T[:3, :3] = np.stack([np.cross(left, up), left, up], axis=1)
    T[:3, 3] = (T_world_camera @ np.append(centre, 1.0))[:3]
    return T
