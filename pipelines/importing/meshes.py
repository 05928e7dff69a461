"""undergrowth import meshes: an object library out of mesh files and URDFs."""

import csv
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Literal

import tyro
from tqdm import tqdm

from pipelines.errors import UserError
from pipelines.importing.meshfiles import USUAL_UP, prescribed_unit, read_mesh, usual_frame
from pipelines.importing.mocap import split_of
from synth.occluders.imported.model import Hints, make_model
from synth.occluders.imported.shape import MeshError
from synth.occluders.imported.sizes import SIZES
from synth.occluders.meshlib import MeshLibrary, MeshModel, write_library
from synth.vocabulary import SPLITS

log = logging.getLogger(__name__)

ALIASES: dict[str, str] = {
    "desk": "table", "sofa": "chair", "couch": "chair", "bench": "chair", "stool": "chair", "tv": "monitor",
    "screen": "monitor", "bag": "suitcase", "pram": "stroller", "stroller_like": "stroller", "box": "other",
    "bin": "other", "cart": "other",
}  # fmt: skip
"""Other words for classes, in file names and indices."""
COLUMNS = ("file", "class", "unit", "up", "forward", "split")
"""Columns of an index that are read; `category` may stand for `class`, others are left alone."""


@dataclass(frozen=True)
class MeshSettings:
    """Makes an object library out of meshes; files that cannot be used are listed, the others imported.

    Attributes:
        folder: Where the files are, at any depth: OBJ, GLB, GLTF, PLY, STL, DAE, URDF.
        out: File of the library.
        class_name: Class of all files that neither the index nor their name (table__round.obj) says one of.
        index: CSV file with a column file, and any of class, unit, up, forward, split; empty cells are found.
        unit: Of all files that the index gives none for.
        up: Axis that points up, likewise.
        forward: Axis that the thing's user looks along, likewise: a sitter's or a typist's view.
        train: Names of models, or patterns such as 'kitchen*', that belong to this split.
        val: Likewise.
        test: Likewise; '*' puts all into the test split.
        seed: Deals out the models that no list names, and sets the joints of URDFs.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    out: Path
    class_name: Annotated[str | None, tyro.conf.arg(name="class")] = None
    index: Path | None = None
    unit: Literal["m", "cm", "mm", "inch"] | None = None
    up: Literal["x", "y", "z"] | None = None
    forward: Literal["x", "-x", "y", "-y", "z", "-z"] | None = None
    train: tuple[str, ...] = ()
    val: tuple[str, ...] = ()
    test: tuple[str, ...] = ()
    seed: int = 0

    def run(self) -> int:
        """Imports, tells what became of every file."""
        library = import_meshes(self)
        write_library(self.out, library)
        for split in SPLITS:
            names = [f"{model.class_name}/{model.name}" for model in library.of(split)]
            log.info("%-5s %3d models: %s", split, len(names), ", ".join(names) or "none")
        log.info("%d models in %s, digest %s", len(library.models), self.out, library.digest[:16])
        return 0


def import_meshes(settings: MeshSettings) -> MeshLibrary:
    """Reads all files and makes those into models that can be.

    Args:
        settings: What to import.

    Raises:
        UserError: There is no file, none can be used, or a class or an index is wrong.
    """
    if settings.class_name is not None and class_of(settings.class_name) is None:
        raise UserError(f"class {settings.class_name!r} is unknown, {_known_classes()}")
    if not settings.folder.is_dir():
        raise UserError(f"{settings.folder} is no folder")
    index = {} if settings.index is None else read_index(settings.index)
    files = sorted(path for path in settings.folder.rglob("*") if path.suffix.lower() in USUAL_UP)
    if not files:
        raise UserError(f"{settings.folder} has no files of the kinds {', '.join(USUAL_UP)}")
    unlisted = sorted(set(index) - {path.name for path in files})
    if unlisted:
        raise UserError(f"{settings.index} lists {unlisted[0]}, which is not in {settings.folder}")
    models: dict[str, MeshModel] = {}
    refused = []
    for path in tqdm(files, unit="file", delay=2.0, dynamic_ncols=True):
        try:
            model = _import(path, index.get(path.name, {}), settings)
            if model.name in models:
                raise MeshError(f"is model {model.name} again")
            models[model.name] = model
        except (MeshError, OSError) as error:
            refused.append(f"refused: {path} {error}")
    for model in models.values():
        log.info(
            "%-8s %-28s %-5s %5d faces %4d boxes, %s, %s",
            model.class_name, model.name, model.split, len(model.faces), len(model.boxes), model.frame, model.role,
        )  # fmt: skip
    for line in refused:
        log.warning("%s", line)
    if not models:
        raise UserError(f"none of the {len(files)} files in {settings.folder} can be used")
    return MeshLibrary(tuple(models.values()), {"seed": settings.seed})


def class_of(word: str) -> str | None:
    """The class that a word means; None if it is unknown."""
    name = ALIASES.get(word.lower(), word.lower())
    return name if name in SIZES else None


def read_index(path: Path) -> dict[str, dict[str, str]]:
    """Rows of an index by file name.

    Raises:
        UserError: It cannot be read, or has no column `file`.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UserError(f"{path} cannot be read: {error}") from None
    if not rows or "file" not in rows[0]:
        raise UserError(f"{path} needs a header with a column 'file', and any of {', '.join(COLUMNS[1:])}")
    out = {}
    for row in rows:
        row.setdefault("class", row.get("category", ""))
        out[Path(row["file"]).name] = {name: (row.get(name) or "").strip() for name in COLUMNS}
    return out


def _import(path: Path, row: Mapping[str, str], settings: MeshSettings) -> MeshModel:
    prefix, _, rest = path.stem.partition("__")
    name = rest or prefix
    word = row.get("class") or (prefix if rest and class_of(prefix) else settings.class_name or prefix)
    class_name = class_of(word)
    if class_name is None:
        raise MeshError(f"is of unknown class {word!r}, {_known_classes()}; give --class or an index")
    hints = Hints(
        unit=row.get("unit") or settings.unit or prescribed_unit(path),
        up=row.get("up") or settings.up,
        forward=row.get("forward") or settings.forward,
    )
    split = row.get("split") or _split(name, settings)
    if split not in SPLITS:
        raise MeshError(f"has split {split!r}, known are {', '.join(SPLITS)}")
    return make_model(read_mesh(path, settings.seed), name, class_name, split, hints, *usual_frame(path))


def _split(name: str, settings: MeshSettings) -> str:
    """The split whose list names a model, or else the one that it is dealt to."""
    for split in SPLITS:
        if any(fnmatchcase(name, pattern) for pattern in getattr(settings, split)):
            return split
    return split_of(name, {}, settings.seed)


def _known_classes() -> str:
    return f"known are {', '.join(SIZES)}; also {', '.join(ALIASES)}"
