"""How large things of each class are, which decides between the units and up axes that a mesh may be in."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.occluders.imported.shape import MeshError, Triangles

Range = tuple[float, float]


@dataclass(frozen=True)
class Sizes:
    """Sizes of a class [m].

    Attributes:
        height: Lowest and highest.
        length: Of the longer side seen from above.
        depth: Of the shorter side seen from above.
        typical: Height, length and depth of an ordinary one.
        level: Heights at which its surface to use lies; None if it has none.
    """

    height: Range
    length: Range
    depth: Range
    typical: tuple[float, float, float]
    level: Range | None = None

    def fits(self, size: NDArray[np.float64]) -> bool:
        """Whether (height, length, depth) [m] is within the ranges."""
        ranges = np.array([self.height, self.length, self.depth])
        return bool(((size >= ranges[:, 0]) & (size <= ranges[:, 1])).all())

    def strangeness(self, size: NDArray[np.float64]) -> float:
        """Squared log ratios of (height, length, depth) to the typical ones."""
        return float((np.log(size / np.array(self.typical)) ** 2).sum())

    def __str__(self) -> str:
        rows = (("high", self.height), ("long", self.length), ("deep", self.depth))
        return ", ".join(f"{low:g}-{high:g} m {name}" for name, (low, high) in rows)


SIZES: dict[str, Sizes] = {
    "table": Sizes((0.25, 1.25), (0.35, 3.5), (0.3, 2.2), (0.75, 1.4, 0.8), (0.25, 1.2)),
    "laptop": Sizes((0.1, 0.4), (0.18, 0.5), (0.15, 0.45), (0.23, 0.33, 0.27), (0.003, 0.06)),
    "stroller": Sizes((0.5, 1.3), (0.5, 1.6), (0.3, 0.9), (1.0, 0.9, 0.55)),
    "chair": Sizes((0.35, 1.5), (0.3, 2.8), (0.28, 1.3), (0.9, 0.6, 0.5), (0.35, 0.58)),
    "monitor": Sizes((0.2, 1.0), (0.25, 1.5), (0.02, 0.5), (0.45, 0.55, 0.2)),
    "suitcase": Sizes((0.2, 1.1), (0.25, 1.1), (0.08, 0.6), (0.6, 0.4, 0.25)),
    "other": Sizes((0.1, 2.2), (0.1, 2.0), (0.05, 1.5), (0.6, 0.5, 0.4)),
}
"""Sizes by class."""
UNITS: dict[str, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254}
"""Metres in each unit."""
TO_UPRIGHT: dict[str, NDArray[np.float64]] = {
    "x": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
}
"""Rotations that turn the axis that points up into z."""
_LEVEL_WEIGHT, _UNUSUAL_UP, _UNUSUAL_UNIT = 2.0, 0.5, 10.0
"""Worth of a surface that is all level at the class's height; prices of another up axis and unit than usual."""


def find_unit_and_up(
    mesh: Triangles,
    class_name: str,
    unit: str | None,
    up: str | None,
    usual_up: str,
    usual_unit: str | None = None,
) -> tuple[str, str]:
    """The unit and up axis in which a mesh is most like its class.

    Args:
        mesh: As in the file.
        class_name: Its class.
        unit: Its unit if known.
        up: Its up axis if known.
        usual_up: The axis that it probably has up, by its file or format.
        usual_unit: The unit that it probably is in, by its file.

    Raises:
        MeshError: In no unit and with no axis up is it of its class's size.
    """
    sizes, found = SIZES[class_name], []
    extent = np.ptp(mesh.vertices, axis=0)
    for axis in (up,) if up else sorted({"y", "z", usual_up}):
        R = TO_UPRIGHT[axis]
        x, y, z = np.abs(R) @ extent
        for name in (unit,) if unit else UNITS:
            size = np.array([z, max(x, y), min(x, y)]) * UNITS[name]
            if sizes.fits(size):
                share = _level_share(mesh.turned(R, UNITS[name]), sizes.level)
                price = sizes.strangeness(size) - _LEVEL_WEIGHT * share + _UNUSUAL_UP * (axis != usual_up)
                price += _UNUSUAL_UNIT * (usual_unit is not None and name != usual_unit)
                found.append((price, name, axis))
    if not found:
        what = " x ".join(f"{value:.3g}" for value in extent)
        units = f"in {unit}" if unit else f"in any of {', '.join(UNITS)}"
        raise MeshError(f"is {what}, which {units} is no {class_name} ({sizes})")
    return min(found)[1:]


def _level_share(mesh: Triangles, level: Range | None) -> float:
    """Share of the surface [0, 1] that is level and at the heights of the class's surface."""
    if level is None:
        return 0.0
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    height = (a + b + c)[:, 2] / 3.0 - mesh.vertices[:, 2].min()
    is_level = (np.abs(normal[:, 2]) > 0.95 * area) & (height >= level[0]) & (height <= level[1])
    return float(area[is_level].sum() / area.sum())
