"""A random walk forest as an estimator: trained from frames, asked with a depth image and where the person is."""

from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import expit

from forests.estimate import JointEstimate
from forests.estimator import Estimator, hold_out
from forests.frames import FrameSequence, Pinhole, check_depth
from forests.rwf.config import RWFConfig
from forests.rwf.model import RWFModel, walk_tables
from forests.rwf.skeleton import fit_limbs
from forests.rwf.start import Box, start_point
from forests.rwf.train import train_rwf
from forests.rwf.walk import walk_skeleton

SPREAD_M = 0.1
"""Confidence is exp(-spread / this) [m]."""


class Walker:
    """A trained forest, ready to be asked.

    Attributes:
        model: The forest.
        is_limbs_fitted: Whether estimates are moved so that limbs have possible lengths.
    """

    def __init__(self, model: RWFModel, is_limbs_fitted: bool = True) -> None:
        self.model = model
        self.is_limbs_fitted = is_limbs_fitted
        self._tables = walk_tables(model.experts, model.plan.n_clusters)

    def predict(
        self, depth: ArrayLike, camera: Pinhole, start: ArrayLike | None = None, box: Box | None = None
    ) -> JointEstimate:
        """Walks to every joint.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Intrinsics.
            start: A pixel (u, v) on the person or a point (x, y, z) in the camera frame [m].
            box: (left, top, right, bottom) [px] around the upper body or the person; walks start in its middle.
                Without box and start: around all that the image shows.

        Raises:
            ValueError: No depth image, or both start and box, or one of another form.
        """
        image = check_depth(np.asarray(depth))
        n = len(self.model.joints)
        point = start_point(image, camera, start, box)
        if point is None:
            nothing = np.full((n, 3), np.nan, np.float32)
            return _estimate(nothing, np.full(n, np.inf, np.float32), np.zeros(n, np.float32), camera)
        joints, spread = self.walk(image, camera, point)
        weights = self.model.within_weights
        probability = expit(weights[:, 0] + weights[:, 1] * spread)
        return _estimate(joints, spread, probability, camera)

    def walk(
        self, depth: NDArray[np.uint16], camera: Pinhole, start: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Joints (n_joints, 3), camera frame, and spreads (n_joints,) from a start point, float32 [m]."""
        model = self.model
        n = len(model.joints)
        joints, spread = np.empty((n, 3), np.float32), np.empty(n, np.float32)
        intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
        walk_skeleton(depth, intrinsics, self._tables, model.plan, start, model.config.seed, joints, spread)
        if self.is_limbs_fitted:
            fit_limbs(joints, model.plan.order, model.limbs.parent, model.limbs.length_m)
        return joints, spread


def _estimate(
    joints: NDArray[np.float32], spread: NDArray[np.float32], probability: NDArray[np.float32], camera: Pinhole
) -> JointEstimate:
    return JointEstimate(
        joints[:, None],
        np.exp(-spread[:, None] / np.float32(SPREAD_M)),
        probability,
        np.full(len(joints), np.nan, np.float32),
        spread,
        camera,
    )


class RandomWalkForest(Estimator):
    """Finds joints by walking from a start point, as an estimator of scikit-learn's kind.

    Attributes:
        config: How it is trained and asked.
        n_threads: Threads for training.
        model_: The trained forest, after `fit`.
    """

    def __init__(self, config: RWFConfig = RWFConfig(), n_threads: int = 1) -> None:  # noqa: B008 frozen
        self.config = config
        self.n_threads = n_threads

    def fit(self, frames: FrameSequence, validation: FrameSequence | None = None) -> Self:
        """Trains on frames.

        Args:
            frames: Training frames, such as a `FrameBatch`.
            validation: Frames to tune on; None holds out every tenth training frame, if there are as many.

        Raises:
            ValueError: No frames, or joints that they do not have.
        """
        if validation is None:
            frames, validation = hold_out(frames)
        self.model_ = train_rwf(frames, self.config, validation=validation, n_threads=self.n_threads)
        self._walker = Walker(self.model_)
        return self

    def predict(
        self, depth: ArrayLike, camera: Pinhole, start: ArrayLike | None = None, box: Box | None = None
    ) -> JointEstimate:
        """Finds the joints of the person at `start` or in `box`; see `Walker.predict`.

        Raises:
            ValueError: Not fitted yet, no depth image, or both start and box.
        """
        if not hasattr(self, "_walker"):
            raise ValueError("this forest is not fitted yet: call fit first")
        return self._walker.predict(depth, camera, start, box)
