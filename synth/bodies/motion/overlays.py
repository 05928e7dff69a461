"""What a person does on top of standing and walking: sitting on a seat for a while, and gestures of arms and head."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Pose
from synth.bodies.motion.curves import Array, eased
from synth.bodies.skeleton import DOF_IDX, DOFS

_ARM_NAMES = ("clavicle", "shoulder", "elbow", "forearm", "wrist", "finger", "thumb")
ARM_DOFS: dict[str, NDArray[np.int64]] = {
    side: np.array(
        [k for k, dof in enumerate(DOFS) if dof.name[:2] == f"{side}_" and dof.name[2:].startswith(_ARM_NAMES)]
    )
    for side in "lr"
}
"""Hinges of each arm and hand, by side."""
HEAD_DOFS: NDArray[np.int64] = np.array([k for k, dof in enumerate(DOFS) if dof.name.startswith(("neck", "head"))])
"""Hinges of neck and head."""
TRUNK_DOFS: NDArray[np.int64] = np.array(
    [k for k, dof in enumerate(DOFS) if dof.name.startswith(("lumbar", "thorax"))]
)
"""Hinges of the trunk."""
GESTURE_DOFS: NDArray[np.int64] = np.concatenate([ARM_DOFS["l"], ARM_DOFS["r"], HEAD_DOFS])
"""Hinges that a gesture moves."""


@dataclass(frozen=True)
class Gesture:
    """Arms and head that go to a pose, stay there, and come back.

    Attributes:
        begin: When they begin to move [s].
        end: When they are back [s].
        moving: How long it takes to get there, and back [s].
        angles: (n_dofs,) the pose; only `GESTURE_DOFS` count [rad].
        swing: (n_dofs,) how far each hinge swings to and fro meanwhile [rad].
        frequency: How often it does [Hz].
    """

    begin: float
    end: float
    moving: float
    angles: Array
    swing: Array
    frequency: float = 0.0

    def share(self, seconds: Array) -> Array:
        """(n,) 0..1, how far the gesture has come at some times."""
        return eased((seconds - self.begin) / self.moving) * (
            1.0 - eased((seconds - self.end + self.moving) / self.moving)
        )

    def blend(self, angles: Array, seconds: Array) -> None:
        """Moves (n, n_dofs) angles of some times to the gesture, in place."""
        share = self.share(seconds)[:, None]
        swung = self.angles + self.swing * np.sin(2.0 * np.pi * self.frequency * (seconds - self.begin))[:, None]
        dofs = GESTURE_DOFS
        angles[:, dofs] += share * (swung[:, dofs] - angles[:, dofs])


@dataclass(frozen=True)
class Sit:
    """A time on a seat.

    Attributes:
        down: When the person begins to sit down; -inf for one who sits from the beginning [s].
        seated: When they sit [s].
        rise: When they begin to get up; inf for one who stays [s].
        up: When they stand [s].
        pose: How they sit, world frame.
    """

    down: float
    seated: float
    rise: float
    up: float
    pose: Pose

    def share(self, seconds: Array) -> Array:
        """(n,) 0..1, how far the person is from standing to sitting."""
        going_down = (
            np.ones(len(seconds))
            if self.down == -np.inf
            else eased((seconds - self.down) / (self.seated - self.down))
        )
        if self.rise == np.inf:
            return going_down
        return np.asarray(np.minimum(going_down, 1.0 - eased((seconds - self.rise) / (self.up - self.rise))))

    def sits(self, seconds: Array) -> NDArray[np.bool_]:
        """(n,) whether the person is on the seat."""
        return (seconds >= self.seated) & (seconds <= self.rise)


def _both(name: str) -> NDArray[np.int64]:
    return np.array([DOF_IDX[f"{side}_{name}"] for side in "lr"])


ELBOWS, SHOULDERS = _both("elbow_flexion"), _both("shoulder_flexion")
ABDUCTIONS, ROTATIONS = _both("shoulder_abduction"), _both("shoulder_rotation")
"""Left and right hinge of each."""
