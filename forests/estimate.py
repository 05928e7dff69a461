"""What every forest answers: joints with confidences."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    """

    proposals: NDArray[np.float32]
    proposal_confidence: NDArray[np.float32]
    probability: NDArray[np.float32]
    hidden_probability: NDArray[np.float32]
    spread: NDArray[np.float32]
    camera: Pinhole

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
