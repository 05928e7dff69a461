"""Joints from a depth image: a regression forest that is ready to be asked."""

import copy
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box, inside_crop
from forests.calibration import logistic
from forests.crops import crop_image
from forests.estimate import JointEstimate, JointVotes
from forests.frames import Hints, Pinhole, check_depth
from forests.oarf.descend import asked_of, check_hints, descend, flatten, leaves_with_hints, with_hints
from forests.oarf.evidence import Evidence, pixels_of, terms
from forests.oarf.model import OARFModel
from forests.oarf.peaks import find_peaks
from forests.oarf.vote import Votes, VoteTable, cast, choose_voters, vote_table
from forests.skeleton.answers import N_CANDIDATES
from forests.skeleton.decoded import decoded, decoded_facing
from forests.skeleton.heading import facing_towards


class Voters(NamedTuple):
    """Pixels that vote, and the crop that they lie in.

    Attributes:
        pixels: (height * width,) uint16 crop with a border [mm].
        width: Columns of the crop.
        height: Rows of the crop.
        left: Column in the image of the crop's first column.
        top: Row in the image of the crop's first row.
        columns: (n,) int32 in the crop.
        rows: (n,) int32 in the crop.
        stands_for: Foreground pixels to a voter.
        hints: What is told of the image beside depth.
    """

    pixels: NDArray[np.uint16]
    width: int
    height: int
    left: int
    top: int
    columns: NDArray[np.int32]
    rows: NDArray[np.int32]
    stands_for: float
    hints: Hints


class _Reached(NamedTuple):
    """An image whose voters have reached their leaves (n_trees, n), and their points (n, 3) [m]."""

    image: NDArray[np.uint16]
    camera: Pinhole
    voters: Voters
    leaves: NDArray[np.int32]
    points: NDArray[np.float32]


