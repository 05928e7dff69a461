"""Files that a file names: they must be there, inside the folder that is imported unless told otherwise."""

import re
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from pipelines.foreign import ForeignFileError
from pipelines.importing.meshfiles.xmlfile import read_xml

_PACKAGE = re.compile(r"(?:package|model)://+([^/]+)/+(.*)", re.DOTALL)
_SCHEME = re.compile(r"[a-zA-Z][a-zA-Z0-9+.-]+:")


@dataclass(frozen=True)
class Reach:
    """Which files may be opened because another file names them.

    Attributes:
        folder: The folder that is imported.
        is_outside_allowed: Whether files outside it may be opened too.
    """

    folder: Path
    is_outside_allowed: bool = False

    def open(self, by: Path, name: str) -> Path:
        """The file that is meant.

        Args:
            by: The file that names it.
            name: As written there: a path relative to that file, `package://`, `model://`, `file://`, or absolute.

        Raises:
            ForeignFileError: It is not there, or is outside the folder.
        """
        found = self.find(by, name)
        if found is None and not self.is_outside_allowed:
            found = Reach(self.folder, True).find(by, name)
        if found is None:
            raise ForeignFileError(f"{by} names {name}, which is not there")
        if not self._is_inside(found) and not self.is_outside_allowed:
            raise ForeignFileError(
                f"{by} names {name}, which is outside {self.folder}; --outside-meshes allows that"
            )
        return found

    def find(self, by: Path, name: str) -> Path | None:
        """Likewise, without a check of where it is; None if it is not there or is no file."""
        for candidate in self._candidates(by, name.strip()):
            try:
                if candidate.is_file():
                    return candidate
            except (OSError, ValueError):  # such as a name that is too long or holds a zero
                continue
        return None

    def _candidates(self, by: Path, name: str) -> list[Path]:
        if package := _PACKAGE.fullmatch(name):
            rest = _unix(package[2])
            return [folder / rest for folder in self._packages(by, package[1])] if rest else []
        if name.startswith("file:"):
            name = unquote(re.sub(r"^file:(//(localhost(?=/))?)?", "", name))
            name = name[1:] if re.match(r"/[A-Za-z]:", name) else name
        elif _SCHEME.match(name) and not re.match(r"[A-Za-z]:[\\/]", name):
            return []
        return [by.parent / name, by.parent / _unix(name), by.parent / unquote(name)] if name else []

    def _packages(self, by: Path, name: str) -> list[Path]:
        """Folders that may be a package, the best first: by its name, by what its package.xml says, any above."""
        above = list(by.resolve().parents) if self.is_outside_allowed else []
        above = above or [folder for folder in by.parents if self._is_inside(folder)]
        named = [folder for folder in above if folder.resolve().name == name]
        beside = [folder / name for folder in above if (folder / name).is_dir()]
        said = [folder for folder in above if _package_name(folder) == name]
        return [*said, *named, *beside, *(folder for folder in above if folder not in (*said, *named))]

    def _is_inside(self, path: Path) -> bool:
        try:
            return path.resolve().is_relative_to(self.folder.resolve())
        except (OSError, RuntimeError):  # links in a circle
            return False


def _unix(name: str) -> str:
    return name.replace("\\", "/")


def _package_name(folder: Path) -> str | None:
    path = folder / "package.xml"
    try:
        return (read_xml(path).findtext("name") or "").strip() if path.is_file() else None
    except (OSError, ValueError):
        return None
