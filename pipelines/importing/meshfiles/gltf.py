"""Reads glTF 2.0: GLB files, and GLTF files with their buffers.

Not with trimesh, which leaves normalised (quantised) positions as integers, takes sparse arrays for zeros, drops fans,
shows nothing of a file without scenes, and takes compressed meshes for plain ones.
"""

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError, check_size
from pipelines.importing.meshfiles.accessors import Accessors
from pipelines.importing.meshfiles.parts import FaceBudget, placed, together
from pipelines.importing.meshfiles.polygons import check_indices, fan, strip
from pipelines.importing.meshfiles.reach import Reach
from synth.occluders.imported.shape import Triangles

_READ = ("KHR_mesh_quantization",)
_HARMLESS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_", "KHR_xmp")
"""Extensions that do not touch a mesh's shape."""
_COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco-compressed: install DracoPy (pip install DracoPy) to have it read",
    "EXT_meshopt_compression": "meshopt-compressed, which is not read: write it again uncompressed",
    "KHR_meshopt_compression": "meshopt-compressed, which is not read: write it again uncompressed",
    "EXT_mesh_gpu_instancing": "made of GPU instances, which are not read: write it again without",
}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_MAX_DEPTH = 200


def read_gltf(path: Path, reach: Reach) -> Triangles:
    """The triangles of the scene that the file shows first, every node where it is placed.

    Raises:
        ValueError: It is damaged, of another version, or has no triangles.
        ForeignFileError: It is compressed in a way that is not read, names a file that may not be opened, or
            promises more than there is memory for.
    """
    data = path.read_bytes()
    tree, binary = _chunks(data) if data[:4] == b"glTF" else (data, None)
    try:
        return _shown_first(path, json.loads(tree.decode("utf-8-sig")), binary, reach)
    except KeyError as error:
        raise ValueError(f"its JSON lacks {error}, or has another value there than a glTF") from None
    except (TypeError, IndexError, AttributeError) as error:
        raise ValueError(f"its JSON has a value of another kind than a glTF ({error})") from None


def _shown_first(path: Path, document: dict[str, Any], binary: bytes | None, reach: Reach) -> Triangles:
    version = document["asset"]["version"]
    if str(version).split(".")[0] != "2":
        raise ValueError(f"it is glTF {version}, only glTF 2 is read")
    for name in document.get("extensionsRequired", []):
        if name in _COMPRESSED and name != "KHR_draco_mesh_compression":
            raise ForeignFileError(f"{path} is {_COMPRESSED[name]}")
        if name not in (*_READ, *_COMPRESSED) and not str(name).startswith(_HARMLESS):
            raise ForeignFileError(f"{path} requires the extension {name}, which is not read")
    return together(list(_Document(path, document, binary, reach).parts()))


def _chunks(data: bytes) -> tuple[bytes, bytes | None]:
    """The JSON and the binary chunk of a GLB file."""
    version, length = int.from_bytes(data[4:8], "little"), int.from_bytes(data[8:12], "little")
    if version != 2:
        raise ValueError(f"it is GLB version {version}, only version 2 is read")
    if length > len(data):
        raise ValueError(f"its header promises {length} bytes, but it has {len(data)}")
    found: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = int.from_bytes(data[at : at + 4], "little"), data[at + 4 : at + 8]
        if at + 8 + size > length:
            raise ValueError(f"a chunk promises {size} bytes, but {length - at - 8} follow")
        found.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    if b"JSON" not in found:
        raise ValueError("it has no JSON chunk")
    return found[b"JSON"], found.get(b"BIN\x00")


