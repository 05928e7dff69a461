"""Reads STL files, ASCII and binary."""

import re
from pathlib import Path

import numpy as np

from synth.occluders.imported.shape import Triangles

_HEAD, _RECORD = 84, 50
_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def read_stl(path: Path) -> Triangles:
    """The triangles; normals are not looked at.

    Raises:
        ValueError: It is neither kind, or ends before its triangles do.
    """
    data = path.read_bytes()
    promised = int.from_bytes(data[80:_HEAD], "little") if len(data) >= _HEAD else -1
    fits = promised >= 0 and len(data) >= _HEAD + _RECORD * promised
    if data.lstrip()[:5].lower() == b"solid" and not (fits and len(data) == _HEAD + _RECORD * promised):
        return _ascii(data)
    if not fits:
        holds = max(len(data) - _HEAD, 0) // _RECORD
        raise ValueError(f"its header promises {max(promised, 0)} triangles, but it holds {holds}")
    if promised == 0:
        raise ValueError("there are no triangles in it")
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    corners = np.frombuffer(data, record, promised, _HEAD)["corners"].astype(np.float64).reshape(-1, 3)
    return Triangles(corners, np.arange(len(corners)).reshape(-1, 3))


def _ascii(data: bytes) -> Triangles:
    corners = np.array([[float(word) for word in found] for found in _VERTEX.findall(data)]).reshape(-1, 3)
    n_facets = len(re.findall(rb"endfacet", data, re.IGNORECASE))
    if len(corners) != 3 * n_facets or not n_facets:
        raise ValueError(f"it holds {n_facets} whole facets, but {len(corners)} vertices")
    return Triangles(corners, np.arange(len(corners)).reshape(-1, 3))
