"""An object library out of mesh files and URDFs."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pipelines.errors import UserError
from pipelines.foreign import ForeignFileError, reading
from pipelines.importing.index import Index, shown
from pipelines.importing.listing import listed, mesh_files
from pipelines.importing.meshfiles.reach import Reach
from pipelines.importing.meshfiles.read import KINDS, read_mesh
from pipelines.importing.splits import SplitRule
from pipelines.progress import progress
from synth.occluders.imported.model import make_model
from synth.occluders.imported.shape import MeshError
from synth.occluders.imported.sizes import SIZES, Hints
from synth.occluders.meshlib import MeshLibrary, MeshModel
from synth.vocabulary import SPLITS

log = logging.getLogger(__name__)

ALIASES: dict[str, str] = {
    "desk": "table", "sofa": "chair", "couch": "chair", "bench": "chair", "stool": "chair", "tv": "monitor",
    "screen": "monitor", "bag": "suitcase", "pram": "stroller", "stroller_like": "stroller", "box": "other",
    "bin": "other", "cart": "other",
}  # fmt: skip
"""Other words for classes, in file names and indices."""
_NOTHING: Mapping[str, str] = {}


@dataclass(frozen=True)
class MeshOptions:
    """How mesh files become a library.

    Attributes:
        splits: Deals the models to the splits.
        class_name: Class of all files that neither the index nor their name says one of; None = it must be said.
        index: What is known of single files; None if nothing is.
        hints: Unit, up and forward axis of all files that the index gives none for.
        is_outside_allowed: Whether URDF and glTF files may name files outside the folder.
    """

    splits: SplitRule = field(default_factory=SplitRule)
    class_name: str | None = None
    index: Index | None = None
    hints: Hints = field(default_factory=Hints)
    is_outside_allowed: bool = False

    def __post_init__(self) -> None:
        if self.class_name is not None and class_of(self.class_name) is None:
            raise UserError(f"class {self.class_name!r} is unknown, {_known_classes()}")


@dataclass(frozen=True)
class _Item:
    """A file on its way in: its name in the library, its path in the folder, and the index's row."""

    path: Path
    name: str
    relative: Path
    row: Mapping[str, str]


@dataclass(frozen=True)
class _Imported:
    """A model with what its user should know; as text, the line that tells of it."""

    path: Path
    model: MeshModel
    is_up_stated: bool
    warnings: tuple[str, ...]

    def __str__(self) -> str:
        model = self.model
        line = (
            f"{model.class_name:<8} {model.name:<28} {model.split:<5} {len(model.faces):5d} faces "
            f"{len(model.boxes):4d} boxes, {model.frame}{'' if self.is_up_stated else ' (assumed)'}, {model.role}"
        )
        return f"{line}; warning: {'; '.join(self.warnings)}" if self.warnings else line


def import_meshes(folder: Path, options: MeshOptions) -> MeshLibrary:
    """Reads all files and makes those into models that can be.

    Args:
        folder: Where the files are, at any depth.
        options: How they become a library.

    Raises:
        UserError: There is no file, none can be used, or the index lists a file that is not there.
    """
    files = mesh_files(folder)
    reach = Reach(folder, options.is_outside_allowed)
    rows = {} if options.index is None else options.index.by_file(folder, files)
    listing = listed(folder, files, rows.keys(), reach)
    models: dict[str, _Imported] = {}
    refused = []
    for path, name in progress(list(listing.names.items()), "file", "import meshes"):
        item = _Item(path, name, path.relative_to(folder), rows.get(path, _NOTHING))
        if name in models:
            refused.append(f"left out: {path} has the name of {models[name].path.name}, which is imported")
            continue
        try:
            models[name] = _import(item, options, reach)
        except ForeignFileError as error:
            refused.append(f"refused: {error}")
    for made in models.values():
        log.log(logging.WARNING if made.warnings else logging.INFO, "%s", made)
    if listing.parts:
        log.info("%d meshes are parts of URDF files, not models of their own", len(listing.parts))
    for path, reason in listing.left_out.items():
        log.info("left out: %s %s", shown(path), reason)
    for line in refused:
        log.warning("%s", shown(line))
    if not models:
        raise UserError(f"none of the {len(files)} files in {folder} can be used")
    return MeshLibrary(tuple(made.model for made in models.values()), {"seed": options.splits.seed})


def class_of(word: str) -> str | None:
    """The class that a word means; None if it is unknown."""
    name = ALIASES.get(word.lower(), word.lower())
    return name if name in SIZES else None


def _import(item: _Item, options: MeshOptions, reach: Reach) -> _Imported:
    """A model out of a file.

    Raises:
        ForeignFileError: It cannot be used.
    """
    path = item.path
    with reading(path, KINDS[path.suffix.lower()]), np.errstate(all="ignore"):
        try:
            class_name = _class_name(item, options)
            split = item.row.get("split") or options.splits.split_of(item.name)
            if split not in SPLITS:
                raise MeshError(f"has split {split!r}, known are {', '.join(SPLITS)}")
            pose_key = f"{options.splits.seed}/{shown(item.relative.with_suffix(''))}"
            file = read_mesh(path, reach, pose_key)
            hints = Hints(
                unit=item.row.get("unit") or options.hints.unit or file.unit,
                up=item.row.get("up") or options.hints.up,
                forward=item.row.get("forward") or options.hints.forward,
            )
            model, frame = make_model(file.triangles, item.name, class_name, split, hints, file.said)
        except MeshError as error:
            raise ForeignFileError(f"{path} {error}") from None
    return _Imported(path, model, frame.is_up_stated, (*frame.warnings, *file.notes))


def _class_name(item: _Item, options: MeshOptions) -> str:
    """The class that the index, the file's name, the option or a folder's name says.

    Raises:
        MeshError: None does.
    """
    prefix, _, rest = item.path.stem.partition("__")
    in_name = prefix if rest and class_of(prefix) else None
    folders = [name.partition("__")[0] for name in reversed(item.relative.parent.parts)]
    in_folders = next((name for name in folders if class_of(name)), None)
    word = item.row.get("class") or in_name or options.class_name or in_folders or prefix
    class_name = class_of(word)
    if class_name is None:
        raise MeshError(f"has the unknown class {word!r}, {_known_classes()}; give --class or an index")
    return class_name


def _known_classes() -> str:
    return f"known are {', '.join(SIZES)}; also {', '.join(ALIASES)}"