class _Document:
    """The JSON tree with its buffers."""

    def __init__(self, path: Path, tree: dict[str, Any], binary: bytes | None, reach: Reach) -> None:
        self._path, self._tree, self._binary, self._reach = path, tree, binary, reach
        self._buffers: dict[int, bytes] = {}
        self._accessors = Accessors(path, tree, self._buffer)
        self._meshes: dict[int, list[Triangles]] = {}
        self._budget = FaceBudget()

    def parts(self) -> Iterator[Triangles]:
        """Every primitive of the scene where it is placed."""
        nodes, scenes = self._tree.get("nodes", []), self._tree.get("scenes", [])
        if scenes:
            roots = scenes[_index(self._tree.get("scene", 0), len(scenes), "scene")].get("nodes", [])
        else:
            children = {child for node in nodes for child in node.get("children", [])}
            roots = [k for k in range(len(nodes)) if k not in children]
        for k in roots:
            yield from self._placed(k, np.eye(4), 0)

    def _placed(self, k: int, T: NDArray[np.float64], depth: int) -> Iterator[Triangles]:
        if depth > _MAX_DEPTH:
            raise ValueError(f"its nodes are nested more than {_MAX_DEPTH} deep")
        self._budget.take()
        node = self._tree["nodes"][_index(k, len(self._tree["nodes"]), "node")]
        self._refuse(node.get("extensions", {}), "EXT_mesh_gpu_instancing")
        T = T @ _local(node)
        if "mesh" in node:
            for part in self._mesh(node["mesh"]):
                self._budget.take(len(part.faces))
                yield placed(part, T)
        for child in node.get("children", []):
            yield from self._placed(child, T, depth + 1)

    def _mesh(self, k: int) -> list[Triangles]:
        meshes = self._tree.get("meshes", [])
        k = _index(k, len(meshes), "mesh")
        if k not in self._meshes:
            parts = [self._primitive(primitive) for primitive in meshes[k]["primitives"]]
            self._meshes[k] = [part for part in parts if part is not None and len(part.faces)]
        return self._meshes[k]

    def _primitive(self, primitive: dict[str, Any]) -> Triangles | None:
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_TRIANGLES, _STRIP, _FAN) or "POSITION" not in primitive["attributes"]:
            return None
        draco = primitive.get("extensions", {}).get("KHR_draco_mesh_compression")
        if draco is not None:
            return self._draco(draco)
        points = self._accessors.read(primitive["attributes"]["POSITION"])
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError("its positions are no triples")
        if "indices" in primitive:
            corners = self._accessors.read(primitive["indices"]).astype(np.int64)
            if corners.ndim != 1:
                raise ValueError("its indices are no single numbers")
        else:
            corners = np.arange(len(points), dtype=np.int64)
        check_indices(corners, len(points))
        if mode == _TRIANGLES:
            return Triangles(points, corners[: len(corners) // 3 * 3].reshape(-1, 3))
        return Triangles(points, (strip if mode == _STRIP else fan)(corners)) if len(corners) >= 3 else None

    def _draco(self, extension: dict[str, Any]) -> Triangles:
        try:
            import DracoPy  # type: ignore[import-not-found,unused-ignore]
        except ImportError:
            raise ForeignFileError(f"{self._path} is {_COMPRESSED['KHR_draco_mesh_compression']}") from None
        mesh = DracoPy.decode(self._accessors.view(extension["bufferView"]))
        faces = np.asarray(mesh.faces, dtype=np.int64).reshape(-1, 3)
        points = np.asarray(mesh.points, dtype=np.float64).reshape(-1, 3)
        check_indices(faces, len(points))
        return Triangles(points, faces)

    def _refuse(self, extensions: dict[str, Any], name: str) -> None:
        if name in extensions:
            raise ForeignFileError(f"{self._path} is {_COMPRESSED[name]}")

    def _buffer(self, k: int) -> bytes:
        buffers = self._tree.get("buffers", [])
        k = _index(k, len(buffers), "buffer")
        if k not in self._buffers:
            self._refuse(buffers[k].get("extensions", {}), "EXT_meshopt_compression")
            self._refuse(buffers[k].get("extensions", {}), "KHR_meshopt_compression")
            uri, promised = buffers[k].get("uri"), int(buffers[k]["byteLength"])
            check_size(self._path, promised, f"its buffer {k}")
            if uri is None:
                data = self._binary if k == 0 and self._binary is not None else b""
            elif uri.startswith("data:"):
                head, _, body = uri.partition(",")
                data = base64.b64decode(body) if head.endswith(";base64") else unquote_to_bytes(body)
            else:
                other = self._reach.open(self._path, uri)
                check_size(other, other.stat().st_size, "it")
                data = other.read_bytes()
            if len(data) < promised:
                raise ValueError(f"buffer {k} promises {promised} bytes, but holds {len(data)}")
            self._buffers[k] = data
        return self._buffers[k]


def _local(node: dict[str, Any]) -> NDArray[np.float64]:
    """A node's transform: its matrix, or translation, rotation and scale."""
    if "matrix" in node:
        T = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    else:
        x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64)
        R = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        T = np.eye(4)
        T[:3, :3] = R * np.array(node.get("scale", (1, 1, 1)), dtype=np.float64).reshape(3)
        T[:3, 3] = np.array(node.get("translation", (0, 0, 0)), dtype=np.float64).reshape(3)
    if not np.isfinite(T).all():
        raise ValueError("a node's transform is not finite")
    return T


def _index(k: Any, n: int, what: str) -> int:
    if not isinstance(k, int) or isinstance(k, bool) or not 0 <= k < n:
        raise ValueError(f"{what} {k!r} is named, but there are {n}")
    return k
