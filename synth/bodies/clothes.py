"""Clothes, hair and shoes as changes of the radius tables."""

import numpy as np
from numpy.typing import NDArray

from synth.bodies.segments import LAYOUT, SEGMENT_IDX, Axes, angles_of, stations_of, table_view


def axis_points(axes: Axes, name: str) -> NDArray[np.float64]:
    """(n_stations, 3) where a segment's stations are [m]."""
    i = SEGMENT_IDX[name]
    station = stations_of(name)
    b = np.minimum(station.astype(int), LAYOUT.n_bones[i] - 1)
    return axes.origin[i, b] + (station - b)[:, None] * axes.bone[i, b]


def skirt_table(table: NDArray[np.float32], axes: Axes, ease: float, flare: float) -> None:
    """Fills the skirt's radii in: it hangs from the waist over hips and thighs.

    Args:
        table: (table_size,) radii [m]; the skirt's part is overwritten.
        axes: The body's axes.
        ease: Cloth's distance from the skin [m].
        flare: How much wider the hem is than the thighs ask for [m].
    """
    centre, angle = axis_points(axes, "skirt"), angles_of("skirt")
    trunk, thigh = axis_points(axes, "trunk"), axis_points(axes, "thigh")
    trunk_table, thigh_table = table_view(table, "trunk"), table_view(table, "thigh")
    columns = angle / np.pi * (trunk_table.shape[1] - 1)
    waist = np.stack(
        [np.interp(columns, np.arange(trunk_table.shape[1]), row) for row in trunk_table.astype(np.float64)]
    )
    out = np.zeros((len(centre), len(angle)))
    hip_height = axes.origin[SEGMENT_IDX["thigh"], 1, 2]
    for i, z in enumerate(centre[:, 2]):
        body = np.array([np.interp(z, trunk[:, 2], waist[:, j]) for j in range(len(angle))])
        if z < trunk[0, 2] + 0.03:
            body = np.zeros(len(angle))
        # The convex oval about both thighs.
        z_thigh = min(z, hip_height)
        y = np.interp(-z_thigh, -thigh[:, 2], thigh[:, 1])
        r = np.interp(-z_thigh, -thigh[:, 2], thigh_table.mean(axis=1))
        oval = 1.0 / np.sqrt((np.cos(angle) / (1.05 * r)) ** 2 + (np.sin(angle) / (y + r)) ** 2)
        out[i] = np.maximum(body, oval if z < hip_height else 0.0)
    out = np.maximum.accumulate(out[::-1], axis=0)[::-1]  # cloth falls straight from its widest ring
    depth = np.clip((centre[-1, 2] - centre[:, 2]) / (centre[-1, 2] - centre[0, 2]), 0.0, 1.0)[:, None]
    out += ease * np.minimum(depth / 0.15, 1.0) + flare * depth**1.5
    out[-1] -= 0.006
    table_view(table, "skirt")[:] = out
