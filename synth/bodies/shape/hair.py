"""Hair, hats and hoods as changes of the head's, neck's and upper trunk's radii."""

import numpy as np
from numpy.typing import NDArray

from synth.bodies.shape.segments import angles_of, stations_of, table_view
from synth.bodies.spec import BodySpec

Array = NDArray[np.float64]
# Polar angle of the hairline by azimuth from the face [degrees]: forehead, temple, ear, nape.
_AZIMUTH = (0.0, 40.0, 60.0, 75.0, 95.0, 130.0, 180.0)
_HAIRLINE = {
    "short": (46.0, 50.0, 58.0, 84.0, 100.0, 116.0, 122.0),
    "medium": (46.0, 50.0, 66.0, 112.0, 126.0, 138.0, 142.0),
    "long": (46.0, 50.0, 68.0, 116.0, 140.0, 160.0, 165.0),
    "bun": (44.0, 46.0, 55.0, 76.0, 96.0, 114.0, 122.0),
    "beanie": (56.0, 58.0, 64.0, 82.0, 98.0, 108.0, 112.0),
    "cap": (58.0, 58.0, 62.0, 74.0, 86.0, 94.0, 98.0),
    "brim": (60.0, 60.0, 64.0, 72.0, 78.0, 82.0, 84.0),
    "hood": (42.0, 44.0, 52.0, 130.0, 165.0, 175.0, 178.0),
}


def step_up(x: Array, low: float | Array, high: float | Array) -> Array:
    """0 below low, 1 above high, linear between."""
    return np.clip((x - low) / (high - low), 0.0, 1.0)


def covered(style: str, edge: float = 7.0) -> Array:
    """(n_polar, n_azimuth) 1 under the style, 0 off it.

    Args:
        style: A key of the hairlines.
        edge: How softly it ends [degrees].
    """
    azimuth = np.degrees(angles_of("head"))
    polar = 180.0 * stations_of("head")[:, None]
    line = np.interp(azimuth, _AZIMUTH, _HAIRLINE[style])[None, :]
    return 1.0 - step_up(polar, line - edge, line + 0.3 * edge)


def cover_head(table: Array, spec: BodySpec, naked: NDArray[np.float32]) -> None:
    """Puts hair and headwear on.

    Args:
        table: (table_size,) radii [m], changed in place.
        spec: What the person wears.
        naked: (table_size,) radii without clothes [m].
    """
    head = table_view(table, "head")
    scale = float(table_view(naked, "head")[:12].mean()) / 0.105
    polar = 180.0 * stations_of("head")[:, None]
    azimuth = np.degrees(angles_of("head"))[None, :]
    volume = spec.hair_volume * (0.35 if spec.headwear in ("beanie", "cap", "brim") else 1.0)
    if spec.hair != "bald":
        head += volume * covered(spec.hair)
    if spec.hair == "bun":
        head += 0.050 * scale * np.exp(-0.5 * (((polar - 66.0) / 13.0) ** 2 + ((azimuth - 180.0) / 17.0) ** 2))
    if spec.hair in ("medium", "long"):
        hang_hair(table, spec.hair_volume, spec.hair == "long")
    if spec.headwear == "beanie":
        head += 0.010 * covered("beanie", 4.0)
    elif spec.headwear == "cap":
        head += 0.012 * covered("cap", 4.0)
        brim = np.exp(-0.5 * ((polar - 68.0) / 6.0) ** 2) * (1.0 - step_up(azimuth, 30.0, 58.0))
        head += 0.055 * scale * brim
    elif spec.headwear == "brim":
        head += 0.022 * covered("brim", 4.0)
        line = np.interp(azimuth, _AZIMUTH, _HAIRLINE["brim"])
        head += 0.045 * scale * np.exp(-0.5 * ((polar - line - 6.0) / 6.0) ** 2)
    elif spec.headwear == "hood":
        head += 0.026 * covered("hood", 5.0)
        put_hood_down_neck(table, 0.026)


def hang_hair(table: Array, volume: float, is_long: bool) -> None:
    """Hair at the sides and back of the neck, long hair over the upper back."""
    behind = step_up(np.degrees(angles_of("neck"))[None, :], 60.0, 95.0)
    down = 0.0 if is_long else 0.45
    along = step_up(stations_of("neck")[:, None], down, down + 0.2)
    table_view(table, "neck")[:] += (0.022 + 0.9 * volume) * behind * along
    if not is_long:
        return
    back = step_up(np.degrees(angles_of("trunk"))[None, :], 105.0, 150.0)
    trunk = stations_of("trunk")[:, None]
    table_view(table, "trunk")[:] += (0.018 + 0.9 * volume) * back * step_up(trunk, 2.9, 3.7)
    angle = np.degrees(angles_of("clavicle"))[None, :]
    near = step_up(-stations_of("clavicle")[:, None], -0.5, -0.2)
    around = step_up(angle, 130.0, 160.0) * step_up(-angle, -285.0, -255.0)
    table_view(table, "clavicle")[:] += (0.010 + 0.5 * volume) * near * around


def put_hood_down_neck(table: Array, thickness: float) -> None:
    """A worn hood closes around the neck and lies on the shoulders."""
    around = 0.35 + 0.65 * step_up(np.degrees(angles_of("neck"))[None, :], 35.0, 70.0)
    table_view(table, "neck")[:] += (thickness + 0.012) * around
    near = step_up(-stations_of("clavicle")[:, None], -0.55, -0.25)
    table_view(table, "clavicle")[:] += 0.7 * thickness * near
    trunk = step_up(stations_of("trunk")[:, None], 3.7, 4.1)
    back = step_up(np.degrees(angles_of("trunk"))[None, :], 80.0, 110.0)
    table_view(table, "trunk")[:] += 0.8 * thickness * trunk * back
