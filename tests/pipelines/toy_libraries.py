"""Small libraries of poses and objects, as `undergrowth import` makes them out of recordings and meshes."""

import numpy as np

from synth.bodies.poses.library import FOOT_FLAT, PoseLibrary, Trial
from synth.occluders.imported.model import make_model
from synth.occluders.imported.shape import Triangles
from synth.occluders.imported.sizes import Hints, Said
from synth.occluders.meshlib import MeshLibrary
from tests.mocap_files import SIT, STAND

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
"""Of a box of size 1."""
FACES = np.array([
    (0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
])  # fmt: skip
"""Of it, turned outwards."""


def poses_of(split: str) -> PoseLibrary:
    """Someone who stands, and sits."""
    return PoseLibrary(
        "mocap",
        (Trial("01_01", "01", split, "01_01.bvh"),),
        np.array([STAND, SIT], np.float32),
        np.array([np.eye(3)] * 2, np.float32),
        np.array([False, True]),
        np.full((2, 2), FOOT_FLAT, np.uint8),
        np.zeros(2, np.int32),
        np.arange(2, dtype=np.int32),
        {},
    )


def objects_of(split: str) -> MeshLibrary:
    """A table on four legs."""
    boxes = [((0.0, 0.0, 0.72), (1.2, 0.8, 0.03))]
    boxes += [((x, y, 0.0), (0.05, 0.05, 0.72)) for x in (0.0, 1.15) for y in (0.0, 0.75)]
    vertices = np.concatenate([np.array(low) + CORNERS * np.array(size) for low, size in boxes])
    faces = np.concatenate([FACES + 8 * k for k in range(len(boxes))])
    model, _ = make_model(Triangles(vertices, faces), "four_legs", "table", split, Hints(), Said("z"))
    return MeshLibrary((model,), {"seed": 0})
