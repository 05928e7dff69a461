"""Reads mesh files and URDFs with trimesh and yourdfpy, which are loaded only here and only when needed."""

import hashlib
import re
from pathlib import Path
from typing import Any

import numpy as np

from synth.occluders.imported.shape import MeshError, Triangles
from synth.occluders.imported.sizes import UNITS

USUAL_UP: dict[str, str] = {
    ".obj": "y",
    ".glb": "y",
    ".gltf": "y",
    ".dae": "z",
    ".ply": "z",
    ".stl": "z",
    ".urdf": "z",
}
"""Extensions that are read, and the axis that such files mostly have up."""


def read_mesh(path: Path, seed: int) -> Triangles:
    """All triangles of a file.

    Args:
        path: Any of `USUAL_UP`.
        seed: Of the joints' positions in a URDF, drawn within their limits from it and the file's name.

    Raises:
        MeshError: It cannot be read; the libraries' own errors are taken for that.
    """
    import trimesh

    is_urdf = path.suffix.lower() == ".urdf"
    try:
        scene = _urdf_scene(path, seed) if is_urdf else trimesh.load_scene(path, process=False)
        mesh = scene.to_mesh()
    except Exception as error:  # the readers raise whatever their parsers do
        raise MeshError(
            f"cannot be read: {str(error).splitlines()[0] if str(error) else type(error).__name__}"
        ) from None
    faces = getattr(mesh, "faces", None)
    if faces is None or not len(faces):
        raise MeshError("has no triangles")
    return Triangles(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64))


def usual_frame(path: Path) -> tuple[str, str | None]:
    """The axis that a file probably has up and its probable unit: as it says, or as its kind has them."""
    suffix = path.suffix.lower()
    said = _said_by_collada(path) if suffix == ".dae" else {}
    return said.get("up", USUAL_UP[suffix]), said.get("unit")


def _said_by_collada(path: Path) -> dict[str, str]:
    """Up axis and unit out of a DAE file's asset; what programs write there is often wrong."""
    said = {}
    text = path.read_text(encoding="utf-8", errors="replace")
    if up := re.search(r"<up_axis>\s*([XYZ])_UP\s*</up_axis>", text):
        said["up"] = up[1].lower()
    if unit := re.search(r"<unit\b[^>]*\bmeter\s*=\s*[\"']\s*([0-9.eE+-]+)\s*[\"']", text):
        nearest = min(UNITS, key=lambda name: abs(UNITS[name] - _number(unit[1])))
        if abs(_number(unit[1]) / UNITS[nearest] - 1.0) < 0.01:
            said["unit"] = nearest
    return said


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return 0.0


def prescribed_unit(path: Path) -> str | None:
    """The unit that a format prescribes, if it does."""
    return "m" if path.suffix.lower() in (".glb", ".gltf", ".urdf") else None


def _urdf_scene(path: Path, seed: int) -> Any:
    """The scene of a URDF with its joints somewhere within their limits."""
    import yourdfpy

    urdf = yourdfpy.URDF.load(str(path), build_scene_graph=True, load_meshes=True)
    digest = hashlib.sha256(f"{seed}/{path.stem}".encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:8], "big"))
    places = []
    for name in urdf.actuated_joint_names:
        limit = urdf.joint_map[name].limit
        low, high = (-np.pi, np.pi) if limit is None or limit.lower is None else (limit.lower, limit.upper)
        places.append(float(rng.uniform(low, high)))
    urdf.update_cfg(places)
    return urdf.scene
