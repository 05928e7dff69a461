"""make_body: the closed, labelled, weighted skin of a BodySpec in the bind pose."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.body import Body
from synth.bodies.shape.clothes import dressed_table, skirt_table
from synth.bodies.shape.figure import Figure, laid_half, mean_table, solved_figure
from synth.bodies.shape.frame_points import BIND_ANGLES
from synth.bodies.shape.template import SKIRT_EASE, SKIRT_FLARE, Template, mirrored_vertices, template
from synth.bodies.skeleton import DOF_IDX, Skeleton
from synth.bodies.spec import SKIRTS, BodySpec
from synth.geometry import LabelledMesh

N_BODY_ROUNDS = 5
"""How often the body's difference from the mean body is averaged over the skin."""
N_CLOTH_ROUNDS = 3
"""The same for the clothes' thickness, whose hems stay steps."""
_TEMPLATES = {"skirt": "template_skirt", "long_skirt": "template_long_skirt", "coat": "template_skirt"}


@njit(cache=True, nogil=True)
def evened(
    moved: NDArray[np.float64],
    ring_start: NDArray[np.int32],
    ring: NDArray[np.int32],
    ring_weight: NDArray[np.float64],
    n_rounds: int,
) -> NDArray[np.float64]:
    """Averages displacements with their neighbours', half and half.

    Args:
        moved: (n, 3) displacement of each vertex [m].
        ring_start: (n + 1,) CSR starts.
        ring: Neighbours.
        ring_weight: Their weights.
        n_rounds: How often.

    Returns:
        (n, 3) the smooth field.
    """
    old = moved.copy()
    new = moved.copy()
    for _ in range(n_rounds):
        for v in range(old.shape[0]):
            x, y, z = 0.0, 0.0, 0.0
            for e in range(ring_start[v], ring_start[v + 1]):
                w, u = ring_weight[e], ring[e]
                x += w * old[u, 0]
                y += w * old[u, 1]
                z += w * old[u, 2]
            new[v, 0] = 0.5 * old[v, 0] + 0.5 * x
            new[v, 1] = 0.5 * old[v, 1] + 0.5 * y
            new[v, 2] = 0.5 * old[v, 2] + 0.5 * z
        old, new = new, old
    return old


def skin_of(figure: Figure, spec: BodySpec, skin: Template) -> NDArray[np.float64]:
    """The dressed skin.

    The template is smooth over the mean body's radii; what the person's own radii and the clothes add to it is
    averaged over neighbours before it is added.

    Args:
        figure: The body.
        spec: The person.
        skin: The template.

    Returns:
        (n_vertices, 3) float64, bind pose, root frame [m].
    """
    tables = [mean_table() * np.float32(spec.stature), figure.table.copy()]
    for table in tables if spec.bottom in SKIRTS else ():
        skirt_table(table, figure.axes, SKIRT_EASE, SKIRT_FLARE)
    tables.append(dressed_table(figure, spec))
    mean, own, dressed = (laid_half(figure.axes, table, skin) for table in tables)
    rings = (skin.ring_start, skin.ring, skin.ring_weight)
    half = mean + evened(own - mean, *rings, N_BODY_ROUNDS) + evened(dressed - own, *rings, N_CLOTH_ROUNDS)
    half[:, 2] = np.maximum(half[:, 2], figure.sole_height - spec.sole)
    return mirrored_vertices(skin, half)


def on_soles(skeleton: Skeleton, sole: float) -> Skeleton:
    """The skeleton in shoes: the foot's centre follows the thicker sole.

    Args:
        skeleton: Barefoot.
        sole: [m].
    """
    centres = skeleton.joint_offsets.copy()
    centres[13:15, 2] -= 0.25 * sole
    return Skeleton(skeleton.offsets, centres)


def make_body(spec: BodySpec) -> Body:
    """Builds a person, ready to be posed; no randomness.

    Args:
        spec: The measures.
    """
    skin = template(_TEMPLATES.get(spec.bottom, "template"))
    hem = spec.skirt_length + (1.0 if spec.bottom == "long_skirt" else 0.0)
    figure = solved_figure(spec, template("template"), hem)
    vertices = skin_of(figure, spec, skin).astype(np.float32)
    mesh = LabelledMesh(vertices, skin.faces, skin.face_label, is_closed=True)
    return Body(spec, on_soles(figure.skeleton, spec.sole), mesh, BIND_ANGLES.copy(), skin.weights)


def sole_height(body: Body) -> float:
    """How far the soles lie below the ankles' joint centres, shoes included [m].

    Args:
        body: The person.
    """
    toes = body.skeleton.offsets[DOF_IDX["l_toes_extension"]]
    return float(-toes[2] / 0.75 + body.spec.sole)
