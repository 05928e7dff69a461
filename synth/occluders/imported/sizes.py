"""How large things of each class are, which decides between the units and up axes that a mesh may be in."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.occluders.imported.shape import MeshError, Triangles

Range = tuple[float, float]
AXES = ("x", "-x", "y", "-y", "z", "-z")


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

    def broken(self, size: NDArray[np.float64]) -> list[str]:
        """The limits that (height, length, depth) [m] breaks, in words."""
        words = zip(size, ("high", "long", "deep"), (self.height, self.length, self.depth), strict=True)
        return [
            f"{value:.3g} m {word}, at {'least' if value < low else 'most'} {low if value < low else high:g} m"
            for value, word, (low, high) in words
            if not low <= value <= high
        ]

    def excess(self, size: NDArray[np.float64]) -> float:
        """Sum of the log ratios by which (height, length, depth) [m] is out of its ranges."""
        low, high = np.array([self.height, self.length, self.depth]).T
        return float((np.maximum(np.log(low / size), 0.0) + np.maximum(np.log(size / high), 0.0)).sum())

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
_LEVEL_WEIGHT, _UNUSUAL_UNIT = 2.0, 10.0
"""Worth of a surface that is all level at the class's height; price of another unit than the file says."""
_LEVEL_SHARE, _DECISIVE = 0.25, 4.0
"""Another axis than said is up if at least this share of the surface is then level, and so many times as much."""
_STRANGER = 0.5
"""Another axis is told of if the mesh would be less strange by this."""


@dataclass(frozen=True)
class Hints:
    """What the user says of a mesh; None is to be found.

    Attributes:
        unit: "m", "cm", "mm" or "inch".
        up: "x", "y" or "z".
        forward: The axis of the file, such as "-z", that the thing's user looks along.
    """

    unit: str | None = None
    up: str | None = None
    forward: str | None = None

    def __post_init__(self) -> None:
        known = {"unit": tuple(UNITS), "up": tuple(TO_UPRIGHT), "forward": AXES}
        for name, names in known.items():
            value = getattr(self, name)
            if value is not None and value not in names:
                raise MeshError(f"{name}={value!r} is unknown, known are {', '.join(names)}")


@dataclass(frozen=True)
class Said:
    """What a file or its kind says of its frame, which may be wrong.

    Attributes:
        up: The axis that points up.
        is_up_stated: Whether the file or its format says so; else files of its kind mostly have it.
        unit: Its unit, if it says one.
    """

    up: str
    is_up_stated: bool = False
    unit: str | None = None


@dataclass(frozen=True)
class Frame:
    """The frame of a mesh.

    Attributes:
        unit: One of `UNITS`.
        up: The axis that points up.
        forward: The axis that its user looks along; None to find it.
        is_up_stated: Whether the user or the file said the axis.
        warnings: What was not taken as said, in sentences without a full stop.
    """

    unit: str
    up: str
    forward: str | None = None
    is_up_stated: bool = True
    warnings: tuple[str, ...] = ()


