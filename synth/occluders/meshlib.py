"""MeshLibrary: imported models in one file that needs neither their files nor their readers."""

import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.digested import DigestedFormat, read_digested, write_digested
from synth.geometry import LabelledMesh
from synth.occluders.imported.boxes import solids_of
from synth.occluders.model import Anchor, Occluder
from synth.vocabulary import SPLITS

_ARRAYS = {"vertices": ("float32", 3), "faces": ("int32", 3), "boxes": ("float64", 6)}


IMPORTED = "imported"
"""Kind of an object of a library in what frames store."""


class MeshLibraryError(ValueError):
    """A file that is no object library or is damaged."""


FORMAT = DigestedFormat(
    "undergrowth object library", 2, "object library", MeshLibraryError, "import the objects again"
)


@dataclass(frozen=True)
class MeshModel:
    """One model, in the frame of an `Occluder`.

    Attributes:
        name: What it is called; once in a library.
        class_name: Name in `OCCLUDER_CLASSES`.
        role: The kind of procedural object that it can stand in for; "obstacle" if nobody uses it.
        split: The one split that it belongs to.
        frame: Unit and up axis of its file, in words.
        anchors: What people and things touch.
        vertices: (n, 3) float32 [m].
        faces: (m, 3) int32.
        boxes: (k, 6) float64 lower and upper corners of what fills it [m].
        is_closed: Whether back faces are never seen.
    """

    name: str
    class_name: str
    role: str
    split: str
    frame: str
    anchors: tuple[Anchor, ...]
    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    boxes: NDArray[np.float64]
    is_closed: bool

    def __post_init__(self) -> None:
        for name, (dtype, width) in _ARRAYS.items():
            array = getattr(self, name)
            if array.dtype != dtype or array.ndim != 2 or array.shape[1] != width or not len(array):
                raise MeshLibraryError(f"{name} is {array.dtype} {array.shape}, must be {dtype} (n, {width})")
        if self.faces.min() < 0 or self.faces.max() >= len(self.vertices):
            raise MeshLibraryError(f"a face of {self.name} names a vertex that there is not")
        if self.split not in SPLITS:
            raise MeshLibraryError(f"split={self.split!r} of {self.name} must be one of {', '.join(SPLITS)}")

    @cached_property
    def occluder(self) -> Occluder:
        """The model as the generator uses it."""
        label = np.zeros(len(self.faces), dtype=np.uint8)
        mesh = LabelledMesh(self.vertices, self.faces, label, self.is_closed)
        return Occluder(self.class_name, mesh, solids_of(self.boxes), self.anchors)

    @property
    def spec_id(self) -> str:
        """Identifier in the corpus."""
        return f"{IMPORTED}/{self.class_name}/{self.split}/{self.name}"

    def header(self) -> dict[str, object]:
        """All but the arrays, as JSON values."""
        anchors = [
            {"name": a.name, "T_object_anchor": a.T_object_anchor.tolist(), "size": list(a.size), "shape": a.shape}
            for a in self.anchors
        ]
        plain = {n: getattr(self, n) for n in ("name", "class_name", "role", "split", "frame", "is_closed")}
        return plain | {"anchors": anchors}


@dataclass(frozen=True)
class MeshLibrary:
    """Models by their order in the file.

    Attributes:
        models: They, each name once.
        settings: What the library was made with, as JSON values.
    """

    models: tuple[MeshModel, ...]
    settings: dict[str, object]

    def __post_init__(self) -> None:
        names = [model.name for model in self.models]
        if len(set(names)) != len(names):
            raise MeshLibraryError(f"model {max(names, key=names.count)!r} is there twice")

    def of(self, split: str, class_name: str | None = None) -> tuple[MeshModel, ...]:
        """The models of a split, of one class if it is given."""
        return tuple(m for m in self.models if m.split == split and class_name in (None, m.class_name))

    def model(self, name: str) -> MeshModel:
        """The model of that name.

        Raises:
            KeyError: There is none; the message lists those there are.
        """
        for model in self.models:
            if model.name == name:
                return model
        raise KeyError(f"the library has no model {name!r}, only {[m.name for m in self.models]}")

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything in it; hangs on the models, not on how the file keeps them."""
        header = {"kind": FORMAT.name, "version": 1, **self.metadata()}
        total = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
        for model in self.models:
            for name in _ARRAYS:
                total.update(np.ascontiguousarray(getattr(model, name)).tobytes())
        return total.hexdigest()

    def metadata(self) -> dict[str, object]:
        """All but the arrays, as JSON values."""
        return {"settings": self.settings, "models": [model.header() for model in self.models]}


def write_library(path: Path, library: MeshLibrary) -> None:
    """Writes a library: beside, synced and renamed, so that the file is whole or absent.

    Args:
        path: The file; an old one is replaced.
        library: The models.
    """
    arrays = {
        f"{k:05d}.{name}": getattr(model, name) for k, model in enumerate(library.models) for name in _ARRAYS
    }
    write_digested(path, FORMAT, IMPORTED, arrays, library.metadata())


def read_library(path: Path) -> MeshLibrary:
    """Reads a library and checks it to the last byte.

    Raises:
        MeshLibraryError: There is none, it is damaged or of another version.
    """
    _, arrays, metadata = read_digested(path, FORMAT, IMPORTED)
    with FORMAT.naming_file(path):
        if not isinstance(metadata["settings"], dict) or not isinstance(metadata["models"], list):
            raise MeshLibraryError("settings must be values by name, models a list")
        models = tuple(_model(k, values, arrays) for k, values in enumerate(metadata["models"]))
        return MeshLibrary(models, metadata["settings"])


_WORDS = ("name", "class_name", "role", "split", "frame")


def _model(k: int, values: object, arrays: dict[str, np.ndarray]) -> MeshModel:
    if not isinstance(values, dict) or not isinstance(values["anchors"], list):
        raise MeshLibraryError(f"model {k} is {values!r:.60}, must be values by name with a list of anchors")
    if not all(isinstance(values[name], str) for name in _WORDS) or not isinstance(values["is_closed"], bool):
        raise MeshLibraryError(f"{', '.join(_WORDS)} of model {k} must be words, is_closed true or false")
    given = {name: arrays[f"{k:05d}.{name}"] for name in _ARRAYS}
    return MeshModel(**(values | {"anchors": tuple(map(_anchor, values["anchors"]))} | given))


def _anchor(values: object) -> Anchor:
    if not isinstance(values, dict) or not isinstance(values["name"], str):
        raise MeshLibraryError(f"an anchor is {values!r:.60}, must be values by name")
    T, size = np.array(values["T_object_anchor"], np.float64), tuple(values["size"])
    numbers = np.append(T.ravel(), np.array(size, np.float64))
    is_number = T.shape == (4, 4) and len(size) == 2 and np.isfinite(numbers).all()
    if not is_number or values["shape"] not in ("rectangle", "ellipse"):
        raise MeshLibraryError(f"anchor {values['name']} must have a 4x4 transform, two sizes, a known shape")
    return Anchor(values["name"], T, size, values["shape"])
