"""make_body: the closed, labelled, weighted skin of a BodySpec in the bind pose."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.body import Body
from synth.bodies.frame_points import BIND_ANGLES, bind_points, skeleton_of
from synth.bodies.measures import MEASURE_IDX, mix_of, profiles
from synth.bodies.segments import LAYOUT, POINT_IDX, Axes, axes_through, lay_skin, table_view
from synth.bodies.shape import BodySpec
from synth.bodies.skeleton import Skeleton
from synth.bodies.template import Template, mirrored_vertices, template
from synth.geometry import LabelledMesh

DENSITY = 1010.0
"""Mean density of a body with air in its lungs [kg/m^3] (Durnin & Womersley 1974 give 1000-1075 without)."""
UPRIGHT = ("ankle_height", "shank", "thigh", "pelvis_to_lumbar", "lumbar_to_thorax", "thorax_to_neck",
           "neck_to_head", "head_up")  # fmt: skip
"""Measures that add up to the height of the head's centre."""


class Figure(NamedTuple):
    """A body between its measures and its skin.

    Attributes:
        measures: (n_measures,) [m].
        skeleton: Its hinges.
        points: (n_points, 3) its axis points in the bind pose.
        axes: Its axes through them.
        table: (table_size,) float32 radii [m].
    """

    measures: NDArray[np.float64]
    skeleton: Skeleton
    points: NDArray[np.float64]
    axes: Axes
    table: NDArray[np.float32]


@njit(cache=True, nogil=True)
def enclosed_volume(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> float:
    """Volume inside a closed surface, by the divergence theorem [m^3]."""
    total = 0.0
    for f in range(faces.shape[0]):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        total += (
            a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
        )
    return total / 6.0


def figure_of(spec: BodySpec, heaviness: float) -> Figure:
    """Lengths and naked radii at a heaviness.

    Args:
        spec: The person.
        heaviness: 0 is the reference's average, 1 its heaviest, -1 its lightest; beyond is extrapolated.
    """
    mix = mix_of(spec.sex, spec.age, 0.0, 0.0)
    weights = mix.base + (mix.heavy * heaviness if heaviness > 0 else mix.light * heaviness)
    measures = weights @ profiles().lengths
    table = weights @ profiles().radii
    top = measures[[MEASURE_IDX[name] for name in UPRIGHT]].sum() + table_view(table, "head")[0].mean()
    scale = spec.stature / top
    measures, table = measures * scale, (table * scale).astype(np.float32)
    skeleton = skeleton_of(measures)
    points = bind_points(skeleton, measures, spec.stature)
    return Figure(measures, skeleton, points, axes_through(points), table)


def laid(figure: Figure, skin: Template) -> NDArray[np.float64]:
    """(n_vertices, 3) float64 the skin of a figure, root frame [m]."""
    half = np.empty((len(skin.segment), 3))
    lay_skin(figure.axes, LAYOUT, figure.table, skin.segment, skin.share, skin.coords, half)
    sole = figure.points[POINT_IDX["ankle"], 2] - figure.measures[MEASURE_IDX["ankle_height"]]
    half[:, 2] = np.maximum(half[:, 2], sole)
    return mirrored_vertices(skin, half)


def make_body(spec: BodySpec) -> Body:
    """Builds a person, ready to be posed; no randomness.

    Args:
        spec: The measures.
    """
    skin = template("template")
    figure = solved_figure(spec, skin)
    mesh = LabelledMesh(laid(figure, skin).astype(np.float32), skin.faces, skin.face_label, is_closed=True)
    return Body(spec, figure.skeleton, mesh, BIND_ANGLES, skin.weights)


def solved_figure(spec: BodySpec, skin: Template) -> Figure:
    """The figure whose naked volume has the person's mass, by the secant rule on heaviness.

    Args:
        spec: The person.
        skin: The naked template.
    """

    def mass_at(heaviness: float) -> tuple[float, Figure]:
        figure = figure_of(spec, heaviness)
        return DENSITY * enclosed_volume(laid(figure, skin), skin.faces), figure

    low, high = -1.2, 2.2
    heaviness = 0.0
    for _ in range(12):
        mass, figure = mass_at(heaviness)
        if abs(mass - spec.mass) < 0.004 * spec.mass:
            break
        if mass < spec.mass:
            low = heaviness
        else:
            high = heaviness
        slope = 0.75 * spec.mass if heaviness > 0 else 0.4 * spec.mass
        heaviness = float(
            np.clip(heaviness + (spec.mass - mass) / slope, 0.9 * low + 0.1 * high, 0.1 * low + 0.9 * high)
        )
    return figure
