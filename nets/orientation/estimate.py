"""What an orientation net answers."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from nets.orientation.config import POSTURES, Region


@dataclass(frozen=True)
class OrientationEstimate:
    """Which way one person faces in one depth image.

    Attributes:
        region: body or head.
        angle: Heading of the body, about the vertical, or pan of the head, about the vertical of the viewing ray: 0 =
            towards the camera, pi / 2 = towards the image's right, -pi..pi [rad].
        concentration: Calibrated kappa of the von Mises distribution about `angle`.
        probability: Calibrated, that the angle is right to 22.5 degrees.
        tilt: Of the head, 0 = along the ray, positive upwards [rad]; NaN of bodies.
        roll: Of the head, positive towards the own right shoulder [rad]; NaN of bodies.
        posture_probability: (n_postures,) float32, of bodies, in the order of `POSTURES`; empty of heads.
    """

    region: Region
    angle: float
    concentration: float
    probability: float
    tilt: float = math.nan
    roll: float = math.nan
    posture_probability: NDArray[np.float32] = field(default_factory=lambda: np.empty(0, np.float32))

    @property
    def posture(self) -> str:
        """Name of the likeliest posture; empty of heads."""
        return POSTURES[int(self.posture_probability.argmax())] if len(self.posture_probability) else ""
