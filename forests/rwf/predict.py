"""Joints from a depth image and a place to start: a random walk forest that is ready to be asked."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forests.boxes import Box
from forests.calibration import logistic
from forests.estimate import JointEstimate
from forests.frames import Pinhole, check_depth
from forests.rwf.evidence import terms
from forests.rwf.model import RWFModel, walk_tables
from forests.rwf.skeleton import fit_limbs
from forests.rwf.start import start_point
from forests.rwf.walk import walk_skeleton
from forests.skeleton.decoded import decoded


class Walked(NamedTuple):
    """Where walks ended.

    Attributes:
        ends: (n_joints, n_ends, 4) float32: modes of the votes, camera frame [m], and their shares of the votes'
            weight, falling; NaN and 0 where there are no more.
        spread: (n_joints,) float32, standard deviations of the votes about the first ends [m].
        weight: (n_joints,) float32, mean weights of the votes: the higher, the surer the leaves.
    """

    ends: NDArray[np.float32]
    spread: NDArray[np.float32]
    weight: NDArray[np.float32]


class Predictor:
    """A trained forest, ready to be asked.

    Attributes:
        model: The forest.
        is_limbs_fitted: Whether first proposals are moved so that limbs have possible lengths.
    """

    def __init__(self, model: RWFModel, is_limbs_fitted: bool = True) -> None:
        self.model = model
        self.is_limbs_fitted = is_limbs_fitted
        self._tables = walk_tables(model.experts)

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
        return (
            estimate
            if skeleton is None
            else decoded(skeleton, estimate, image.shape, self.model.config.n_proposals)
        )

    def predict_joints(
        self, image: NDArray[np.uint16], camera: Pinhole, box: Box | None = None, *, start: ArrayLike | None = None
    ) -> JointEstimate:
        """Walks to every joint, each on its own; arguments and errors as of `predict`."""
        point = start_point(image, camera, start, box)
        if point is None:
            return _nothing(len(self.model.joints), self.model.config.n_proposals, camera)
        walked = self.walk(image, camera, point)
        values = terms(*walked, image, camera)
        within = logistic(self.model.within_weights, values)
        hidden = logistic(self.model.hidden_weights, values)
        confidence = ranked(walked.ends[:, :, 3], within)
        return JointEstimate(walked.ends[:, :, :3], confidence, within, hidden, walked.spread, camera)

    def walk(self, depth: NDArray[np.uint16], camera: Pinhole, start: NDArray[np.float32]) -> Walked:
        """Walks to every joint from a start point, (3,) float32, camera frame [m]."""
        model = self.model
        n = len(model.joints)
        ends = np.empty((n, model.config.n_proposals, 4), np.float32)
        spread, weight = np.empty(n, np.float32), np.empty(n, np.float32)
        intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
        walk_skeleton(depth, intrinsics, self._tables, model.plan, start, model.config.seed, ends, spread, weight)
        if self.is_limbs_fitted:
            joints = np.ascontiguousarray(ends[:, 0, :3])
            fit_limbs(joints, model.plan.order, model.limbs.parent, model.limbs.length_m)
            ends[:, 0, :3] = joints
        return Walked(ends, spread, weight)


def ranked(share: NDArray[np.float32], within: NDArray[np.float32]) -> NDArray[np.float32]:
    """Confidences that may be compared between frames.

    The first proposal's is its probability of being within 10 cm, and the others divide what is left of it by their
    shares. Of a joint without a probability they are the shares.

    Args:
        share: (n_joints, n_proposals) float32, falling, 0 where missing.
        within: (n_joints,) float32; NaN = not told.

    Returns:
        (n_joints, n_proposals) float32, falling, 0 where missing.
    """
    others = share[:, 1:].sum(axis=1) + share[:, 0]
    told = within[:, None]
    confidence = np.where(np.isnan(told), share, share * ((1.0 - told) / others[:, None]))
    confidence[:, 0] = np.where(np.isnan(within), share[:, 0], within)
    return np.minimum(confidence, confidence[:, :1]).astype(np.float32)


def _nothing(n_joints: int, n_proposals: int, camera: Pinhole) -> JointEstimate:
    none = np.zeros(n_joints, np.float32)
    return JointEstimate(
        np.full((n_joints, n_proposals, 3), np.nan, np.float32),
        np.zeros((n_joints, n_proposals), np.float32),
        none,
        np.full(n_joints, np.nan, np.float32),
        np.full(n_joints, np.inf, np.float32),
        camera,
    )
