"""Reads STL files, ASCII and binary, with trimesh.

trimesh drops a solid of an ASCII file without its last line, or whose name holds a word of the format, and takes a
binary file whose length is not the promised one for an ASCII file without any. So all solids are made one before, and
the triangles are counted here.
"""

import io
import re
from pathlib import Path

import numpy as np

from synth.occluders.imported.shape import Triangles

_HEAD, _RECORD = 84, 50


def read_stl(path: Path) -> Triangles:
    """The triangles; normals are not looked at.

    Raises:
        ValueError: It is neither kind, or ends before its triangles do.
    """
    data = path.read_bytes()
    promised = int.from_bytes(data[80:_HEAD], "little") if len(data) >= _HEAD else -1
    length = _HEAD + _RECORD * promised
    fits = promised >= 0 and len(data) >= length
    if data.lstrip()[:5].lower() == b"solid" and not (fits and len(data) == length):
        return _loaded(*_ascii(data))
    if not fits:
        holds = max(len(data) - _HEAD, 0) // _RECORD
        raise ValueError(f"its header promises {max(promised, 0)} triangles, but it holds {holds}")
    return _loaded(data[:length], promised)


def _ascii(data: bytes) -> tuple[bytes, int]:
    """An ASCII file with all facets in one solid without name, and their number."""
    lines = data.replace(b"\r", b"\n")
    facets = re.sub(rb"^[ \t]*(end)?solid\b.*$", b"", lines, flags=re.IGNORECASE | re.MULTILINE)
    n_facets = len(re.findall(rb"\bendfacet\b", facets, re.IGNORECASE))
    n_vertices = len(re.findall(rb"\bvertex\s+\S+\s+\S+\s+\S+", facets, re.IGNORECASE))
    if n_vertices != 3 * n_facets or not n_facets:
        raise ValueError(f"it holds {n_facets} whole facets, but {n_vertices} vertices")
    return b"solid\n" + facets + b"\nendsolid\n", n_facets


def _loaded(data: bytes, n: int) -> Triangles:
    import trimesh

    if n == 0:
        raise ValueError("there are no triangles in it")
    mesh = trimesh.load_mesh(io.BytesIO(data), file_type="stl", process=False)
    if len(mesh.faces) != n:
        raise ValueError(f"only {len(mesh.faces)} of its {n} triangles can be read")
    return Triangles(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64))
