"""Clothes and shoes as changes of the radius tables; hair and headwear are in `hair.py`."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from synth.bodies.shape.figure import Figure
from synth.bodies.shape.hair import cover_head
from synth.bodies.shape.segments import LAYOUT, SEGMENT_IDX, Axes, angles_of, stations_of, table_view
from synth.bodies.spec import SKIRTS, BodySpec

Array = NDArray[np.float64]
FOLD_DEPTH = 0.25
"""Folds' standard deviation over the cloth's distance from the skin."""
SLEEVE_END: dict[str, float] = {
    "tight": 1.93, "shirt": 0.62, "long_shirt": 1.90, "jacket": 1.97, "pullover": 1.93,
}  # fmt: skip
"""Where sleeves end: 0 at the shoulder, 1 at the elbow, 2 at the wrist."""
SLACK_REACH = 0.35
"""How far from the elbow slack cloth bags out, on the same scale."""
STRAIGHT = ("straight", "wide", "coat")
"""Bottoms whose trousers fall straight from the thigh to a hem of a width of its own."""


def step_up(x: Array, low: float, high: float) -> Array:
    """0 below low, 1 above high, linear between."""
    return np.clip((x - low) / (high - low), 0.0, 1.0)


def axis_points(axes: Axes, name: str) -> Array:
    """(n_stations, 3) where a segment's stations are [m]."""
    i = SEGMENT_IDX[name]
    station = stations_of(name)
    b = np.minimum(station.astype(int), LAYOUT.n_bones[i] - 1)
    return axes.origin[i, b] + (station - b)[:, None] * axes.bone[i, b]


class Folds:
    """Smooth random patterns over the tables, the same for the same number.

    Args:
        seed: The pattern's number.
    """

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def __call__(self, name: str, along: float = 3.5, around: float = 1.8) -> Array:
        """(n_stations, n_angles) of mean 0 and deviation `FOLD_DEPTH`, no deeper than 0.9."""
        i = SEGMENT_IDX[name]
        noise = self.rng.standard_normal((LAYOUT.n_stations[i], LAYOUT.n_angles[i]))
        mode = ("reflect", "reflect" if LAYOUT.is_half[i] else "wrap")
        noise = ndimage.gaussian_filter(noise, (along, around), mode=mode)
        return np.clip(FOLD_DEPTH * noise / noise.std(), -0.9, 0.9)


def dressed_table(figure: Figure, spec: BodySpec) -> NDArray[np.float32]:
    """(table_size,) float32 radii with clothes, hair and shoes [m].

    Args:
        figure: The naked body.
        spec: What it wears.
    """
    table = figure.table.astype(np.float64)
    folds = Folds(spec.fold_seed)
    if spec.bottom in STRAIGHT:
        put_on_straight_trousers(table, figure.axes, spec, folds)
    elif spec.bottom not in ("bare", "skirt", "long_skirt"):
        put_on_trousers(table, figure.axes, spec, folds)
    if spec.shoes != "bare":
        put_on_shoes(table, figure, spec)
    else:
        soles(table, figure, 0.002, 0.0)
    if spec.top != "bare":
        put_on_top(table, figure.axes, spec, folds)
    cover_head(table, spec, figure.table)
    out = table.astype(np.float32)
    if spec.bottom in SKIRTS:
        put_on_skirt(out, figure, spec, folds)
    return out


def put_on_skirt(table: NDArray[np.float32], figure: Figure, spec: BodySpec, folds: Folds) -> None:
    """A skirt, or a coat from the waist down, with its pleats; the skirt's part of the table is overwritten."""
    trunk = table_view(table, "trunk")
    dressed = trunk.copy()
    trunk[:] = table_view(figure.table, "trunk")  # a skirt hangs from the hips, not from the top
    skirt_table(table, figure.axes, max(spec.bottom_ease, 0.004), spec.skirt_flare)
    trunk[:] = dressed
    pleats = folds("skirt", along=5.0, around=0.9)
    depth = np.linspace(1.0, 0.0, len(pleats))[:, None]
    view = table_view(table, "skirt")
    view += ((0.25 * spec.skirt_flare + 0.4 * spec.bottom_ease) * depth * pleats).astype(np.float32)


