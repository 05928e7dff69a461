"""Skeletons of one track over time, in the frame of reference of the floor, so that the camera may move."""

import numpy as np
from numpy.typing import NDArray

from forests.smoothing import PersonSmoother, SmoothingConfig
from pipelines.online.messages import NS, SkeletonResult, TrackSkeleton


class SkeletonFilter:
    """Smooths the answers of one module about one track."""

    def __init__(self, config: SmoothingConfig | None = None) -> None:
        self._smoother = PersonSmoother(config or SmoothingConfig())
        self._stamp: int | None = None

    def update(self, result: SkeletonResult, T_floor_camera: NDArray[np.float64], frame_id: str) -> TrackSkeleton:
        """Takes an answer, later than the last one.

        Args:
            result: In the camera's frame of reference.
            T_floor_camera: (4, 4) float64, the camera in the frame of reference of the floor.
            frame_id: Name of the latter.
        """
        seconds = np.inf if self._stamp is None else (result.stamp - self._stamp) / NS
        self._stamp = result.stamp
        found = result.positions @ T_floor_camera[:3, :3].T + T_floor_camera[:3, 3]
        return TrackSkeleton(
            result.stamp,
            frame_id,
            result.track_id,
            result.module,
            result.joints,
            self._smoother.update(found, result.confidence, seconds),
            result.confidence,
            result.deviation,
            result.hidden,
        )
