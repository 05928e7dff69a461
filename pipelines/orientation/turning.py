"""One generated person seen from all around, as figure 2 of Beyer et al. 2015 shows a person who turns on the spot."""

import numpy as np
from numpy.typing import NDArray

from nets.orientation.config import Region
from nets.orientation.frames import OrientedFrame, Patches, Truth, collect_patches
from nets.views import View
from pipelines.orientation.frames import region_box
from pipelines.orientation.truths import head_angles, head_rotations, headings

CAMERA = "kinect_v2"
DISTANCE_M, HEIGHT_M, LOOK_AT_M = 2.4, 1.5, 1.0
"""Of the camera from the person, over the floor, and of the point that it looks at."""
_FAMILY = "standing"


class TurningPerson:
    """Images of a person who stands still, from cameras on a circle; the truth is that of body or head.

    A camera that walks round a person sees what one camera sees of a person who turns the other way round.
    """

    def __init__(self, seed: int, n_views: int, region: Region, sensor: str | None) -> None:
        """Draws the person.

        Args:
            seed: Of the person, and of the sensor's noise.
            n_views: Cameras, evenly spread over the circle.
            region: body or head.
            sensor: Sensor model for the depth; None = clean.
        """
        from synth import draw_arms, draw_base, make_body, posed_mesh, sample_body

        rng = np.random.default_rng(seed)
        self._body = make_body(sample_body(rng))
        pose = None
        while pose is None:
            pose = draw_arms(_FAMILY, self._body, draw_base(_FAMILY, self._body, rng), rng)
        self._pose, self._skin = pose, posed_mesh(self._body, pose)
        self._seed, self._n_views, self._region, self._sensor = seed, n_views, region, sensor

    def __len__(self) -> int:
        return self._n_views

    def __getitem__(self, view: int, /) -> OrientedFrame:
        from synth import apply_sensor, camera_named, joint_positions
        from synth.geometry import inverse, look_at, transform_points
        from synth.render.backends import renderer

        camera = camera_named(CAMERA)
        turn = 2.0 * np.pi * view / self._n_views
        root = self._pose.T_world_root[:3, 3]
        eye = (root[0] + DISTANCE_M * np.cos(turn), root[1] + DISTANCE_M * np.sin(turn), HEIGHT_M)
        T_world_camera = look_at(eye, (root[0], root[1], LOOK_AT_M))
        T_camera_world = inverse(T_world_camera)
        pair = renderer("numba", camera).render(T_camera_world, self._skin)
        depth = pair.body_depth
        if self._sensor is not None:
            depth = apply_sensor(self._sensor, depth, camera, np.random.default_rng([self._seed, view]))
        joints = transform_points(T_camera_world, joint_positions(self._body.skeleton, self._pose))
        box = region_box(self._region, joints.astype(np.float32), camera)
        assert box is not None
        kind = (pair.body_part > 0).astype(np.uint8)
        return OrientedFrame(depth, kind, camera, box, self._truth(T_world_camera, joints[0]))

    def _truth(self, T_world_camera: NDArray[np.float64], head: NDArray[np.float64]) -> Truth:
        T_world_root = self._pose.T_world_root[None]
        if self._region == "body":
            return Truth(float(headings(T_world_root, T_world_camera[None])[0]), np.nan, np.nan, 0)
        R_world_head = head_rotations(self._pose.angles[None], T_world_root)
        R_camera_head = T_world_camera[None, :3, :3].transpose(0, 2, 1) @ R_world_head
        pan, tilt, roll = head_angles(R_camera_head, head[None])[0].tolist()
        return Truth(pan, tilt, roll, -1)


def turning_patches(seed: int, n_views: int, region: Region, view: View, sensor: str | None) -> Patches:
    """Patches of a person seen from all around, in order; arguments as of `TurningPerson`."""
    return collect_patches(TurningPerson(seed, n_views, region, sensor), region, view)
