"""Makes the person of a frame again from what the frame stores."""

import numpy as np

from synth.bodies.body import Body, Pose
from synth.bodies.shape import BodySpec
from synth.bodies.skin import make_body
from synth.frame import Frame


def person_of(frame: Frame) -> tuple[Body, Pose]:
    """The body and the pose that a frame shows; objects come back by `registry.from_plain` of their records.

    Args:
        frame: The frame, drawn or read from a corpus.

    Returns:
        Body, and pose with angles as stored (float32).
    """
    body = make_body(BodySpec(**frame.info.subject))  # type: ignore[arg-type]
    return body, Pose(frame.angles.astype(np.float64), frame.T_world_root, frame.info.pose_family)
