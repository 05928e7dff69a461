"""The page: the depth cloud on the floor, people with number and heading, skeletons, and the planner's choices."""

from collections import Counter
from typing import Any

import numpy as np

from pipelines.errors import UserError
from pipelines.online.messages import CameraFrame, CameraPose, Plan, TrackedPersons, TrackSkeleton
from pipelines.online.ros.camera import cloud_points
from pipelines.online.ros.markers import bone_points, track_colour

CLOUD_STEP = 3
"""Every so many rows and columns of the image are shown."""
HIDDEN = 0.5
"""Joints that are hidden with at least this probability are drawn hollow."""
JOINT_M = 0.03
"""Radius of a joint [m]."""
HEADING_M = 0.5
"""Length of the line that shows where somebody goes [m]."""


class Page:
    """Shows messages; `bus.subscribe(object, page.take)`.

    Attributes:
        address: Where a browser finds it.
    """

    def __init__(self, port: int = 8080) -> None:
        """Serves the page on this machine alone.

        Raises:
            UserError: viser is not installed.
        """
        try:
            import viser
        except ImportError:
            raise UserError(
                "the viewer needs viser, which is not installed; install it with: pip install 'undergrowth[viewer]'"
            ) from None
        self._server = viser.ViserServer(host="127.0.0.1", port=port, verbose=False)
        self.address = f"http://127.0.0.1:{self._server.get_port()}"
        self._server.scene.set_up_direction("+z")
        self._server.scene.add_grid("/floor", width=12.0, height=12.0, plane="xy")
        self._server.initial_camera.position = (-2.0, 0.0, 3.0)
        self._server.initial_camera.look_at = (3.0, 0.0, 0.8)
        self._text = self._server.gui.add_markdown("no image yet")
        self._frame: CameraFrame | None = None
        self._shown: dict[int, list[Any]] = {}
        self._skeletons: dict[tuple[int, str], list[Any]] = {}

    def take(self, message: object) -> None:
        """Shows a message."""
        if isinstance(message, CameraFrame):
            self._frame = message
        elif isinstance(message, CameraPose):
            self._show_cloud(message)
        elif isinstance(message, TrackedPersons):
            self._show_people(message)
        elif isinstance(message, TrackSkeleton):
            self._show_skeleton(message)
        elif isinstance(message, Plan):
            self._show_plan(message)

    def close(self) -> None:
        """Serves no more."""
        self._server.stop()

    def _show_cloud(self, pose: CameraPose) -> None:
        if self._frame is None or self._frame.stamp != pose.stamp:
            return
        points = cloud_points(self._frame, CLOUD_STEP)
        shade = np.clip(1.0 - points[:, 2:] / 8.0, 0.15, 0.85) * np.ones(3)
        T = pose.T_floor_camera
        world = (points @ T[:3, :3].T + T[:3, 3]).astype(np.float32)
        self._server.scene.add_point_cloud("/cloud", world, (255 * shade).astype(np.uint8), point_size=0.015)

    def _show_people(self, told: TrackedPersons) -> None:
        gone = set(self._shown) - {one.track_id for one in told.persons}
        for track_id in gone:
            _remove(self._shown.pop(track_id))
            for key in [key for key in self._skeletons if key[0] == track_id]:
                _remove(self._skeletons.pop(key))
        scene = self._server.scene
        for one in told.persons:
            top = 1.7 if np.isnan(one.height) else one.height
            x, y = one.place
            speed = float(np.linalg.norm(one.velocity))
            ahead = HEADING_M * one.velocity / max(speed, 0.5)
            lines = np.array([[(x, y, 0.02), (x, y, top)], [(x, y, 0.05), (x + ahead[0], y + ahead[1], 0.05)]])
            colour = _colour(one.track_id)
            name = f"/people/{one.track_id}"
            self._shown[one.track_id] = [
                scene.add_line_segments(
                    name,
                    lines.astype(np.float32),
                    np.broadcast_to(colour, (2, 2, 3)),
                    thickness=3.0,
                    thickness_units="screen",
                ),
                scene.add_label(f"/numbers/{one.track_id}", str(one.track_id), position=(x, y, top + 0.15)),
            ]

    def _show_skeleton(self, told: TrackSkeleton) -> None:
        if told.track_id not in self._shown:
            return
        _remove(self._skeletons.pop((told.track_id, told.module), []))
        scene, name = self._server.scene, f"/skeletons/{told.module}/{told.track_id}"
        colour, bones = _colour(told.track_id), np.array(bone_points(told), np.float32).reshape(-1, 2, 3)
        handles: list[Any] = []
        if len(bones):
            handles.append(
                scene.add_line_segments(
                    f"{name}/bones",
                    bones,
                    np.broadcast_to(colour, bones.shape),
                    thickness=4.0,
                    thickness_units="screen",
                )
            )
        for joint, xyz, hidden in zip(told.joints, told.positions, told.hidden, strict=True):
            if np.isfinite(xyz).all():
                handles.append(
                    scene.add_icosphere(
                        f"{name}/{joint}",
                        radius=JOINT_M,
                        color=tuple(colour.tolist()),
                        wireframe=bool(hidden >= HIDDEN),
                        position=tuple(xyz.tolist()),
                    )
                )
        self._skeletons[told.track_id, told.module] = handles

    def _show_plan(self, plan: Plan) -> None:
        asked = ", ".join(f"{one.module} {one.track_id}" for one in plan.requests) or "nobody"
        reasons = Counter(skip.reason for skip in plan.skips)
        skipped = "".join(f"\n- {n} skipped: {reason}" for reason, n in reasons.most_common())
        self._text.content = f"time {plan.stamp / 1e9:.2f} s\n\nasked about: {asked}\n{skipped}"


def _colour(track_id: int) -> np.ndarray:
    """(3,) uint8 red, green and blue of a track."""
    return (255 * np.array(track_colour(track_id))).astype(np.uint8)


def _remove(handles: list[Any]) -> None:
    for handle in handles:
        handle.remove()
