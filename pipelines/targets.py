"""Where commands write: checked before any work, so that nothing of others is ever replaced."""

from collections.abc import Callable, Iterable
from pathlib import Path

from pipelines.errors import UserError

PNG_MARK = b"Software\0undergrowth"
"""Text that pictures of ours carry."""
_HEAD_BYTES = 4096
_MARKS = {
    ".png": PNG_MARK,
    ".html": b'<meta name="generator" content="undergrowth">',
    ".json": b'"schema": "undergrowth ',
    ".jsonl": b'"schema":"undergrowth ',
    ".md": b"<!-- undergrowth model card -->",
}
"""What files of ours have near their beginning, by kind."""


def check_file(path: Path, read: Callable[[Path], object], overwrite: bool | None = None) -> None:
    """Makes sure that a file may be written.

    Args:
        path: The file.
        read: Reads a file of the sort that is written; what it raises says that a file is none.
        overwrite: Whether a file of ours may be replaced; None if the command replaces its own without asking.

    Raises:
        UserError: The folder is missing, a folder or a foreign file is there, or a file that may not be replaced.
    """
    check_place(path)
    if not path.exists():
        return
    try:
        read(path)
    except (ValueError, UserError) as error:
        raise UserError(f"{error}; it will not be overwritten, so choose another file") from None
    if overwrite is False:
        raise UserError(f"{path} exists already; add --overwrite to replace it")


def check_place(path: Path) -> None:
    """Makes sure that the folder of a file is there, and that no folder has the file's name.

    Raises:
        UserError: It is not, or one has.
    """
    if not path.parent.is_dir():
        raise UserError(f"{path.parent} is not a folder; create it first")
    if path.is_dir():
        raise UserError(f"{path} is a folder; give the name of a file")


def check_folder(folder: Path, names: Iterable[str] = ()) -> None:
    """Makes sure that files may be written into a folder, which may be missing.

    Args:
        folder: The folder.
        names: Of the pictures, pages and JSON files that will be written; those that are there must be ours.

    Raises:
        UserError: A file has the name of the folder or of one above it, or a file of others would be replaced.
    """
    above = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not above.is_dir():
        raise UserError(f"{above} is a file, not a folder")
    for name in names:
        check_ours(folder / name, Path(name).suffix)


def check_ours(path: Path, kind: str) -> None:
    """Makes sure that a picture, page, card or JSON file was written by this program, if it is there.

    Args:
        path: The file.
        kind: ".png", ".html", ".json", ".jsonl" or ".md".

    Raises:
        UserError: It was not, or a folder has its name.
    """
    if not path.exists():
        return
    if path.is_dir():
        raise UserError(f"{path} is a folder; choose another place for the results")
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    if _MARKS[kind] not in head:
        raise UserError(
            f"{path} was not written by this command; it will not be overwritten, so choose another place"
        )
