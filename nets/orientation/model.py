"""A trained orientation net: its settings and its weights, as plain arrays."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nets.orientation.angles import von_mises_within
from nets.orientation.config import OrientationConfig

Array = NDArray[np.float64]
PROBABLE_RAD = np.pi / 8.0
"""Probabilities are told that an angle is right to this [rad]: half a sector of eight."""


class Calibration(NamedTuple):
    """How the net's concentration is read: kappa = exp(offset + slope * told), but for a share of outliers.

    Attributes:
        offset: Of the logarithm.
        slope: Of the logarithm.
        outliers: Share of the angles that are anywhere on the circle.
    """

    offset: float = 0.0
    slope: float = 1.0
    outliers: float = 0.0

    def concentration(self, told: NDArray[np.floating]) -> Array:
        """(n,) kappa out of the logarithms (n,) that the net puts out."""
        return np.exp(np.clip(self.offset + self.slope * np.asarray(told, np.float64), -5.0, 8.0))

    def probability(self, told: NDArray[np.floating], reach: float = PROBABLE_RAD) -> Array:
        """(n,) that the angle is right to `reach` [rad]."""
        inside = von_mises_within(reach, self.concentration(told))
        return np.asarray((1.0 - self.outliers) * inside + self.outliers * reach / np.pi)


@dataclass(frozen=True)
class OrientationModel:
    """A trained net.

    Attributes:
        config: How it was trained.
        weights: Arrays by the name of the torch module's parameter or buffer.
        calibration: How its concentration is read.
    """

    config: OrientationConfig
    weights: dict[str, np.ndarray]
    calibration: Calibration = field(default_factory=Calibration)
