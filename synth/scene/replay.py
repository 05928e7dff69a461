"""Makes the person and the objects of a frame again from what the frame stores."""

import numpy as np

from synth.bodies.body import Body, Pose
from synth.bodies.shape.make import make_body
from synth.bodies.spec import BodySpec
from synth.frame import Frame, ObjectRecord
from synth.occluders import registry
from synth.occluders.meshlib import IMPORTED, MeshLibrary
from synth.occluders.model import Occluder


def person_of(frame: Frame) -> tuple[Body, Pose]:
    """The body and the pose that a frame shows.

    Args:
        frame: The frame, drawn or read from a corpus.

    Returns:
        Body, and pose with angles as stored (float32).
    """
    body = make_body(BodySpec(**frame.info.subject))  # type: ignore[arg-type]
    return body, Pose(frame.angles.astype(np.float64), frame.T_world_root, frame.info.pose_family)


def occluder_of(record: ObjectRecord, library: MeshLibrary | None = None) -> Occluder:
    """An object of a frame, in its own frame.

    Args:
        record: What the frame stores of it.
        library: Where imported objects come from.

    Raises:
        ValueError: The object is imported and the library is missing or lacks it, or its spec is not allowed.
    """
    if record.spec.get("kind") != IMPORTED:
        return registry.make(registry.from_plain(record.spec))
    if library is None:
        raise ValueError(f"{record.spec_id} is imported: the object library that it came from is needed")
    try:
        return library.model(str(record.spec["name"])).occluder
    except KeyError as error:
        raise ValueError(f"{record.spec_id} is not of this library: {error.args[0]}") from None
