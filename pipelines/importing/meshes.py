"""An object library out of mesh files and URDFs."""

import csv
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.errors import UserError
from pipelines.importing.meshfiles import USUAL_UP, prescribed_unit, read_mesh, usual_frame
from pipelines.importing.splits import SplitRule
from pipelines.progress import progress
from synth.occluders.imported.model import Hints, make_model
from synth.occluders.imported.shape import MeshError
from synth.occluders.imported.sizes import SIZES
from synth.occluders.meshlib import MeshLibrary, MeshModel
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
class MeshOptions:
    """How mesh files become a library.

    Attributes:
        splits: Deals the models to the splits.
        class_name: Class of all files that neither the index nor their name says one of; None = it must be said.
        index: Rows by file name; see `read_index`.
        hints: Unit, up and forward axis of all files that the index gives none for.
    """

    splits: SplitRule = field(default_factory=SplitRule)
    class_name: str | None = None
    index: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    hints: Hints = field(default_factory=Hints)

    def __post_init__(self) -> None:
        if self.class_name is not None and class_of(self.class_name) is None:
            raise UserError(f"class {self.class_name!r} is unknown, {_known_classes()}")


def import_meshes(folder: Path, options: MeshOptions) -> MeshLibrary:
    """Reads all files and makes those into models that can be.

    Args:
        folder: Where the files are, at any depth.
        options: How they become a library.

    Raises:
        UserError: There is no file, none can be used, or the index lists a file that is not there.
    """
    if not folder.is_dir():
        raise UserError(f"{folder} is not a folder")
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in USUAL_UP)
    if not files:
        raise UserError(f"{folder} has no files of these kinds: {', '.join(USUAL_UP)}")
    missing = sorted(set(options.index) - {path.name for path in files})
    if missing:
        raise UserError(f"the index lists {missing[0]}, which is not in {folder}")
    models: dict[str, MeshModel] = {}
    refused = []
    for path in progress(files, "file", "import meshes"):
        try:
            model = _import(path, options.index.get(path.name, {}), options)
            if model.name in models:
                raise MeshError(f"has the same name as another model: {model.name}")
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
        raise UserError(f"none of the {len(files)} files in {folder} can be used")
    return MeshLibrary(tuple(models.values()), {"seed": options.splits.seed})


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


def _import(path: Path, row: Mapping[str, str], options: MeshOptions) -> MeshModel:
    prefix, _, rest = path.stem.partition("__")
    name = rest or prefix
    word = row.get("class") or (prefix if rest and class_of(prefix) else options.class_name or prefix)
    class_name = class_of(word)
    if class_name is None:
        raise MeshError(f"has the unknown class {word!r}, {_known_classes()}; give --class or an index")
    hints = Hints(
        unit=row.get("unit") or options.hints.unit or prescribed_unit(path),
        up=row.get("up") or options.hints.up,
        forward=row.get("forward") or options.hints.forward,
    )
    split = row.get("split") or options.splits.split_of(name)
    if split not in SPLITS:
        raise MeshError(f"has split {split!r}, known are {', '.join(SPLITS)}")
    return make_model(read_mesh(path, options.splits.seed), name, class_name, split, hints, *usual_frame(path))


def _known_classes() -> str:
    return f"known are {', '.join(SIZES)}; also {', '.join(ALIASES)}"
