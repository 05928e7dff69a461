"""Reads Wavefront OBJ files.

Not with trimesh, which fans polygons where they are concave, takes index 0 for the last vertex, and does not read faces
whose corners are written in different ways (`1/1/1 2//2 3`).
"""

from pathlib import Path

import numpy as np

from pipelines.importing.meshfiles.polygons import triangulated
from synth.occluders.imported.shape import Triangles


def read_obj(path: Path) -> Triangles:
    """The faces of all objects and groups; names, which may be in any encoding, and materials are not looked at.

    Raises:
        ValueError: A line cannot be understood, or there are no faces.
    """
    data = path.read_bytes().replace(b"\r\n", b"\n").replace(b"\\\n", b"  ")
    lines = data.split(b"\n" if b"\n" in data else b"\r")
    vertices: list[tuple[float, ...]] = []
    polygons: list[list[int]] = []
    for number, line in enumerate(lines, 1):
        words = line.split()
        if not words:
            continue
        try:
            if words[0] == b"v":
                x, y, z = words[1:4]
                vertices.append((float(x), float(y), float(z)))
            elif words[0] in (b"f", b"fo"):
                polygons.append(_corners(words[1:], len(vertices)))
        except ValueError:
            said = line.strip()[:60].decode("ascii", "backslashreplace")
            raise ValueError(f"line {number} is no {'vertex' if words[0] == b'v' else 'face'}: {said}") from None
    if not polygons:
        raise ValueError("there are no faces in it")
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    return Triangles(points, triangulated(points, polygons))


def _corners(words: list[bytes], n: int) -> list[int]:
    """Vertex indices from 0 of a face such as `1/1/1 2//2 -1`, with n vertices before it."""
    out = []
    for word in words:
        if word.startswith(b"#"):
            break
        k = int(word.split(b"/", 1)[0])
        if k == 0 or k < -n:
            raise ValueError
        out.append(k - 1 if k > 0 else n + k)
    return out
