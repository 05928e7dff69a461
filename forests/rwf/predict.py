"""Joints from a depth image and a place to start: a random walk forest that is ready to be asked."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forests.boxes import Box
from forests.calibration import logistic
from forests.estimate import JointEstimate
from forests.frames import Pinhole, check_depth
from forests.rwf.model import RWFModel, walk_tables
from forests.rwf.skeleton import fit_limbs
from forests.rwf.start import start_point
from forests.rwf.walk import walk_skeleton
from forests.skeleton.decoded import decoded

SPREAD_M = 0.1
"""Confidence is exp(-spread / this) [m]."""


class Predictor:
    """A trained forest, ready to be asked.

    Attributes:
        model: The forest.
        is_limbs_fitted: Whether estimates are moved so that limbs have possible lengths.
    """

    def __init__(self, model: RWFModel, is_limbs_fitted: bool = True) -> None:
        self.model = model
        self.is_limbs_fitted = is_limbs_fitted
        self._tables = walk_tables(model.experts, model.plan.n_clusters)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every answer."""
        return self.model.joints

    @property
    def box_joints(self) -> tuple[str, ...]:
        """Joints about which a box should lie for walks to start in its middle."""
        return self.model.config.box_joints

    def predict(
        self, depth: ArrayLike, camera: Pinhole, box: Box | None = None, *, start: ArrayLike | None = None
    ) -> JointEstimate:
        """Walks to every joint, and makes one skeleton of them, if the forest has learned of skeletons.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Intrinsics.
            box: (left, top, right, bottom) [px] around the upper body or the person; walks start in its middle.
                Without box and start: around all that the image shows.
            start: A pixel (u, v) on the person or a point (x, y, z) in the camera frame [m], instead of a box.

        Raises:
            ValueError: No depth image, or both start and box, or one of another form.
        """
        image = check_depth(np.asarray(depth))
        estimate = self.predict_joints(image, camera, box, start=start)
        skeleton = self.model.skeleton
        return estimate if skeleton is None else decoded(skeleton, estimate, image.shape, 1)

    def predict_joints(
        self, image: NDArray[np.uint16], camera: Pinhole, box: Box | None = None, *, start: ArrayLike | None = None
    ) -> JointEstimate:
        """Walks to every joint, each on its own; arguments and errors as of `predict`."""
        n = len(self.model.joints)
        point = start_point(image, camera, start, box)
        if point is None:
            nothing = np.full((n, 3), np.nan, np.float32)
            return _estimate(nothing, np.full(n, np.inf, np.float32), np.zeros(n, np.float32), camera)
        joints, spread = self.walk(image, camera, point)
        terms = np.stack([np.ones(n), spread.astype(np.float64)], axis=1)
        probability = logistic(self.model.within_weights, terms)
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
