"""Which files of a folder are models, and what they are called."""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from pipelines.errors import UserError
from pipelines.importing.index import shown
from pipelines.importing.meshfiles.reach import Reach
from pipelines.importing.meshfiles.read import KINDS
from pipelines.importing.meshfiles.urdf import part_names


@dataclass(frozen=True)
class Listing:
    """The mesh files of a folder.

    Attributes:
        files: All of them.
        names: Name of each file that is a model; once in the folder, but for one model in several formats.
        parts: Those that belong to a URDF.
        left_out: Those that lie among parts, and why they are no models.
    """

    files: tuple[Path, ...]
    names: dict[Path, str]
    parts: frozenset[Path]
    left_out: dict[Path, str]


def mesh_files(folder: Path) -> tuple[Path, ...]:
    """All mesh files at any depth, but hidden ones.

    Raises:
        UserError: There is no folder, or no file.
    """
    if not folder.is_dir():
        raise UserError(f"{folder} is not a folder")
    files = []
    for path in sorted(folder.rglob("*")):
        parts = path.relative_to(folder).parts
        is_hidden = any(part.startswith(".") or part == "__MACOSX" for part in parts)
        if path.suffix.lower() in KINDS and not is_hidden and path.is_file():
            files.append(path)
    if not files:
        raise UserError(f"{folder} has no files of these kinds: {', '.join(KINDS)}")
    return tuple(files)


def listed(folder: Path, files: tuple[Path, ...], indexed: Collection[Path], reach: Reach) -> Listing:
    """Tells models from the parts of URDFs, and names them.

    A mesh that a URDF names is a part of it. So is a mesh that lies beside such parts in a subfolder, unless the
    index lists it: collections store an object's mesh in several formats there.

    Args:
        folder: The folder that is imported.
        files: Its mesh files.
        indexed: Those that the index lists.
        reach: Finds what the URDFs name.
    """
    owners = _owners(files, reach)
    by_folder = {part.parent: owner for part, owner in owners.items() if part.parent != folder.resolve()}
    parts = frozenset(path for path in files if _resolved(path) in owners)
    left_out: dict[Path, str] = {}
    for path in files:
        place = _resolved(path)
        if (
            path not in parts
            and place.parent in by_folder
            and path not in indexed
            and path.suffix.lower() != ".urdf"
        ):
            owner = shown(by_folder[place.parent].relative_to(folder))
            left_out[path] = f"lies among the parts of {owner}; it becomes a model if an index lists it"
    models = [path for path in files if path not in parts and path not in left_out]
    return Listing(files, _names(folder, models, indexed), parts, left_out)


def _owners(files: tuple[Path, ...], reach: Reach) -> dict[Path, Path]:
    """The URDF of each file that one names, both visual and collision meshes."""
    owners: dict[Path, Path] = {}
    for path in files:
        if path.suffix.lower() != ".urdf":
            continue
        try:
            names = part_names(path)
        except OSError:
            continue  # told when it is read
        for name in names:
            found = reach.find(path, name)
            if found is not None:
                owners.setdefault(_resolved(found), path)
    return owners


def _resolved(path: Path) -> Path:
    try:
        return path.resolve()
    except (OSError, RuntimeError):
        return path


def _names(folder: Path, models: list[Path], indexed: Collection[Path]) -> dict[Path, str]:
    """Path in the folder, without the class before the file's name, unless that is needed to tell two apart."""
    stems = {path: shown(path.relative_to(folder).with_suffix("")) for path in models}
    short = {path: _without_class(stem) for path, stem in stems.items()}
    spellings: dict[str, set[str]] = {}
    for path, name in short.items():
        spellings.setdefault(name, set()).add(stems[path])
    names = {path: name if len(spellings[name]) == 1 else stems[path] for path, name in short.items()}
    n_indexed = Counter(names[path] for path in models if path in indexed)
    return {
        path: f"{name}{path.suffix.lower()}" if path in indexed and n_indexed[name] > 1 else name
        for path, name in names.items()
    }


def _without_class(stem: str) -> str:
    folders, slash, name = stem.rpartition("/")
    prefix, _, rest = name.partition("__")
    return folders + slash + (rest or prefix)
