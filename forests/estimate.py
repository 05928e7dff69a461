"""What finds joints, and what it answers: the contract that every forest keeps and every user may rely on."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from forests.frames import Pinhole


@dataclass(frozen=True)
class JointEstimate:
    """The joints of one person in one depth image. A joint without any vote is NaN with confidence 0.

    Attributes:
        proposals: (n_joints, n_proposals, 3) float32, camera frame [m], most confident first; NaN if missing.
        proposal_confidence: (n_joints, n_proposals) float32, falling, 0 where missing; comparable between frames.
        probability: (n_joints,) float32, calibrated, that `joints` is within 10 cm; NaN if not calibrated.
        hidden_probability: (n_joints,) float32, calibrated, that an object hides the joint; NaN if not calibrated.
        spread: (n_joints,) float32, standard deviation of what the joint was averaged from [m].
        camera: Intrinsics, for the projection.
        outside_probability: (n_joints,) float32, calibrated, that the joint is not in the image; NaN if not
            calibrated.
        self_hidden_probability: (n_joints,) float32, calibrated, that the person's own body hides the joint; NaN if
            not told.
        heading: Which way the person faces, about the camera's y axis: 0 = towards the camera, pi / 2 = towards the
            image's right [rad]; NaN if not estimated.
        heading_probability: That the heading is right to 75 degrees; NaN if not estimated.
        alternative: The skeleton of the second likeliest heading, if it is worth a thought.
        body_share: Share of the voting pixels that seem to show a person; NaN if the forest does not tell.
        person_probability: Calibrated, that a person is in the image; NaN if not calibrated.
    """

    proposals: NDArray[np.float32]
    proposal_confidence: NDArray[np.float32]
    probability: NDArray[np.float32]
    hidden_probability: NDArray[np.float32]
    spread: NDArray[np.float32]
    camera: Pinhole
    outside_probability: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))
    self_hidden_probability: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))
    heading: float = math.nan
    heading_probability: float = math.nan
    alternative: "JointEstimate | None" = None
    body_share: float = math.nan
    person_probability: float = math.nan

    def __post_init__(self) -> None:
        for name in ("outside_probability", "self_hidden_probability"):
            if not len(getattr(self, name)):
                object.__setattr__(self, name, np.full(len(self.spread), np.nan, np.float32))

    @property
    def joints(self) -> NDArray[np.float32]:
        """(n_joints, 3) float32, the first proposals, camera frame [m]."""
        return self.proposals[:, 0]

    @property
    def confidence(self) -> NDArray[np.float32]:
        """(n_joints,) float32, of the first proposals."""
        return self.proposal_confidence[:, 0]

    @property
    def joints_2d(self) -> NDArray[np.float32]:
        """(n_joints, 2) float32, pixels (u, v)."""
        camera, xyz = self.camera, self.joints
        u = camera.fx * xyz[:, 0] / xyz[:, 2] + camera.cx
        v = camera.fy * xyz[:, 1] / xyz[:, 2] + camera.cy
        return np.stack([u, v], axis=1).astype(np.float32)


class JointPredictor(Protocol):
    """What finds the joints of one person in a depth image; it may be asked from several threads at once."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that it answers, in the order of every answer."""
        ...

    @property
    def box_joints(self) -> tuple[str, ...]:
        """Joints about which a box should lie that it is told of; empty = it looks everywhere by itself."""
        ...

    def predict(self, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None = None) -> JointEstimate:
        """Finds the joints.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Intrinsics.
            box: Where the person is; None = not known.

        Raises:
            ValueError: No depth image, or an empty box.
        """
        ...


@runtime_checkable
class PixelLabeller(Protocol):
    """What tells for every pixel what it shows."""

    @property
    def classes(self) -> tuple[str, ...]:
        """Names of the classes."""
        ...

    def label_pixels(self, depth: NDArray[np.uint16], camera: Pinhole) -> NDArray[np.uint8]:
        """(height, width) uint8: number of the class in `classes`, plus 1; 0 where there is no depth."""
        ...


class JointVotes(NamedTuple):
    """The votes for one joint of the person in an image.

    Attributes:
        points: (n, 3) float32, where votes say that the joint is, camera frame [m].
        weight: (n,) float32, above 0; comparable within an image.
        is_hider: (n,) bool, cast by pixels of what may hide the person, not by the person's own.
        modes: (n_modes, 3) float32, where votes gather, most first [m].
        share: (n_modes,) float32, the forest's confidence in each, falling.
    """

    points: NDArray[np.float32]
    weight: NDArray[np.float32]
    is_hider: NDArray[np.bool_]
    modes: NDArray[np.float32]
    share: NDArray[np.float32]


@runtime_checkable
class VoteTeller(Protocol):
    """A model that tells what its answers come from."""

    def joint_votes(
        self, joint: int, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None = None
    ) -> JointVotes:
        """The votes for a joint.

        Args:
            joint: Its number among those that the model answers.
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Intrinsics.
            box: Where the person is; None = not known.

        Raises:
            ValueError: No depth image, or an empty box.
        """
        ...
