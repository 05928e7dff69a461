"""Which way a person faces, as an arrow on the ground as seen from above the person."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.drawing import palette
from pipelines.drawing.palette import Picture

LENGTH = 0.14
"""Of an arrow, as a share of the picture's height."""
FORESHORTENING = 0.45
"""The ground is seen from aslant: arrows towards the camera and away from it are drawn shorter."""


def draw_heading(picture: Picture, place: NDArray[np.float64], angle: float, probability: float = 1.0) -> None:
    """Draws an arrow in place: down = towards the camera, right = towards the image's right.

    Args:
        picture: (height, width, 3) BGR.
        place: (2,) where the arrow begins [px].
        angle: 0 = towards the camera, pi / 2 = towards the image's right [rad].
        probability: That the angle is about right; arrows of less than a half, or of NaN, are drawn thin.
    """
    length = LENGTH * len(picture)
    tip = place + length * np.array([math.sin(angle), FORESHORTENING * math.cos(angle)])
    begin, end = (tuple(round(float(value)) for value in point) for point in (place, tip))
    thick = 3 if probability >= 0.5 else 1
    axes = (round(length * 0.6), round(length * 0.6 * FORESHORTENING))
    for extra, colour in ((3, palette.OUTLINE), (0, palette.BLUISH_GREEN)):
        cv2.ellipse(picture, begin, axes, 0.0, 0.0, 360.0, colour, 1 + extra, cv2.LINE_AA)
        cv2.arrowedLine(picture, begin, end, colour, thick + extra, cv2.LINE_AA, tipLength=0.35)
