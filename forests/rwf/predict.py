"""Joints from a depth image and a place to start: a random walk forest that is ready to be asked."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from forests.boxes import Box
from forests.calibration import probability_of
from forests.estimate import JointEstimate, JointVotes
from forests.frames import Pinhole, check_depth
from forests.rwf.evidence import OUTCOMES, TERMS, write_terms
from forests.rwf.model import Limbs, RWFModel, WalkPlan
from forests.rwf.skeleton import fit_limbs
from forests.rwf.start import start_point
from forests.rwf.tables import WalkTables, walk_tables
from forests.rwf.walk import walk_joint, walk_skeleton
from forests.skeleton.answers import edges_of
from forests.skeleton.decoded import decoded


class Walked(NamedTuple):
    """Where walks ended, and what they saw.

    Attributes:
        ends: (n_joints, n_ends, 4) float32: modes of the votes, camera frame [m], and their shares of the votes'
            weight, falling; NaN and 0 where there are no more.
        said: (n_joints, 3) float32, of the votes: standard deviation about the first ends [m], mean weight (the
            higher, the surer the leaves), share that lies outside the image.
        terms: (n_joints, n_terms) float64, what the probabilities are regressed on.
        confidence: (n_joints, n_ends) float32, see `rank`.
        probability: (n_outcomes, n_joints) float32, of what is in `OUTCOMES`; NaN = not calibrated.
    """

    ends: NDArray[np.float32]
    said: NDArray[np.float32]
    terms: NDArray[np.float64]
    confidence: NDArray[np.float32]
    probability: NDArray[np.float32]


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
        self,
        image: NDArray[np.uint16],
        camera: Pinhole,
        box: Box | None = None,
        *,
        start: ArrayLike | None = None,
        edges: NDArray[np.float32] | None = None,
    ) -> JointEstimate:
        """Walks to every joint, each on its own; arguments and errors as of `predict`.

        The image may be said to end elsewhere than it does: `edges`, (4,) float32, are its left, top, right and
        bottom edge as slopes x / z and y / z.
        """
        point = start_point(image, camera, start, box)
        if point is None:
            return _nothing(len(self.model.joints), self.model.config.n_proposals, camera)
        walked = self.walk(image, camera, point, edges)
        within, hidden, outside = walked.probability
        places, spread = walked.ends[:, :, :3], walked.said[:, 0]
        return JointEstimate(places, walked.confidence, within, hidden, spread, camera, outside)

    def walk(
        self,
        depth: NDArray[np.uint16],
        camera: Pinhole,
        start: NDArray[np.float32],
        edges: NDArray[np.float32] | None = None,
    ) -> Walked:
        """Walks to every joint from a start point, (3,) float32, camera frame [m]; edges as of `predict_joints`."""
        model = self.model
        n = len(model.joints)
        if edges is None:
            edges = edges_of(depth.shape, camera)
        walked = Walked(
            np.empty((n, model.config.n_proposals, 4), np.float32),
            np.empty((n, 3), np.float32),
            np.empty((n, len(TERMS)), np.float64),
            np.empty((n, model.config.n_proposals), np.float32),
            np.empty((len(OUTCOMES), n), np.float32),
        )
        intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
        _walk(
            depth, intrinsics, edges, self._tables, model.plan, model.limbs, model.weights, start,
            model.config.seed, self.is_limbs_fitted, walked,
        )  # fmt: skip
        return walked

    def joint_votes(
        self, joint: int, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None = None
    ) -> JointVotes:
        """The votes of the walkers to one joint, and their modes; see `forests.estimate.VoteTeller`."""
        image, plan, config = check_depth(np.asarray(depth)), self.model.plan, self.model.config
        place = start_point(image, camera, None, box)
        way = [joint]
        while plan.start_from[way[-1]] >= 0:
            way.append(int(plan.start_from[way[-1]]))
        votes = np.empty((plan.n_walks.max() * plan.n_steps * self._tables.vote.shape[1], 4), np.float32)
        ends = np.full((config.n_proposals, 4), np.nan, np.float32)
        intrinsics, n = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32), 0
        for step in reversed(way) if place is not None else ():
            n = walk_joint(image, intrinsics, self._tables, plan, step, config.seed, place, votes, ends)
            place = ends[0, :3].copy()
        cast, found = votes[:n], ends[np.isfinite(ends[:, 2])]
        return JointVotes(cast[:, :3], cast[:, 3], np.zeros(n, bool), found[:, :3], found[:, 3])


@njit(cache=True, nogil=True)
def _walk(
    depth: np.ndarray, intrinsics: np.ndarray, edges: np.ndarray, tables: WalkTables, plan: WalkPlan, limbs: Limbs,
    weights: np.ndarray, start: np.ndarray, seed: int, is_limbs_fitted: bool, out: Walked,
) -> None:  # fmt: skip
    """Walks, fits limbs, and says how probable the ends are: one call, since many small ones cost more."""
    walk_skeleton(depth, intrinsics, tables, plan, start, seed, edges, out.ends, out.said)
    n_outcomes, n_joints, _ = weights.shape
    if is_limbs_fitted:
        joints = np.empty((n_joints, 3), np.float32)
        joints[:] = out.ends[:, 0, :3]
        fit_limbs(joints, plan.order, limbs.parent, limbs.length_m)
        out.ends[:, 0, :3] = joints
    write_terms(out.ends, out.said, limbs.parent, depth, intrinsics, edges, out.terms)
    for joint in range(n_joints):
        for k in range(n_outcomes):
            out.probability[k, joint] = probability_of(weights[k, joint], out.terms[joint])
        rank(out.ends[joint, :, 3], out.probability[0, joint], out.confidence[joint])


@njit(cache=True, nogil=True)
def rank(share: np.ndarray, within: float, confidence: np.ndarray) -> None:
    """Confidences of one joint's proposals that may be compared between frames.

    The first proposal's is its probability of being within 10 cm, and the others divide what is left of it by their
    shares. Of a joint without a probability they are the shares.

    Args:
        share: (n_proposals,) float32, falling, 0 where missing.
        within: NaN = not told.
        confidence: (n_proposals,) float32 to fill, falling, 0 where missing.
    """
    is_told = not np.isnan(within)
    confidence[0] = within if is_told else share[0]
    factor = (1.0 - within) / share.sum() if is_told else 1.0
    for k in range(1, len(share)):
        confidence[k] = min(share[k] * np.float32(factor), confidence[0])


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
