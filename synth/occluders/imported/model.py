"""From a mesh as read to a model of the library."""

import numpy as np

from synth.occluders.imported.boxes import fill_with_boxes
from synth.occluders.imported.shape import MeshError, Triangles, cleaned, is_closed, reduced
from synth.occluders.imported.sizes import SIZES, TO_UPRIGHT, UNITS, Frame, Hints, Said, find_frame
from synth.occluders.imported.users import fitted
from synth.occluders.meshlib import MeshModel


def make_model(
    mesh: Triangles, name: str, class_name: str, split: str, hints: Hints, said: Said
) -> tuple[MeshModel, Frame]:
    """Makes an occluder out of a mesh.

    Args:
        mesh: As in the file.
        name: What it is called in the library.
        class_name: Its class.
        split: The split it belongs to.
        hints: What the user says of it.
        said: What its file says of it.

    Returns:
        The model, and the frame that its file is in.

    Raises:
        MeshError: It cannot be used.
    """
    if class_name not in SIZES:
        raise MeshError(f"is of unknown class {class_name!r}, known are {', '.join(SIZES)}")
    clean = cleaned(mesh)
    frame = find_frame(clean, class_name, hints, said)
    upright = reduced(clean.turned(TO_UPRIGHT[frame.up], UNITS[frame.unit]))
    forward = None
    if frame.forward is not None:
        axis = np.zeros(3)
        axis["xyz".index(frame.forward[-1])] = -1.0 if frame.forward[0] == "-" else 1.0
        forward = TO_UPRIGHT[frame.up] @ axis
        if abs(forward[2]) > 0.5:
            raise MeshError(f"forward={frame.forward!r} is along its up axis {frame.up}")
    fit = fitted(upright, class_name, forward)
    model = MeshModel(
        name=name,
        class_name=class_name,
        role=fit.role,
        split=split,
        frame=f"{frame.unit}, {frame.up} up",
        anchors=fit.anchors,
        vertices=fit.mesh.vertices.astype(np.float32),
        faces=fit.mesh.faces.astype(np.int32),
        boxes=fill_with_boxes(fit.mesh),
        is_closed=is_closed(fit.mesh),
    )
    return model, frame
