"""From a BodySpec to lengths, axes and naked radii, and the girths that give the person's mass."""

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.shape.frame_points import bind_points, skeleton_of
from synth.bodies.shape.laying import lay_skin
from synth.bodies.shape.measures import MEASURE_IDX, Mix, mix_of, profiles
from synth.bodies.shape.segments import (
    LAYOUT,
    POINT_IDX,
    Axes,
    angles_of,
    axes_through,
    stations_of,
    table_view,
)
from synth.bodies.shape.template import Template, mirrored_vertices
from synth.bodies.skeleton import Skeleton
from synth.bodies.spec import BodySpec

DENSITY = 1010.0
"""Mean density of a living body, air included [kg/m^3]."""
MASS_TOLERANCE = 0.004
"""Relative."""
HEAVINESS_RANGE = (-1.25, 2.4)
UPRIGHT = (
    "ankle_height", "shank", "thigh", "pelvis_to_lumbar", "lumbar_to_thorax", "thorax_to_neck", "neck_to_head",
    "head_up",
)  # fmt: skip
"""Measures that add up to the height of the head's centre."""
# Standard deviations over their means (ANSUR II, Gordon et al. 2014; see `population`).
LEG_SPREAD, ARM_SPREAD, HEAD_SPREAD, SHOULDER_SPREAD, HIP_SPREAD = 0.030, 0.030, 0.025, 0.045, 0.045
UPPER_ARM_FACTOR = 1.125
"""The reference's arms are shorter than people's: shoulder to elbow is 0.142 of the stature, and 0.16 in de Leva
1996 (J. Biomechanics 29, table 4)."""
FOREARM_FACTORS = (1.10, 1.02)
"""Of women and men: elbow to wrist is 0.131 and 0.148 of the stature, against 0.152 and 0.154 in de Leva 1996 and
0.145 in Winter (2009, fig. 4.1), so between the two."""


class Figure(NamedTuple):
    """A body between its measures and its skin.

    Attributes:
        measures: (n_measures,) [m].
        skeleton: Its hinges.
        points: (n_points, 3) its axis points in the bind pose.
        axes: Its axes through them.
        table: (table_size,) float32 naked radii [m].
    """

    measures: NDArray[np.float64]
    skeleton: Skeleton
    points: NDArray[np.float64]
    axes: Axes
    table: NDArray[np.float32]

    @property
    def sole_height(self) -> float:
        """Height of the soles in the bind pose, root frame [m]."""
        return float(self.points[POINT_IDX["ankle"], 2] - self.measures[MEASURE_IDX["ankle_height"]])


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


@cache
def mean_table() -> NDArray[np.float32]:
    """(table_size,) radii over stature of the body that the templates were made from."""
    return (mix_of(0.5, 25.0, 0.0, 0.0).base @ profiles().radii).astype(np.float32)


def laid_half(axes: Axes, table: NDArray[np.float32], skin: Template) -> NDArray[np.float64]:
    """(n_half, 3) float64 the left half of a skin over some radii, root frame [m]."""
    half = np.empty((len(skin.on_plane), 3))
    lay_skin(axes, skin.laying, table, half)
    return half


def bump(x: NDArray[np.float64], centre: float, width: float) -> NDArray[np.float64]:
    """Gaussian of height 1."""
    return np.exp(-0.5 * ((x - centre) / width) ** 2)


def shape_factors(spec: BodySpec) -> NDArray[np.float64]:
    """(table_size,) factors that the spec's shape numbers put on the mixed radii."""
    out = np.ones(sum(LAYOUT.n_stations * LAYOUT.n_angles))
    place, angle = stations_of("trunk")[:, None], angles_of("trunk")[None, :]
    side, front = np.sin(angle) ** 2, np.maximum(np.cos(angle), 0.0) ** 1.5
    trunk = table_view(out, "trunk")
    trunk += HIP_SPREAD * spec.hips * bump(place, 0.9, 0.9) * (0.3 + 0.7 * side)
    trunk += SHOULDER_SPREAD * spec.shoulders * np.clip(place - 2.6, 0.0, 1.0) * side
    trunk += 0.16 * spec.belly * bump(place, 2.2, 0.75) * (0.15 + 0.85 * front)
    thigh_place = stations_of("thigh")[:, None]
    table_view(out, "thigh")[:] += HIP_SPREAD * spec.hips * np.clip(1.6 - thigh_place, 0.0, 1.0)
    table_view(out, "head")[:] += HEAD_SPREAD * spec.head
    return out


