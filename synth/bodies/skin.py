"""make_body: the closed, labelled, weighted skin of a BodySpec in the bind pose."""

from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body, SkinWeights
from synth.bodies.shape import BodySpec
from synth.bodies.skeleton import Lengths, make_skeleton
from synth.geometry import LabelledMesh


@cache
def _template() -> dict[str, NDArray]:
    with np.load(str(files("synth.bodies") / "data" / "crude.npz")) as data:
        return dict(data)


def make_body(spec: BodySpec) -> Body:
    """Builds a person, ready to be posed; no randomness.

    Args:
        spec: The measures.
    """
    data = _template()
    vertices = (data["vertices"] * spec.stature).astype(np.float32)
    mesh = LabelledMesh(vertices, data["faces"], data["face_label"], is_closed=True)
    weights = SkinWeights(data["indptr"], data["link"], data["weight"])
    skeleton = make_skeleton(Lengths.of_stature(spec.stature))
    return Body(spec, skeleton, mesh, data["bind_angles"], weights)