class Predictor:
    """A forest packed for prediction; it does not change, so that threads may share it.

    Attributes:
        model: The forest that was packed.
    """

    def __init__(self, model: OARFModel) -> None:
        """Packs a forest.

        Raises:
            ValueError: A damaged forest.
        """
        self.model = model
        leaves = [tree.leaves for tree in model.trees]
        hints = [tree.hints for tree in model.trees]
        self._trees = flatten([tree.nodes for tree in model.trees], [table.n_leaves for table in leaves], hints)
        self._asked, self._told = asked_of(self._trees), Hints()
        self._context = Predictor(model.context) if model.context else None
        self._table = vote_table(leaves, model.tuning.max_offset_m)
        self._probability = np.concatenate([table.probabilities() for table in leaves])
        self._body_probability = self._probability[:, : model.classes.n_parts].sum(axis=1)
        self._bandwidth = np.ascontiguousarray(model.tuning.bandwidth_m, np.float32)

    @property
    def asks_for_hints(self) -> bool:
        """Whether its trees were told more than depth, and must be in every prediction."""
        return any(self._asked) and self._context is None

    def given(self, hints: Hints | None) -> "Predictor":
        """The forest for one image of which more than depth is told; itself, if its trees ask for no hints."""
        if not self.asks_for_hints:
            return self
        told = copy.copy(self)
        told._told = hints or Hints()
        return told

    def predict(
        self,
        depth: NDArray[np.uint16],
        camera: Pinhole,
        box: Box | None = None,
        n_pixels: int | None = None,
        n_proposals: int = 3,
    ) -> JointEstimate:
        """Finds the joints of the one person in an image: as one skeleton, if the forest has learned of skeletons.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing; no mask of the person is needed.
            camera: Intrinsics.
            box: Where pixels may vote; what lies outside the image is cut off. None = everywhere.
            n_pixels: Pixels that vote; None = as the forest was configured.
            n_proposals: Proposals given per joint.

        Raises:
            ValueError: No depth image, an empty box, or a count below 1.
        """
        skeleton = self.model.skeleton
        if skeleton is None:
            return self.predict_joints(depth, camera, box, n_pixels, n_proposals)
        _check_proposals(n_proposals)
        reached = self._reach(depth, camera, box, n_pixels)

        def ask(heading: float) -> JointEstimate:
            return self._estimate(reached, max(n_proposals, N_CANDIDATES), heading)

        if self.reads_headings:
            return decoded_facing(skeleton, ask, depth.shape, n_proposals)
        return decoded(skeleton, ask(math.nan), depth.shape, n_proposals)

    def predict_joints(
        self,
        depth: NDArray[np.uint16],
        camera: Pinhole,
        box: Box | None = None,
        n_pixels: int | None = None,
        n_proposals: int = 3,
        heading: float = math.nan,
    ) -> JointEstimate:
        """Finds the joints one by one, as the modes of their votes; arguments and errors as of `predict`.

        Votes are weighed by the heading [rad], if one is given and the forest's leaves have learned headings.
        """
        _check_proposals(n_proposals)
        return self._estimate(self._reach(depth, camera, box, n_pixels), n_proposals, heading)

    @property
    def reads_headings(self) -> bool:
        """Whether votes can be weighed by a person's heading."""
        return len(self._table.facing) > 0

    def _estimate(self, reached: "_Reached", n_proposals: int, heading: float) -> JointEstimate:
        camera = reached.camera
        proposals, evidence = self._examine(reached, n_proposals, heading)
        tuning, values = self.model.tuning, terms(evidence)
        within = logistic(tuning.within_weights, values)
        within[(evidence.confidence[:, 0] == 0) & ~np.isnan(within)] = 0.0
        hidden = logistic(tuning.hidden_weights, values)
        return JointEstimate(
            proposals,
            evidence.confidence,
            within,
            hidden,
            evidence.spread,
            camera,
            heading=heading,
            body_share=self._body_share(reached.leaves),
        )

    def examine(
        self,
        depth: NDArray[np.uint16],
        camera: Pinhole,
        box: Box | None = None,
        n_pixels: int | None = None,
        n_proposals: int = 3,
    ) -> tuple[NDArray[np.float32], Evidence]:
        """The proposals (n_joints, n_proposals, 3) [m], and what speaks for them; arguments as for `predict`."""
        _check_proposals(n_proposals)
        return self._examine(self._reach(depth, camera, box, n_pixels), n_proposals, math.nan)

    def _reach(
        self, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None, n_pixels: int | None
    ) -> "_Reached":
        image = check_depth(depth)
        voters = self._choose(image, camera, box, n_pixels)
        return _Reached(image, camera, voters, self._descend(voters, camera), _points(voters, camera))

    def _body_share(self, leaves: NDArray[np.int32]) -> float:
        """Mean probability of body parts at the leaves; NaN without pixels, and where all classes are parts."""
        if leaves.size == 0 or self.model.classes.n_classes == self.model.classes.n_parts:
            return math.nan
        return float(self._body_probability[leaves].mean())

    def _examine(
        self, reached: "_Reached", n_proposals: int, heading: float
    ) -> tuple[NDArray[np.float32], Evidence]:
        image, camera, voters, leaves, points = reached
        votes = cast(self._table, leaves, points, facing_towards(heading))
        n_joints = len(self._bandwidth)
        proposals = np.empty((n_joints, n_proposals, 3), np.float32)
        density = np.empty((n_joints, n_proposals), np.float32)
        spread, share = np.empty(n_joints, np.float32), np.empty(n_joints, np.float32)
        find_peaks(
            votes.votes, votes.n_votes, self._table.n_layers, self._bandwidth, proposals, density, spread, share
        )
        pixel_area = voters.stands_for / (camera.fx * camera.fy * len(self._trees.roots))
        behind, is_occluder = self._look_at(proposals[:, 0], image, voters, camera)
        return proposals, Evidence(density * np.float32(pixel_area), spread, share, behind, is_occluder)

    def collect_votes(
        self, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None = None, n_pixels: int | None = None
    ) -> Votes:
        """The votes of all joints before mean shift, arguments as for `predict`; weights are w_ljk D(q)^2."""
        return cast(self._table, *self.reach_leaves(depth, camera, box, n_pixels))

    def joint_votes(
        self, joint: int, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None = None
    ) -> JointVotes:
        """The votes for one joint, and its modes; see `forests.estimate.VoteTeller`."""
        votes, n, layers = *self.collect_votes(depth, camera, box), self._table.n_layers
        streams = range(joint * layers, (joint + 1) * layers)
        cast_ = np.concatenate([votes[stream, : n[stream]] for stream in streams])
        is_hider = np.repeat(np.arange(layers) > 0, n[streams.start : streams.stop])
        proposals, evidence = self.examine(depth, camera, box)
        is_there = np.isfinite(proposals[joint, :, 2])
        modes, share = proposals[joint][is_there], evidence.confidence[joint][is_there]
        return JointVotes(cast_[:, :3], cast_[:, 3], is_hider, modes, share)

    def reach_leaves(
        self, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None = None, n_pixels: int | None = None
    ) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """The voting pixels' leaves (n_trees, n), numbered through all trees, and points (n, 3) [m]."""
        reached = self._reach(depth, camera, box, n_pixels)
        return reached.leaves, reached.points

    def class_probabilities(self, depth: NDArray[np.uint16], camera: Pinhole) -> NDArray[np.float32]:
        """Classes of all pixels.

        Returns:
            (height, width, n_classes) float32, the mean of the trees; 0 where there is no depth.
        """
        image = check_depth(depth)
        out = np.zeros((*image.shape, self._probability.shape[1]), np.float32)
        voters, mean = self._probabilities(image, camera)
        out[voters.rows + voters.top, voters.columns + voters.left] = mean
        return out

    def _probabilities(self, image: NDArray[np.uint16], camera: Pinhole) -> tuple[Voters, NDArray[np.float32]]:
        """All pixels with depth, and the classes (n, n_classes) of each, the mean of the trees."""
        voters = self._choose(image, camera, None, image.size)
        leaves = self._descend(voters, camera)
        mean = np.zeros((len(voters.rows), self._probability.shape[1]), np.float32)
        for of_tree in leaves:
            mean += self._probability[of_tree]
        return voters, mean / np.float32(len(leaves))

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every answer."""
        return self.model.labels.joints

    @property
    def box_joints(self) -> tuple[str, ...]:
        """None: pixels everywhere vote."""
        return ()

    @property
    def classes(self) -> tuple[str, ...]:
        """Names of the classes that pixels are labelled with."""
        return self.model.classes.names

    @property
    def table(self) -> VoteTable:
        """The votes of the leaves."""
        return self._table

    def label_pixels(self, depth: NDArray[np.uint16], camera: Pinhole) -> NDArray[np.uint8]:
        """(height, width) uint8: the likeliest class + 1 of every pixel with depth, 0 elsewhere."""
        image = check_depth(depth)
        out = np.zeros(image.shape, np.uint8)
        voters, mean = self._probabilities(image, camera)
        out[voters.rows + voters.top, voters.columns + voters.left] = mean.argmax(axis=1) + 1
        return out

    def hints_of(self, depth: NDArray[np.uint16], camera: Pinhole) -> Hints:
        """What a forest that learns after this one is told of an image: `label_pixels`, where all body parts are 1."""
        beyond = np.maximum(self.label_pixels(depth, camera), self.model.classes.n_parts)
        named = beyond - np.uint8(self.model.classes.n_parts - 1)
        return Hints(named * (np.asarray(depth) > 0))

    def _occluder_probability(self, leaves: NDArray[np.int32]) -> NDArray[np.float32]:
        """(n_trees, n) float32 of leaves (n_trees, n)."""
        return np.asarray(self._probability[leaves][..., self.model.classes.n_parts :].sum(axis=-1))

    def _choose(self, image: NDArray[np.uint16], camera: Pinhole, box: Box | None, n_pixels: int | None) -> Voters:
        n = self.model.config.n_voting_pixels if n_pixels is None else n_pixels
        if n < 1:
            raise ValueError(f"n_pixels={n} must be at least 1")
        hints = self._told
        if self._context is not None:
            hints = self._context.hints_of(image, camera)
        check_hints(self._asked, hints, image.shape)
        crop = crop_image(image, camera)
        width, height = int(crop.width[0]), int(crop.height[0])
        left, top = int(crop.origin[0, 0]), int(crop.origin[0, 1])
        inside = inside_crop(box, left, top, width, height)
        columns, rows, stands_for = choose_voters(crop.pixels, width, *inside, n)
        return Voters(crop.pixels, width, height, left, top, columns, rows, stands_for, hints)

    def _descend(self, voters: Voters, camera: Pinhole) -> NDArray[np.int32]:
        leaves = np.empty((len(self._trees.roots), len(voters.columns)), np.int32)
        pixels, width, height, _, _, columns, rows, _, hints = voters
        if any(self._asked):
            crop = with_hints(pixels, width, height, voters.left, voters.top, camera, hints)
            return leaves_with_hints(self._trees, crop, columns, rows)
        fx, fy = np.float32(camera.fx), np.float32(camera.fy)
        descend(pixels, width, height, columns, rows, fx, fy, self._trees.nodes, self._trees.roots, leaves)
        return leaves

    def _look_at(
        self, joints: NDArray[np.float32], image: NDArray[np.uint16], voters: Voters, camera: Pinhole
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(behind, occluder_probability) of `Evidence`: what the surface at the joints' pixels says."""
        behind, is_occluder = np.full((2, len(joints)), np.nan, np.float32)
        place = pixels_of(joints, camera, image.shape)
        seen = np.flatnonzero(place >= 0)
        seen = seen[image.reshape(-1)[place[seen]] > 0]
        row, column = np.divmod(place[seen], image.shape[1])
        behind[seen] = joints[seen, 2] - image[row, column] * np.float32(1e-3)
        at = voters._replace(
            columns=(column - voters.left).astype(np.int32), rows=(row - voters.top).astype(np.int32)
        )
        is_occluder[seen] = self._occluder_probability(self._descend(at, camera)).mean(axis=0)
        return behind, is_occluder


def _check_proposals(n_proposals: int) -> None:
    if n_proposals < 1:
        raise ValueError(f"n_proposals={n_proposals} must be at least 1")


def _points(voters: Voters, camera: Pinhole) -> NDArray[np.float32]:
    """(n, 3) float32, the voting pixels in the camera frame [m]."""
    z = voters.pixels[voters.rows * voters.width + voters.columns] * np.float32(1e-3)
    x = (voters.columns + np.float32(voters.left - camera.cx)) * z / np.float32(camera.fx)
    y = (voters.rows + np.float32(voters.top - camera.cy)) * z / np.float32(camera.fy)
    return np.stack([x, y, z], axis=1).astype(np.float32)
