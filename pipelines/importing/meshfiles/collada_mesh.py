"""Reads one geometry of a COLLADA file."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.meshfiles.parts import together
from pipelines.importing.meshfiles.polygons import check_indices, cut, fan, strip, triangulated
from pipelines.importing.meshfiles.xmlfile import Element, local_name, numbers
from synth.occluders.imported.shape import Triangles

_PRIMITIVES = ("triangles", "polylist", "polygons", "tristrips", "trifans")


def read_geometry(geometry: Element) -> Triangles:
    """The triangles of a <geometry>; lines, splines and hulls have none.

    Raises:
        ValueError: It is damaged.
    """
    mesh = geometry.find("{*}mesh")
    parts = [] if mesh is None else [_primitive(mesh, p) for p in mesh if local_name(p) in _PRIMITIVES]
    parts = [part for part in parts if len(part.faces)]
    return together(parts) if parts else Triangles(np.empty((0, 3)), np.empty((0, 3), np.int64))


def _primitive(mesh: Element, primitive: Element) -> Triangles:
    kind = local_name(primitive)
    inputs = primitive.findall("{*}input")
    stride = 1 + max((int(item.get("offset", "0")) for item in inputs), default=0)
    source = next((item for item in inputs if item.get("semantic") in ("VERTEX", "POSITION")), None)
    if source is None:
        return Triangles(np.empty((0, 3)), np.empty((0, 3), np.int64))  # such as no faces at all
    offset = int(source.get("offset", "0"))
    if offset < 0:
        raise ValueError(f"<{kind}> has an input with offset {offset}")
    points = _points(mesh, source)
    rows = [_indices(p, stride)[:, offset] for p in primitive.findall("{*}p")]
    faces = list(_faces(kind, primitive, points, rows, stride, offset))
    made = np.concatenate([np.empty((0, 3), np.int64), *faces])
    check_indices(made, len(points))
    return Triangles(points, made)


def _faces(
    kind: str,
    primitive: Element,
    points: NDArray[np.float64],
    rows: list[NDArray[np.int64]],
    stride: int,
    offset: int,
) -> Iterator[NDArray[np.int64]]:
    if kind == "triangles":
        for row in rows:
            if len(row) % 3:
                raise ValueError(f"<triangles> has {len(row)} corners, which is no multiple of 3")
            yield row.reshape(-1, 3)
    elif kind in ("tristrips", "trifans"):
        yield from ((strip if kind == "tristrips" else fan)(row) for row in rows if len(row) >= 3)
    elif kind == "polylist":
        sizes = np.array([int(n) for item in primitive.findall("{*}vcount") for n in (item.text or "").split()])
        corners = np.concatenate([np.empty(0, np.int64), *rows])
        if (sizes < 0).any() or sizes.sum() != len(corners):
            raise ValueError(f"<polylist> promises {sizes.sum():g} corners, but holds {len(corners)}")
        ends = np.cumsum(sizes).astype(np.int64)
        yield triangulated(points, [corners[a:b].tolist() for a, b in zip(ends - sizes, ends, strict=True)])
    else:
        yield triangulated(points, [row.tolist() for row in rows])
        for holed in primitive.findall("{*}ph"):
            rings = [_indices(ring, stride)[:, offset] for ring in holed if local_name(ring) in ("p", "h")]
            if rings and all(len(ring) >= 3 for ring in rings):
                yield cut(points, [ring.tolist() for ring in rings])


def _indices(element: Element, stride: int) -> NDArray[np.int64]:
    values = [int(word) for word in (element.text or "").split()]
    if len(values) % stride:
        raise ValueError(f"a list of {len(values)} indices is no multiple of {stride}")
    return np.array(values, dtype=np.int64).reshape(-1, stride)


def _points(mesh: Element, item: Element) -> NDArray[np.float64]:
    """(n, 3) positions that an input names."""
    source = _of(mesh, item)
    if local_name(source) == "vertices":
        position = next((i for i in source.findall("{*}input") if i.get("semantic") == "POSITION"), None)
        if position is None:
            raise ValueError("its <vertices> have no positions")
        source = _of(mesh, position)
    array = source.find("{*}float_array")
    values = np.array(numbers(None if array is None else array.text), dtype=np.float64)
    accessor = source.find("{*}technique_common/{*}accessor")
    get: Callable[[str], str | None] = (accessor.attrib if accessor is not None else {}).get
    stride, offset = int(get("stride") or "3"), int(get("offset") or "0")
    if stride < 3 or offset < 0:
        raise ValueError(f"a source of positions has stride {stride} and offset {offset}")
    n = max((len(values) - offset) // stride, 0)
    if int(get("count") or n) > n:
        raise ValueError(f"a source promises {get('count')} positions, but holds {n}")
    names = [p.get("name") for p in accessor.findall("{*}param")] if accessor is not None else []
    columns = [names.index(axis) for axis in "XYZ"] if {"X", "Y", "Z"} <= set(names) else [0, 1, 2]
    if max(columns) >= stride:
        raise ValueError(f"a source has {len(names)} parameters, but stride {stride}")
    return values[offset : offset + n * stride].reshape(n, stride)[:, columns]


def _of(mesh: Element, item: Element) -> Element:
    name = item.get("source", "").removeprefix("#")
    for element in mesh:
        if element.get("id") == name:
            return element
    raise ValueError(f"an input names the source {name!r}, which is not in its mesh")