def put_on_top(table: Array, axes: Axes, spec: BodySpec, folds: Folds) -> None:
    """Shirt or jacket: it hangs from shoulders and chest, its hem below the waist, sleeves along the arms."""
    ease = spec.top_ease
    trunk, place = table_view(table, "trunk"), stations_of("trunk")[:, None]
    tucked = spec.bottom in SKIRTS or spec.top == "tight"
    cover = step_up(place, *((0.7, 1.3) if tucked else (0.25, 0.45))) * step_up(-place, -4.9, -4.4)
    cloth = trunk + ease * (1.0 + folds("trunk")) * cover
    if ease > 0.005:
        fall = 0.12 if spec.top == "jacket" else 0.28
        height = axis_points(axes, "trunk")[:, 2]
        for s in range(36, -1, -1):
            hung = cloth[s + 1] - fall * (height[s + 1] - height[s])
            cloth[s] += cover[s] * np.maximum(hung - cloth[s], 0.0)
        cloth += cover * step_up(-place, -3.7, -2.6) * (bridged(cloth) - cloth)
    trunk[:] = np.maximum(trunk, cloth)
    below = step_up(-stations_of("thigh")[:, None], -1.05, -0.85) * (not tucked)
    table_view(table, "thigh")[:] += 0.8 * ease * below
    table_view(table, "clavicle")[:] += ease * (1.0 + 0.6 * folds("clavicle"))
    if spec.top == "jacket":
        collar = step_up(-stations_of("neck")[:, None], -0.35, -0.15)
        table_view(table, "neck")[:] += 0.8 * ease * collar
    end = SLEEVE_END[spec.top]
    for name, start in (("upper_arm", 0.0), ("forearm", 0.0)):
        at = stations_of(name)[:, None] + start
        sleeve = step_up(-at, -end, -end + 0.06)
        slack = spec.slack * np.exp(-(((at - 1.0) / SLACK_REACH) ** 2))
        table_view(table, name)[:] += (0.75 * ease + slack) * sleeve * (1.0 + folds(name))


def bridged(cloth: Array) -> Array:
    """Cloth that spans the hollows of the front and back instead of following them."""
    whole = np.concatenate([cloth[:, :0:-1], cloth[:, :-1]], axis=1)  # the full turn, the front in its middle
    closed = ndimage.grey_closing(whole, size=(1, 13), mode="wrap")
    soft = ndimage.gaussian_filter1d(closed, 1.5, axis=1, mode="wrap")
    half = soft[:, cloth.shape[1] - 1 :]
    return np.maximum(cloth, np.concatenate([half, soft[:, :1]], axis=1))


def put_on_trousers(table: Array, axes: Axes, spec: BodySpec, folds: Folds) -> None:
    """Trousers or shorts: tight ones follow the leg, others fall straight from thigh and calf."""
    ease, s = spec.bottom_ease, figure_scale(axes)
    waist = step_up(-stations_of("trunk")[:, None], -2.1, -1.8)
    trunk = table_view(table, "trunk")
    trunk += 0.6 * ease * waist * (1.0 + folds("trunk"))
    if ease > 0.004:
        trunk += waist * (bridged(trunk) - trunk)
    thigh, place = table_view(table, "thigh"), stations_of("thigh")[:, None]
    if spec.bottom == "shorts":
        thigh += ease * (0.5 + step_up(place, 1.2, 1.8)) * step_up(-place, -1.80, -1.76) * (1.0 + folds("thigh"))
        return
    thigh += ease * (1.0 + folds("thigh"))
    shank, place = table_view(table, "shank"), stations_of("shank")[:, None]
    cover = step_up(-place, -2.05, -2.0)
    cloth = shank + ease * (1.0 + folds("shank"))
    if spec.bottom != "tight":
        knee = thigh[-1].mean()
        hem = s * (0.058 if spec.bottom == "trousers" else 0.078) + 0.5 * ease
        straight = knee + (hem - knee) * step_up(place, 1.0, 2.0)
        cloth = np.maximum(cloth, straight * (1.0 + 0.12 * folds("shank")))
    shank[:] = np.maximum(shank, cover * cloth)


def put_on_straight_trousers(table: Array, axes: Axes, spec: BodySpec, folds: Folds) -> None:
    """Trousers whose legs narrow or widen from mid-thigh to below the knee, and fall straight from there to the hem."""
    ease, s = spec.bottom_ease, figure_scale(axes)
    waist = step_up(-stations_of("trunk")[:, None], -2.1, -1.8)
    trunk = table_view(table, "trunk")
    trunk += 0.6 * ease * waist * (1.0 + folds("trunk"))
    trunk += waist * (bridged(trunk) - trunk)
    thigh, place = table_view(table, "thigh"), stations_of("thigh")[:, None]
    thigh += ease * (1.0 + folds("thigh"))
    start = float(np.interp(1.4, place[:, 0], thigh.mean(axis=1)))
    hem = 0.5 * s * spec.hem_width
    # Along the leg: 1.4 above the middle of the thigh, 2 at the knee, 3 at the ankle.
    for name, at in (("thigh", place), ("shank", stations_of("shank")[:, None] + 1.0)):
        leg, fold = table_view(table, name), folds(name)
        tube = start + (hem - start) * step_up(at, 1.4, 2.3)
        reach = step_up(at, 1.4, 1.55) * step_up(-at, -3.05, -3.0)
        cloth = np.maximum(leg + ease * (1.0 + fold) * (name == "shank"), tube * (1.0 + 0.12 * fold))
        leg[:] = np.maximum(leg, reach * cloth)


