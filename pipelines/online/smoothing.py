"""Skeletons of one track over time, in the frame of reference of the floor, so that the camera may move."""

import numpy as np
from numpy.typing import NDArray

from forests.smoothing import SkeletonSmoother, SmoothingConfig
from pipelines.online.messages import NS, SkeletonResult, TrackSkeleton

FORGOTTEN_S = 0.5
"""A joint that was not found, or a person who was not analysed, for so long is not guessed at any more [s]."""


class SkeletonFilter:
    """Smooths the answers of one module about one track."""

    def __init__(self, config: SmoothingConfig | None = None) -> None:
        self._smoother = SkeletonSmoother(config or SmoothingConfig())
        self._stamp: int | None = None
        self._unseen = np.empty(0)

    def update(self, result: SkeletonResult, T_floor_camera: NDArray[np.float64], frame_id: str) -> TrackSkeleton:
        """Takes an answer, later than the last one.

        Args:
            result: In the camera's frame of reference.
            T_floor_camera: (4, 4) float64, the camera in the frame of reference of the floor.
            frame_id: Name of the latter.
        """
        seconds = np.inf if self._stamp is None else (result.stamp - self._stamp) / NS
        self._stamp = result.stamp
        if not 0 < seconds <= FORGOTTEN_S:
            self._smoother.reset()
            self._unseen = np.full(len(result.joints), np.inf)
        found = result.positions @ T_floor_camera[:3, :3].T + T_floor_camera[:3, 3]
        places = self._smoother.update(found, np.nan_to_num(result.confidence, nan=1.0), seconds)
        is_found = np.isfinite(found).all(axis=1)
        self._unseen = np.where(is_found, 0.0, self._unseen + seconds)
        places[self._unseen > FORGOTTEN_S] = np.nan
        return TrackSkeleton(
            result.stamp,
            frame_id,
            result.track_id,
            result.module,
            result.joints,
            places,
            result.confidence,
            result.deviation,
            result.hidden,
        )
