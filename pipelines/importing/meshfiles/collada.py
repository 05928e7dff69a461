"""Reads COLLADA files (DAE): the geometry of the scene, its unit and its up axis."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.meshfiles.collada_mesh import read_geometry
from pipelines.importing.meshfiles.parts import FaceBudget, placed, together
from pipelines.importing.meshfiles.xmlfile import Element, local_name, numbers, read_xml
from synth.occluders.imported.shape import Triangles

Array = NDArray[np.float64]
_MAX_DEPTH = 200


@dataclass(frozen=True)
class Asset:
    """What a DAE file says of itself.

    Attributes:
        up: "x", "y" or "z"; None if it is silent, which means y.
        metre: Metres in its unit; None if it is silent, which means 1.
    """

    up: str | None
    metre: float | None


def read_collada(path: Path) -> tuple[Triangles, Asset]:
    """The mesh in the file's own unit and axes, and what it says of them.

    Raises:
        ValueError: It is damaged, or has no triangles.
    """
    root = read_xml(path)
    if local_name(root) != "COLLADA":
        raise ValueError(f"its root is <{local_name(root)}>, not <COLLADA>")
    scene = _Scene(root)
    return together(list(scene.parts())), _asset(root)


def _asset(root: Element) -> Asset:
    axis = root.find("{*}asset/{*}up_axis")
    up = (axis.text or "").strip().upper() if axis is not None else ""
    unit = root.find("{*}asset/{*}unit")
    metre = None
    if unit is not None and unit.get("meter") is not None:
        metre = float(unit.get("meter", ""))
        if not (np.isfinite(metre) and metre > 0.0):
            raise ValueError(f"its unit is {metre:g} m")
    return Asset(up[0].lower() if up in ("X_UP", "Y_UP", "Z_UP") else None, metre)


class _Scene:
    """The nodes of a DAE file that its scene shows."""

    def __init__(self, root: Element) -> None:
        self._root = root
        self._by_id = {element.get("id"): element for element in root.iter() if element.get("id")}
        self._meshes: dict[str, Triangles] = {}
        self._budget = FaceBudget()

    def parts(self) -> Iterator[Triangles]:
        """Every mesh where it is placed; all meshes of the file if it has no scene."""
        shown = self._root.find("{*}scene/{*}instance_visual_scene")
        scenes = self._root.findall("{*}library_visual_scenes/{*}visual_scene")
        if shown is not None:
            scenes = [self._named(shown)]
        if not scenes:
            for geometry in self._root.findall("{*}library_geometries/{*}geometry"):
                yield read_geometry(geometry)
            return
        for node in scenes[0].findall("{*}node"):
            yield from self._placed(node, np.eye(4), 0)

    def _placed(self, node: Element, T: Array, depth: int) -> Iterator[Triangles]:
        if depth > _MAX_DEPTH:
            raise ValueError(f"its nodes are nested more than {_MAX_DEPTH} deep")
        self._budget.take()
        for child in node:
            make = _TRANSFORMS.get(local_name(child))
            if make is not None:
                T = T @ make(child)
        for child in node:
            kind = local_name(child)
            if kind == "node":
                yield from self._placed(child, T, depth + 1)
            elif kind == "instance_node":
                yield from self._placed(self._named(child), T, depth + 1)
            elif kind == "instance_geometry":
                yield self._taken(self._mesh(self._named(child)), T)
            elif kind == "instance_controller":
                mesh, bind = self._controlled(self._named(child), 0)
                yield self._taken(mesh, T @ bind)

    def _taken(self, mesh: Triangles, T: Array) -> Triangles:
        self._budget.take(len(mesh.faces))
        return placed(mesh, T)

    def _controlled(self, controller: Element, depth: int) -> tuple[Triangles, Array]:
        """The mesh under a skin or morph, as it was bound, and where."""
        for kind in ("skin", "morph"):
            found = controller.find(f"{{*}}{kind}")
            if found is not None and depth < _MAX_DEPTH:
                source = self._named(found, "source")
                bind = found.find("{*}bind_shape_matrix")
                T = np.eye(4) if bind is None else _square(bind)
                if local_name(source) == "controller":
                    mesh, inner = self._controlled(source, depth + 1)
                    return mesh, T @ inner
                return self._mesh(source), T
        raise ValueError(f"its controller {controller.get('id')!r} has no mesh")

    def _mesh(self, geometry: Element) -> Triangles:
        name = geometry.get("id", "")
        if name not in self._meshes:
            self._meshes[name] = read_geometry(geometry)
        return self._meshes[name]

    def _named(self, element: Element, attribute: str = "url") -> Element:
        url = element.get(attribute, "")
        found = self._by_id.get(url.removeprefix("#"))
        if not url.startswith("#") or found is None:
            raise ValueError(f"<{local_name(element)}> names {url!r}, which is not in the file")
        return found


def _square(element: Element) -> Array:
    return np.array(_exactly(element, 16)).reshape(4, 4)


def _exactly(element: Element, n: int) -> list[float]:
    values = numbers(element.text)
    if len(values) != n or not np.isfinite(values).all():
        raise ValueError(f"<{local_name(element)}> must hold {n} finite numbers, it holds {len(values)}")
    return values


def _shift(element: Element) -> Array:
    T = np.eye(4)
    T[:3, 3] = _exactly(element, 3)
    return T


def _turn(element: Element) -> Array:
    x, y, z, degrees = _exactly(element, 4)
    length = float(np.linalg.norm((x, y, z)))
    T = np.eye(4)
    if length > 0.0:
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / length
        angle = np.radians(degrees)
        T[:3, :3] += np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K
    return T


def _scaling(element: Element) -> Array:
    return np.diag([*_exactly(element, 3), 1.0])


def _unknown(element: Element) -> Array:
    raise ValueError(f"it has a node with <{local_name(element)}>, which is not read")


_TRANSFORMS: dict[str, Callable[[Element], Array]] = {
    "matrix": _square, "translate": _shift, "rotate": _turn, "scale": _scaling, "skew": _unknown,
    "lookat": _unknown,
}  # fmt: skip
