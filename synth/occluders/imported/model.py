"""From a mesh as read to a model of the library."""

from dataclasses import dataclass

import numpy as np

from synth.occluders.imported.boxes import fill_with_boxes
from synth.occluders.imported.shape import MeshError, Triangles, cleaned, is_closed, reduced
from synth.occluders.imported.sizes import SIZES, TO_UPRIGHT, UNITS, find_unit_and_up
from synth.occluders.imported.users import fitted
from synth.occluders.meshlib import MeshModel

AXES = ("x", "-x", "y", "-y", "z", "-z")


@dataclass(frozen=True)
class Hints:
    """What is known of a mesh; None is to be found.

    Attributes:
        unit: "m", "cm", "mm" or "inch".
        up: "x", "y" or "z".
        forward: The axis of the file, such as "-z", that the thing's user looks along.
    """

    unit: str | None = None
    up: str | None = None
    forward: str | None = None

    def __post_init__(self) -> None:
        known = {"unit": tuple(UNITS), "up": tuple(TO_UPRIGHT), "forward": AXES}
        for name, names in known.items():
            value = getattr(self, name)
            if value is not None and value not in names:
                raise MeshError(f"{name}={value!r} is unknown, known are {', '.join(names)}")


def make_model(
    mesh: Triangles,
    name: str,
    class_name: str,
    split: str,
    hints: Hints,
    usual_up: str,
    usual_unit: str | None = None,
) -> MeshModel:
    """Makes an occluder out of a mesh.

    Args:
        mesh: As in the file.
        name: What it is called in the library.
        class_name: Its class.
        split: The split it belongs to.
        hints: What is known of it.
        usual_up: The axis that it probably has up, by its file or format.
        usual_unit: The unit that it probably is in, by its file.

    Raises:
        MeshError: It cannot be used.
    """
    if class_name not in SIZES:
        raise MeshError(f"is of unknown class {class_name!r}, known are {', '.join(SIZES)}")
    clean = cleaned(mesh)
    unit, up = find_unit_and_up(clean, class_name, hints.unit, hints.up, usual_up, usual_unit)
    upright = reduced(clean.turned(TO_UPRIGHT[up], UNITS[unit]))
    forward = None
    if hints.forward is not None:
        axis = np.zeros(3)
        axis["xyz".index(hints.forward[-1])] = -1.0 if hints.forward[0] == "-" else 1.0
        forward = TO_UPRIGHT[up] @ axis
        if abs(forward[2]) > 0.5:
            raise MeshError(f"forward={hints.forward!r} is along its up axis {up}")
    fit = fitted(upright, class_name, forward)
    return MeshModel(
        name=name,
        class_name=class_name,
        role=fit.role,
        split=split,
        frame=f"{unit}, {up} up",
        anchors=fit.anchors,
        vertices=fit.mesh.vertices.astype(np.float32),
        faces=fit.mesh.faces.astype(np.int32),
        boxes=fill_with_boxes(fit.mesh),
        is_closed=is_closed(fit.mesh),
    )