def find_frame(mesh: Triangles, class_name: str, hints: Hints, said: Said) -> Frame:
    """The frame in which a mesh is of its class.

    The unit is the one in which its size is most ordinary. The up axis is the one that is said; only surfaces that
    are level by far along another one, never the size, overrule that, and not what the user says.

    Args:
        mesh: As in the file.
        class_name: Its class.
        hints: What the user says.
        said: What the file says.

    Raises:
        MeshError: It is of its class's size in no unit.
    """
    sizes, warnings = SIZES[class_name], []
    up = hints.up or said.up
    if hints.up is None and sizes.level is not None:
        shares = {axis: _level_share(mesh.turned(TO_UPRIGHT[axis])) for axis in sorted({"y", "z", said.up})}
        best = max(shares, key=lambda axis: shares[axis])
        is_decisive = shares[best] >= max(_LEVEL_SHARE, _DECISIVE * shares[up])
        if best != up and is_decisive and _units(mesh, sizes, best, hints, said):
            source = "the file says" if said.is_up_stated else "such files mostly have"
            warnings.append(
                f"{best} up is guessed from its level surfaces, {source} {up} up; --up or an index tells"
            )
            up = best
    found = _units(mesh, sizes, up, hints, said)
    if not found:
        raise MeshError(_broken_limits(mesh, class_name, up, hints, said))
    _, unit = min(found)
    if said.unit not in (None, unit) and hints.unit is None:
        warnings.append(f"the file says {said.unit}, in which it would be no {class_name}; {unit} is a guess")
    is_stated = hints.up is not None or (said.is_up_stated and up == said.up)
    if not is_stated and up == said.up:
        for other in sorted({"y", "z"} - {up}):
            others = [name for _, name in _units(mesh, sizes, other, hints, said)]
            strange = [sizes.strangeness(UNITS[name] * _size(mesh, other)) for name in others]
            if strange and min(strange) < sizes.strangeness(UNITS[unit] * _size(mesh, up)) - _STRANGER:
                warnings.append(f"with {other} up it would be more like a {class_name}; --up or an index tells")
    return Frame(unit, up, hints.forward, is_stated, tuple(warnings))


def _units(mesh: Triangles, sizes: Sizes, up: str, hints: Hints, said: Said) -> list[tuple[float, str]]:
    """Price and name of each unit in which a mesh fits its class."""
    found = []
    for unit in (hints.unit,) if hints.unit else UNITS:
        size = UNITS[unit] * _size(mesh, up)
        if sizes.fits(size):
            share = _level_share(mesh.turned(TO_UPRIGHT[up], UNITS[unit]), sizes.level) if sizes.level else 0.0
            price = sizes.strangeness(size) - _LEVEL_WEIGHT * share
            found.append((price + _UNUSUAL_UNIT * (said.unit is not None and unit != said.unit), unit))
    return found


def _size(mesh: Triangles, up: str) -> NDArray[np.float64]:
    """(height, length, depth) in the mesh's unit."""
    x, y, z = np.abs(TO_UPRIGHT[up]) @ np.ptp(mesh.vertices, axis=0)
    return np.array([z, max(x, y), min(x, y)])


def _broken_limits(mesh: Triangles, class_name: str, up: str, hints: Hints, said: Said) -> str:
    """Why a mesh fits its class in no unit: the limits that it breaks in the unit where it breaks them least."""
    sizes = SIZES[class_name]
    what = " x ".join(f"{value:.3g}" for value in np.ptp(mesh.vertices, axis=0))
    units = f"in {hints.unit}" if hints.unit else f"in any of {', '.join(UNITS)}"
    size = _size(mesh, up)
    tried = (hints.unit,) if hints.unit else (said.unit,) if said.unit else tuple(UNITS)
    nearest = min(
        tried, key=lambda unit: (len(sizes.broken(UNITS[unit] * size)), sizes.excess(UNITS[unit] * size))
    )
    broken = ", ".join(sizes.broken(UNITS[nearest] * size))
    text = f"is {what}, which {units} is no {class_name} ({sizes}): in {nearest} with {up} up it is {broken}"
    other = [axis for axis in TO_UPRIGHT if axis != up and _units(mesh, sizes, axis, hints, said)]
    if other and hints.up is None:
        text += f"; with {' or '.join(other)} up it would fit, which --up or an index must say"
    return text


def _level_share(mesh: Triangles, level: Range | None = None) -> float:
    """Share of the surface [0, 1] that is level within heights; by default anywhere but near the ground."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    height = (a + b + c)[:, 2] / 3.0 - mesh.vertices[:, 2].min()
    low, high = level or (0.1 * float(np.ptp(mesh.vertices[:, 2])), np.inf)
    is_level = (np.abs(normal[:, 2]) > 0.95 * area) & (height >= low) & (height <= high)
    return float(area[is_level].sum() / area.sum())