def figure_scale(axes: Axes) -> float:
    """Leg length over an adult's of 1.72 m."""
    leg = np.linalg.norm(axes.bone[SEGMENT_IDX["thigh"], 1]) + np.linalg.norm(axes.bone[SEGMENT_IDX["shank"], 1])
    return float(leg / 0.83)


def soles(table: Array, figure: Figure, thickness: float, width: float) -> None:
    """Lets the foot reach below its sole with upright sides, so that it can be cut level.

    Args:
        table: (table_size,) radii [m], changed in place.
        figure: The naked body.
        thickness: How far below the naked sole [m].
        width: How far beyond the naked foot's sides [m].
    """
    foot, angle = table_view(table, "foot"), angles_of("foot")
    depth = axis_points(figure.axes, "foot")[:, 2] - figure.sole_height + thickness
    down = np.maximum(-np.cos(angle), 1e-3)
    for side in (1.0, -1.0):
        across = np.maximum(side * np.sin(angle), 0.0)
        half_width = (foot * across).max(axis=1, keepdims=True) + width
        box = np.minimum(depth[:, None] / down, half_width / np.maximum(across, 1e-3))
        reaches = (-np.cos(angle) > 0.02) & (side * np.sin(angle) > -1e-6)
        foot[:] = np.where(reaches, np.maximum(foot, box), foot)


def put_on_shoes(table: Array, figure: Figure, spec: BodySpec) -> None:
    """Shoes round the toes off and thicken the soles; boots go up the shank."""
    foot, place = table_view(table, "foot"), stations_of("foot")[:, None]
    up = np.maximum(np.cos(angles_of("foot")), 0.0)
    foot += 0.003 + 0.009 * up * step_up(place, 0.5, 0.85) * step_up(-place, -1.02, -0.9)
    soles(table, figure, spec.sole + 0.004, 0.002)
    place = stations_of("shank")[:, None]
    if spec.shoes == "boot" and spec.bottom in ("bare", "tight", "shorts", "skirt", "long_skirt"):
        table_view(table, "shank")[:] += 0.011 * step_up(place, 1.40, 1.44)
    else:
        table_view(table, "shank")[:] += 0.004 * step_up(place, 1.92, 1.97)


def skirt_table(table: NDArray[np.float32], axes: Axes, ease: float, flare: float) -> None:
    """Fills the skirt's radii in: it hangs from the waist over hips and thighs.

    Args:
        table: (table_size,) radii [m]; the skirt's part is overwritten.
        axes: The body's axes.
        ease: Cloth's distance from the skin [m].
        flare: How much wider the hem is than the thighs ask for [m].
    """
    centre, angle = axis_points(axes, "skirt"), angles_of("skirt")
    trunk, thigh, shank = (axis_points(axes, name) for name in ("trunk", "thigh", "shank"))
    trunk_table = table_view(table, "trunk").astype(np.float64)
    columns = np.linspace(0, trunk_table.shape[1] - 1, len(angle))
    hips = np.stack([np.interp(columns, np.arange(trunk_table.shape[1]), row) for row in trunk_table])
    leg = np.concatenate([thigh[6:31], shank[4:]])
    radius = np.concatenate(
        [table_view(table, "thigh")[6:31].mean(axis=1), table_view(table, "shank")[4:].mean(axis=1)]
    )
    out = np.zeros((len(centre), len(angle)))
    for i, z in enumerate(centre[:, 2]):
        # The oval about both legs; above their joints, the trunk.
        y = np.interp(-z, -leg[:, 2], leg[:, 1])
        r = np.interp(-z, -leg[:, 2], radius)
        out[i] = 1.0 / np.sqrt((np.cos(angle) / (1.05 * r)) ** 2 + (np.sin(angle) / (y + r)) ** 2)
        if z > trunk[0, 2] + 0.03:
            row = np.array([np.interp(z, trunk[:, 2], hips[:, j]) for j in range(len(angle))])
            out[i] = np.maximum(row, out[i] if z < leg[0, 2] else 0.0)
    out = np.maximum.accumulate(out[::-1], axis=0)[::-1]  # cloth falls straight from its widest ring
    out = ndimage.gaussian_filter1d(out, 1.3, axis=0, mode="nearest")
    depth = np.clip((centre[-1, 2] - centre[:, 2]) / (centre[-1, 2] - centre[0, 2]), 0.0, 1.0)[:, None]
    out += ease * np.minimum(depth / 0.15, 1.0) + flare * depth**1.5
    out[-1] -= 0.006
    table_view(table, "skirt")[:] = out
