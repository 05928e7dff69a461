"""Reads any mesh file, and tells what it says of its unit and up axis."""

from dataclasses import dataclass, field
from pathlib import Path

from pipelines.foreign import ForeignFileError, check_size, reading
from pipelines.importing.meshfiles.collada import Asset, read_collada
from pipelines.importing.meshfiles.gltf import read_gltf
from pipelines.importing.meshfiles.obj import read_obj
from pipelines.importing.meshfiles.ply import read_ply
from pipelines.importing.meshfiles.reach import Reach
from pipelines.importing.meshfiles.stl import read_stl
from pipelines.importing.meshfiles.urdf import read_urdf
from synth.occluders.imported.shape import Triangles
from synth.occluders.imported.sizes import UNITS, Said

KINDS: dict[str, str] = {
    ".obj": "an OBJ file",
    ".glb": "a GLB file",
    ".gltf": "a glTF file",
    ".dae": "a COLLADA file",
    ".ply": "a PLY file",
    ".stl": "an STL file",
    ".urdf": "a URDF",
}
"""Extensions that are read."""
_SAID: dict[str, Said] = {
    ".obj": Said("y"), ".ply": Said("z"), ".stl": Said("z"), ".glb": Said("y", True), ".gltf": Said("y", True),
    ".urdf": Said("z", True),
}  # fmt: skip
"""What the kinds of files prescribe, or mostly mean."""


@dataclass(frozen=True)
class MeshFile:
    """What a file holds.

    Attributes:
        triangles: In its own unit and axes.
        said: What it, or its kind, says of those.
        unit: The unit that its kind prescribes, if it does.
        notes: What its user should know, in sentences without a full stop.
    """

    triangles: Triangles
    said: Said
    unit: str | None = None
    notes: tuple[str, ...] = field(default=())


def read_mesh(path: Path, reach: Reach, pose_key: str) -> MeshFile:
    """All triangles of a file.

    Args:
        path: Any of `KINDS`.
        reach: Which other files it may have opened.
        pose_key: The joints of a URDF are set at random by this.

    Raises:
        ForeignFileError: It cannot be used; the message names the file, and says why in one line.
    """
    suffix = path.suffix.lower()
    if suffix != ".urdf":
        return _read_plain(path, reach)
    notes: list[str] = []

    def part(other: Path) -> Triangles:
        return _in_metres(other, reach, notes)

    with reading(path, KINDS[suffix]):
        check_size(path, path.stat().st_size, "it")
        return MeshFile(read_urdf(path, reach, pose_key, part), _SAID[suffix], "m", tuple(dict.fromkeys(notes)))


def _read_plain(path: Path, reach: Reach) -> MeshFile:
    suffix = path.suffix.lower()
    with reading(path, KINDS[suffix]):
        check_size(path, path.stat().st_size, "it")
        if suffix == ".dae":
            return _of_collada(*read_collada(path))
        if suffix in (".glb", ".gltf"):
            return MeshFile(read_gltf(path, reach), _SAID[suffix], "m")
        read = {".obj": read_obj, ".ply": read_ply, ".stl": read_stl}[suffix]
        return MeshFile(read(path), _SAID[suffix])


def _of_collada(mesh: Triangles, asset: Asset) -> MeshFile:
    """A unit that is none of ours is turned into metres at once."""
    up, unit = asset.up or "y", None
    if (metre := asset.metre) is not None:
        unit = next((name for name, size in UNITS.items() if abs(metre / size - 1.0) < 0.01), None)
        if unit is None:
            mesh, unit = Triangles(metre * mesh.vertices, mesh.faces), "m"
    return MeshFile(mesh, Said(up, asset.up is not None, unit))


def _in_metres(path: Path, reach: Reach, notes: list[str]) -> Triangles:
    """A mesh of a URDF: the unit of a DAE counts; like RViz, its up axis does not."""
    if path.suffix.lower() not in KINDS or path.suffix.lower() == ".urdf":
        kinds = ", ".join(kind for kind in KINDS if kind != ".urdf")
        raise ForeignFileError(f"{path} is a mesh of a URDF, but none of {kinds}")
    if path.suffix.lower() != ".dae":
        return _read_plain(path, reach).triangles
    with reading(path, KINDS[".dae"]):
        check_size(path, path.stat().st_size, "it")
        mesh, asset = read_collada(path)
    if asset.up not in (None, "z"):
        notes.append(f"{path.name} says {asset.up} up, which a URDF overrules")
    return Triangles((asset.metre or 1.0) * mesh.vertices, mesh.faces)
