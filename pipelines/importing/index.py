"""The index of a folder of meshes: a CSV file whose rows are keyed by the files' paths in the folder."""

import csv
import io
import os
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipelines.errors import UserError
from pipelines.foreign import check_size, reading

COLUMNS = ("file", "class", "unit", "up", "forward", "split")
"""Columns of an index that are read; `category` may stand for `class`, others are left alone."""
_SHOWN = 3
"""So many paths are listed in an error."""


@dataclass(frozen=True)
class Row:
    """A row of an index.

    Attributes:
        line: Its line in the file, for errors.
        file: The path as written.
        values: By column; empty where the index is silent.
    """

    line: int
    file: str
    values: Mapping[str, str]


@dataclass(frozen=True)
class Index:
    """An index.

    Attributes:
        path: Where it is.
        rows: Its rows in their order.
    """

    path: Path
    rows: Sequence[Row]

    def by_file(self, folder: Path, files: Iterable[Path]) -> dict[Path, Mapping[str, str]]:
        """Values of each file that a row names.

        Args:
            folder: The folder that is imported.
            files: All mesh files in it.

        Raises:
            UserError: A row names a file that is not there, or more than one, or one that another row says
                something else of.
        """
        places = _Places(folder, files)
        out: dict[Path, Mapping[str, str]] = {}
        for row in self.rows:
            found = places.find(row.file, self.path.parent)
            if not found:
                reason = "is of a kind that is not read" if _is_there(folder / row.file) else f"is not in {folder}"
                raise UserError(f"{self.path}, line {row.line}: it lists {row.file}, which {reason}")
            if len(found) > 1:
                listed = ", ".join(shown(path) for path in found[:_SHOWN]) + (
                    ", ..." if len(found) > _SHOWN else ""
                )
                raise UserError(
                    f"{self.path}, line {row.line}: {row.file} may be any of {len(found)} files ({listed}); "
                    f"write its path in {folder}"
                )
            if out.setdefault(found[0], row.values) != row.values:
                raise UserError(f"{self.path}, line {row.line}: it lists {row.file} again, with other values")
        return out


def read_index(path: Path) -> Index:
    """An index: UTF-8, UTF-16 with a byte order mark, or Windows-1252; separated by commas, semicolons or tabs.

    Raises:
        UserError: It cannot be read, or has no column `file`.
    """
    with reading(path, "a CSV file"):
        check_size(path, path.stat().st_size, "it")
        text = _decoded(path.read_bytes())
        reader = csv.reader(io.StringIO(text, newline=""), delimiter=_delimiter(text))
        table = [(reader.line_num, row) for row in reader]
    table = [(line, row) for line, row in table if any(cell.strip() for cell in row)]
    if table and table[0][1][0].lower().startswith("sep="):
        table = table[1:]
    header = [cell.strip().lower() for cell in table[0][1]] if table else []
    if "file" not in header:
        raise UserError(f"{path} needs a header with a column 'file', and any of {', '.join(COLUMNS[1:])}")
    rows = []
    for line, cells in table[1:]:
        values = {name: cell.strip() for name, cell in zip(header, cells, strict=False)}
        values.setdefault("class", values.get("category", ""))
        if values.get("file"):
            kept = {name: values.get(name, "") for name in COLUMNS[1:]}
            rows.append(
                Row(
                    line,
                    values["file"],
                    {**kept, "up": kept["up"].lower().removesuffix("_up"), "unit": kept["unit"].lower()},
                )
            )
    return Index(path, rows)


def shown(path: Path | str) -> str:
    """A path with slashes, or a text with paths, that any terminal can show, whatever their bytes."""
    text = path if isinstance(path, str) else path.as_posix()
    return text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def _decoded(data: bytes) -> str:
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def _delimiter(text: str) -> str:
    """What separates the cells of the header, or what a first line `sep=;` says."""
    lines = [line for line in text.splitlines() if line.strip()]
    if lines and lines[0].lower().startswith("sep=") and len(lines[0].strip()) == 5:
        return lines[0].strip()[4]
    return max(",;\t", key=lines[0].count) if lines else ","


class _Places:
    """Files of a folder by the ways to write their paths."""

    def __init__(self, folder: Path, files: Iterable[Path]) -> None:
        self._folder = folder
        self._by_key: dict[str, list[Path]] = {}
        self._by_name: dict[str, list[Path]] = {}
        for path in files:
            relative = path.relative_to(folder)
            for key in _spellings(relative):
                self._by_key.setdefault(key, []).append(path)
                self._by_name.setdefault(key.rpartition("/")[2], []).append(path)

    def find(self, text: str, index_folder: Path) -> list[Path]:
        """The files that a path may mean: in the folder, else beside the index, else by the end of their paths."""
        for written in (text, text.replace("\\", "/")):
            key = _key(written)
            if key in self._by_key:
                return self._by_key[key]
            beside = _inside(index_folder / written, self._folder)
            if beside is not None and (found := self._by_key.get(_key(beside))):
                return found
            ends = [
                path
                for path in self._by_name.get(key.rpartition("/")[2], [])
                if any(
                    f"/{spelling}".endswith(f"/{key}") for spelling in _spellings(path.relative_to(self._folder))
                )
            ]
            if ends:
                return ends
        return []


def _is_there(path: Path) -> bool:
    """Whether a file exists; a name that no file can have, such as one that is too long, does not."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def _inside(path: Path, folder: Path) -> str | None:
    try:
        return path.resolve().relative_to(folder.resolve()).as_posix()
    except (OSError, ValueError, RuntimeError):
        return None


def _spellings(relative: Path) -> set[str]:
    """Keys of a path; a name that is not UTF-8 may also be written as Windows shows its bytes."""
    data = os.fsencode(relative.as_posix())
    try:
        return {_key(data.decode("utf-8"))}
    except UnicodeDecodeError:
        return {_key(data.decode("utf-8", "backslashreplace")), _key(data.decode("cp1252", "replace"))}


def _key(text: str) -> str:
    """A path without ./ and double slashes, in the one form of letters with accents."""
    parts = [part for part in unicodedata.normalize("NFC", text).split("/") if part not in ("", ".")]
    return "/".join(parts)
