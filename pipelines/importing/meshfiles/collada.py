"""Reads COLLADA files (DAE): the geometry of the scene, its unit and its up axis.

pycollada reads the scene: nodes, what they instantiate, and their transforms. Not left to it are

- the geometry, since it drops the holes of polygons, takes no notice of an array's stride and offset, refuses arrays
  whose columns have no names, takes negative indices for ones from the end, and keeps 24 bits of a coordinate;
- the unit and axis, since it does not tell whether a file states its axis;
- cameras, lights, materials and skins, since one that is damaged would cost the mesh; a skin's mesh is taken as bound;
- `skew`, which it does not know, and `lookat`, whose matrix it transposes.
"""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from lxml import etree
from numpy.typing import NDArray

from pipelines.importing.meshfiles.collada_mesh import read_geometry
from pipelines.importing.meshfiles.parts import FaceBudget, placed, together
from pipelines.importing.meshfiles.xmlfile import Element, local_name, read_xml
from synth.occluders.imported.shape import Triangles

if TYPE_CHECKING:
    from collada.scene import SceneNode

Array = NDArray[np.float64]
_MAX_DEPTH = 200
_NAMESPACE = "{http://www.collada.org/2005/11/COLLADASchema}"
_GRAPH = (
    "library_nodes", "library_visual_scenes", "visual_scene", "node", "matrix", "translate", "rotate", "scale",
    "instance_node", "instance_geometry", "scene", "instance_visual_scene",
)  # fmt: skip
"""Elements of a scene that count."""


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
    return together(list(_parts(root))), _asset(root)


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


def _parts(root: Element) -> Iterator[Triangles]:
    """Every mesh where it is placed; all meshes of the file if it has no scene."""
    from collada import Collada, DaeError
    from collada.scene import DaeInstanceNotLoadedError

    meshes, budget = _Meshes(root), FaceBudget()
    try:
        document = Collada(io.BytesIO(etree.tostring(_Graph(root).root)))
    except (DaeError, DaeInstanceNotLoadedError) as error:
        raise ValueError(error.msg) from None
    scene = document.scene or next(iter(document.scenes), None)
    if scene is None:
        yield from meshes.all()
        return
    for node in scene.nodes:
        yield from _placed(node, np.eye(4), meshes, budget, 0)


def _placed(node: "SceneNode", T: Array, meshes: "_Meshes", budget: FaceBudget, depth: int) -> Iterator[Triangles]:
    from collada.scene import GeometryNode, NodeNode

    if depth > _MAX_DEPTH:
        raise ValueError(f"its nodes are nested more than {_MAX_DEPTH} deep")
    budget.take()
    if isinstance(node, GeometryNode):
        mesh = meshes.of(node.geometry.id)
        budget.take(len(mesh.faces))
        yield placed(mesh, T)
    elif isinstance(node, NodeNode):
        yield from _placed(node.node, T, meshes, budget, depth + 1)
    else:
        if not np.isfinite(node.matrix).all():
            raise ValueError("a node's transform is not finite")
        for child in node.children:
            yield from _placed(child, T @ node.matrix.astype(np.float64), meshes, budget, depth + 1)


class _Meshes:
    """The geometries of a DAE file by their names, each read once."""

    def __init__(self, root: Element) -> None:
        self._elements = root.findall("{*}library_geometries/{*}geometry")
        self._read: dict[str, Triangles] = {}

    def all(self) -> Iterator[Triangles]:
        yield from map(read_geometry, self._elements)

    def of(self, name: str) -> Triangles:
        if name not in self._read:
            self._read[name] = read_geometry(next(item for item in self._elements if item.get("id") == name))
        return self._read[name]


class _Graph:
    """The scene of a DAE file without all that does not count, as pycollada wants it."""

    def __init__(self, root: Element) -> None:
        self._controllers = {item.get("id"): item for item in root.iter("{*}controller")}
        self.root = etree.Element(f"{_NAMESPACE}COLLADA", version="1.4.1")
        library = etree.SubElement(self.root, f"{_NAMESPACE}library_geometries")
        for geometry in root.iterfind("{*}library_geometries/{*}geometry"):
            stub = etree.SubElement(library, f"{_NAMESPACE}geometry", id=geometry.get("id", ""))
            etree.SubElement(stub, f"{_NAMESPACE}mesh")
        for child in root:
            self._copy(child, self.root, 0)

    def _copy(self, element: Element, parent: Element, depth: int) -> None:
        kind = local_name(element)
        if depth > _MAX_DEPTH:
            raise ValueError(f"its nodes are nested more than {_MAX_DEPTH} deep")
        if kind in ("skew", "lookat"):
            raise ValueError(f"it has a node with <{kind}>, which is not read")
        if kind == "instance_controller":
            self._bind(element, "url", parent, depth)
        if kind in _GRAPH:
            made = etree.SubElement(parent, _NAMESPACE + kind, dict(element.attrib))
            made.text = element.text or " "  # pycollada wants a text
            for child in element:
                self._copy(child, made, depth + 1)

    def _bind(self, element: Element, attribute: str, parent: Element, depth: int) -> None:
        """Puts the mesh under a skin or morph, as it was bound."""
        url = element.get(attribute, "")
        controller = self._controllers.get(url.removeprefix("#"))
        if controller is None and attribute == "source":
            etree.SubElement(parent, f"{_NAMESPACE}instance_geometry", url=url)
            return
        found = None if controller is None else next(controller.iterchildren("{*}skin", "{*}morph"), None)
        if found is None or depth > _MAX_DEPTH:
            raise ValueError(f"its controller {url!r} has no mesh")
        node = etree.SubElement(parent, f"{_NAMESPACE}node")
        if (bind := found.find("{*}bind_shape_matrix")) is not None:
            etree.SubElement(node, f"{_NAMESPACE}matrix").text = bind.text
        self._bind(found, "source", node, depth + 1)
