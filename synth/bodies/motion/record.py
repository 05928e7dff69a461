"""Motion: what one person does over time, as angles, root and contacts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Pose
from synth.bodies.skeleton import N_DOFS
from synth.vocabulary import CONTACT_NAMES


@dataclass(frozen=True)
class Motion:
    """One person's motion, sampled at a rate.

    Attributes:
        rate: Samples a second.
        angles: (n, n_dofs) float64 within the limits [rad].
        T_world_root: (n, 4, 4) float64.
        contacts: (n, n_contacts) bool, what touches, in the order of `CONTACT_NAMES`.
        activity: What the person does at each sample ("walk", "turn", "stand", ...).
    """

    rate: float
    angles: NDArray[np.float64]
    T_world_root: NDArray[np.float64]
    contacts: NDArray[np.bool_]
    activity: tuple[str, ...]

    def __post_init__(self) -> None:
        n = len(self.angles)
        shapes = {"angles": (n, N_DOFS), "T_world_root": (n, 4, 4), "contacts": (n, len(CONTACT_NAMES))}
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name} has shape {getattr(self, name).shape}, must be {shape}")
        if len(self.activity) != n or not self.rate > 0.0:
            raise ValueError(f"{len(self.activity)} activities at rate={self.rate} for {n} samples")

    def __len__(self) -> int:
        return len(self.angles)

    def pose(self, k: int) -> Pose:
        """The pose at a sample."""
        return Pose(self.angles[k], self.T_world_root[k], self.activity[k])
