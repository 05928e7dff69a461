"""A model asked about recorded depth: walks start on the upper body, which no detector points at."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box, upper_foreground_box
from forests.estimate import JointEstimate
from forests.frames import Pinhole
from pipelines.models.asking import Contestant


def ask(
    contestant: Contestant, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None = None
) -> JointEstimate:
    """The joints of the one person in a depth image.

    Args:
        contestant: The model.
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.
        box: left, top, right, bottom [px] of the person; None = a model that needs a start gets the upper part
            of all that the image shows, others look everywhere.
    """
    told = box
    if told is None and contestant.box_joints:
        told = upper_foreground_box(depth, camera)
    predictor: Any = contestant.predictor
    return predictor.predict(depth, camera, box=told)