def scaled_measures(spec: BodySpec, measures: NDArray[np.float64]) -> NDArray[np.float64]:
    """The mixed lengths with published arms and the spec's leg, arm, shoulder, hip and head numbers."""
    out = measures.copy()
    arm = 1.0 + ARM_SPREAD * spec.arms
    female, male = FOREARM_FACTORS
    for names, factor in (
        (("thigh", "shank", "crotch_down"), 1.0 + LEG_SPREAD * spec.legs),
        (("upper_arm",), UPPER_ARM_FACTOR * arm),
        (("forearm",), (female + (male - female) * spec.sex) * arm),
        (("clavicle",), 1.0 + SHOULDER_SPREAD * spec.shoulders),
        (("hip_half_width",), 1.0 + 0.7 * HIP_SPREAD * spec.hips),
        (("head_up", "skull_forward"), 1.0 + HEAD_SPREAD * spec.head),
    ):
        out[[MEASURE_IDX[name] for name in names]] *= factor
    return out


def figure_at(spec: BodySpec, mix: Mix, factors: NDArray[np.float64], heaviness: float, hem: float) -> Figure:
    """Lengths and naked radii at a heaviness.

    Args:
        spec: The person.
        mix: From `mix_of`.
        factors: From `shape_factors`.
        heaviness: 0 is the reference's average, 1 its heaviest, -1 its lightest; beyond is extrapolated.
        hem: Where a skirt ends, see `bind_points`.
    """
    weights = mix.base + (mix.heavy * heaviness if heaviness > 0 else mix.light * heaviness)
    measures = scaled_measures(spec, weights @ profiles().lengths)
    table = np.maximum(weights @ profiles().radii, 0.35 * mean_table()) * factors
    top = measures[[MEASURE_IDX[name] for name in UPRIGHT]].sum() + table_view(table, "head")[0].mean()
    scale = spec.stature / top
    measures, table = measures * scale, (table * scale).astype(np.float32)
    skeleton = skeleton_of(measures)
    points = bind_points(skeleton, measures, spec.stature, hem)
    return Figure(measures, skeleton, points, axes_through(points), table)


def solved_figure(spec: BodySpec, naked: Template, hem: float) -> Figure:
    """The figure whose naked volume has the person's mass; the nearest if none has.

    Args:
        spec: The person.
        naked: The template without skirt.
        hem: Where a skirt ends, see `bind_points`.
    """
    mix, factors = mix_of(spec.sex, spec.age, spec.muscle, spec.bust), shape_factors(spec)
    tried: list[tuple[float, float]] = []
    heaviness = 0.0
    for _ in range(12):
        figure = figure_at(spec, mix, factors, heaviness, hem)
        skin = mirrored_vertices(naked, laid_half(figure.axes, figure.table, naked))
        mass = DENSITY * enclosed_volume(skin, naked.faces)
        if abs(mass - spec.mass) < MASS_TOLERANCE * spec.mass:
            break
        tried.append((heaviness, mass))
        heaviness = next_heaviness(tried, spec.mass)
        if heaviness == tried[-1][0]:
            break
    return figure


def next_heaviness(tried: list[tuple[float, float]], mass: float) -> float:
    """Where to look next: between the nearest on both sides, or at the range's end if there are none.

    Args:
        tried: Pairs of heaviness and its mass [kg], mass growing with heaviness.
        mass: The mass sought [kg].
    """
    below = max((pair for pair in tried if pair[1] < mass), default=None)
    above = min((pair for pair in tried if pair[1] >= mass), default=None)
    if above is None:
        return HEAVINESS_RANGE[1]
    if below is None:
        return HEAVINESS_RANGE[0]
    share = (mass - below[1]) / (above[1] - below[1])
    return below[0] + float(np.clip(share, 0.04, 0.96)) * (above[0] - below[0])
