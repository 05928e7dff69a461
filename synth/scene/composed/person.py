"""A recorded person as furniture sees them: points of the seen surface, and the unseen body behind it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.frame import Frame
from synth.geometry import inverse, thinned, transform_points
from synth.vocabulary import PART_NAMES

STEP = 0.03
"""Distance between points that stand for the unseen body [m]."""
FRONTAL = np.radians(110.0)
"""A person turned away from the camera by more does not look at what stands before it."""


def _thickness(name: str) -> float:
    """How far a part of the body reaches behind its seen surface [m]."""
    _, _, limb = name.rpartition("_")
    by_limb = {
        "torso": 0.20, "head": 0.16, "neck": 0.10, "shoulder": 0.12, "leg": 0.12, "knee": 0.10, "ankle": 0.09,
        "foot": 0.10, "arm": 0.08, "elbow": 0.08, "wrist": 0.05, "hand": 0.05, "background": 0.0,
    }  # fmt: skip
    return by_limb[limb]


THICKNESS: NDArray[np.float64] = np.array([_thickness(name) for name in PART_NAMES])
"""(32,) by part label, a slim adult's, rounded down: a depth image shows one side, and furniture must not
stand in the other [m]."""


@dataclass(frozen=True)
class RecordedPerson:
    """A person in the scene frame: the origin on the floor beneath them, x towards the camera, z up.

    Attributes:
        surface: (n, 3) every point of the recorded depth [m].
        body: (m, 3) these, and points behind them along the ray as far as the body reaches [m].
        facing: Where the person looks; 0 is the camera, positive to the left [rad].
        T_world_scene: (4, 4).
        T_camera_scene: (4, 4).
    """

    surface: NDArray[np.float64]
    body: NDArray[np.float64]
    facing: float
    T_world_scene: NDArray[np.float64]
    T_camera_scene: NDArray[np.float64]

    @property
    def is_frontal(self) -> bool:
        """Whether the person looks towards the camera rather than away."""
        return abs(self.facing) < FRONTAL


def person_of(
    frame: Frame, T_world_camera: NDArray[np.float64], T_world_root: NDArray[np.float64]
) -> RecordedPerson:
    """The person of a frame that shows one.

    Args:
        frame: The frame; its body layer counts.
        T_world_camera: (4, 4), the ground plane z = 0 of this world being the floor.
        T_world_root: (4, 4) pose of the body's root; its x axis points forward.
    """
    v, u = np.nonzero(frame.body_depth)
    in_camera = frame.camera.backproject(np.stack([u, v], axis=1), frame.body_depth[v, u] * 1e-3)
    seen = transform_points(T_world_camera, in_camera)
    T_world_scene = _scene_frame(seen, T_world_camera)
    T_scene_world = inverse(T_world_scene)
    T_scene_camera = T_scene_world @ T_world_camera
    surface = transform_points(T_scene_camera, in_camera)
    rays = surface - T_scene_camera[:3, 3]
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    behind = _behind(surface, rays, THICKNESS[frame.body_part[v, u]])
    forward = T_scene_world[:3, :3] @ T_world_root[:3, 0]
    return RecordedPerson(
        surface=surface,
        body=np.concatenate([surface, behind]),
        facing=float(np.arctan2(forward[1], forward[0])),
        T_world_scene=T_world_scene,
        T_camera_scene=inverse(T_scene_camera),
    )


def _scene_frame(seen: NDArray[np.float64], T_world_camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """T_world_scene: beneath the middle of the points, turned so that x points to the camera."""
    middle = np.median(seen, axis=0)
    x, y = T_world_camera[:2, 3] - middle[:2]
    norm = float(np.hypot(x, y))
    c, s = (x / norm, y / norm) if norm > 1e-6 else (1.0, 0.0)
    return np.array([[c, -s, 0.0, middle[0]], [s, c, 0.0, middle[1]], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def _behind(
    surface: NDArray[np.float64], rays: NDArray[np.float64], thickness: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(m, 3) points at steps behind a surface along the rays, thinned to cells of a step."""
    out = [np.empty((0, 3))]
    for depth in np.arange(STEP, THICKNESS.max() + 0.5 * STEP, STEP):
        is_deep = thickness >= depth - 1e-9
        out.append(thinned(surface[is_deep] + depth * rays[is_deep], STEP))
    return thinned(np.concatenate(out), STEP)
