"""What every occluder generator gives out: a mesh, its solids for distances, and where people touch it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from synth.geometry import LabelledMesh


@dataclass(frozen=True)
class Solids:
    """Convex primitives that fill an object, for distances between it and a person.

    Attributes:
        kind: (n,) uint8, one of BOX, CYLINDER, CAPSULE.
        T_object_solid: (n, 4, 4) float64; the solid is centred at its own origin, its axis along z.
        size: (n, 3) float64 [m]. BOX: half extents. CYLINDER: (radius, radius, half height).
            CAPSULE: (radius, radius, half length between the centres of its caps).
    """

    kind: NDArray[np.uint8]
    T_object_solid: NDArray[np.float64]
    size: NDArray[np.float64]


BOX = 0
CYLINDER = 1
CAPSULE = 2


@dataclass(frozen=True)
class Anchor:
    """A named place on an object where something stands, sits or holds on.

    Attributes:
        name: "top" (a surface that things stand on, hands and forearms rest on), "seat", "backrest",
            "handle_left", "handle_right", "keyboard_left", "keyboard_right", "base". Further places of the
            same sort carry a number: a sofa's "seat_2" and "backrest_2".
        T_object_anchor: (4, 4). Surfaces: origin at the surface's centre, z its outward normal, x the user's
            forward; a backrest's z points to the sitter's forward, its x up along it. A base is the underside,
            but its z points up, so that T_world_top is T_world_base. Handles:
            origin at the grip's axis, y along the bar to the user's left, x forward.
        size: (length along x, length along y) of the surface, or (diameter, length) of a grip [m].
        shape: "rectangle" or "ellipse".
    """

    name: str
    T_object_anchor: NDArray[np.float64]
    size: tuple[float, float]
    shape: str = "rectangle"


@dataclass(frozen=True)
class Occluder:
    """An object in its own frame: floor at z = 0, x = forward of the person who uses it, y to their left.

    A chair's sitter looks along x. A table's or laptop's user stands on its -x side and looks along x: a
    laptop's hinge and screen are at +x. A stroller rolls along x, its handle at -x.

    Attributes:
        class_name: Name in `OCCLUDER_CLASSES`.
        mesh: Surface with face_label 0 everywhere.
        solids: Its volume as primitives, within 1 cm of the mesh.
        anchors: Places that people and things touch.
    """

    class_name: str
    mesh: LabelledMesh
    solids: Solids
    anchors: tuple[Anchor, ...] = field(default=())

    def anchor(self, name: str) -> Anchor:
        """The anchor of that name.

        Raises:
            KeyError: The object has none; the message lists what it has.
        """
        for anchor in self.anchors:
            if anchor.name == name:
                return anchor
        raise KeyError(f"{self.class_name} has no anchor {name!r}, only {[a.name for a in self.anchors]}")
