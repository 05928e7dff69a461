"""Files that are whole or absent: written beside their place, synced and renamed."""

import contextlib
import os
import platform
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

TEMPORARY_SUFFIX = ".tmp"
"""How the names of all unfinished files end; a killed process leaves them behind."""


def write_atomically(path: Path, content: bytes | str) -> None:
    """Writes a file beside, syncs and renames it, so that it is whole or absent; an old one is replaced.

    Args:
        path: The file; its folder must be there.
        content: Bytes, or text that is stored as UTF-8.

    Raises:
        OSError: It cannot be written; names the path. Nothing is left beside it.
    """
    with replacing(path) as file:
        file.write(_bytes(content))


def write_all_atomically(contents: Mapping[Path, bytes | str]) -> None:
    """Writes several files: all beside, then synced and renamed one after the other.

    Args:
        contents: By path; folders are made.

    Raises:
        OSError: One cannot be written; names its path. No unfinished file is left.
    """
    with contextlib.ExitStack() as stack:
        for path, content in contents.items():
            with _naming(path):
                path.parent.mkdir(parents=True, exist_ok=True)
            file = stack.enter_context(_unfinished(path))
            with _naming(path):
                file.write(_bytes(content))
                file.close()
        for path in contents:
            _finish(path)
    _sync_folders(contents)


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to be written piece by piece; takes its place when the block ends without an error.

    Args:
        path: The file; an old one is replaced. Its folder must be there.

    Raises:
        OSError: It cannot be written; names the path. Nothing is left beside it.
    """
    with _unfinished(path) as file:
        with _naming(path):
            yield file
            file.close()
        _finish(path)
    _sync_folders([path])


def append(path: Path, text: str) -> None:
    """Adds text to the end of a file, which may be missing; it is on the disk when this returns.

    Raises:
        OSError: It cannot be written; names the path.
    """
    with _naming(path), path.open("ab") as file:
        file.write(_bytes(text))
        file.flush()
        os.fsync(file.fileno())


def is_unfinished(path: Path, finished: str) -> bool:
    """Whether a file is what a killed process left of the file of that name."""
    return path.name.startswith(finished + ".") and path.name.endswith(TEMPORARY_SUFFIX)


@contextlib.contextmanager
def _unfinished(path: Path) -> Iterator[BinaryIO]:
    """The file beside, open for writing; removed if an error passes through."""
    beside = _beside(path)
    with _naming(path):
        file = beside.open("wb")
    try:
        with _naming(path), file:  # closing writes too
            yield file
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def _bytes(content: bytes | str) -> bytes:
    """Text as UTF-8; what of a file's name is no text is written as its code."""
    return content.encode(errors="backslashreplace") if isinstance(content, str) else content


def _finish(path: Path) -> None:
    with _naming(path):
        _sync(_beside(path))
        _beside(path).replace(path)


def _beside(path: Path) -> Path:
    """Of this process on this machine: two that write one file each finish their own."""
    return path.with_name(f"{path.name}.{platform.node()}.{os.getpid()}{TEMPORARY_SUFFIX}")


def _sync_folders(paths: Iterable[Path]) -> None:
    for folder in dict.fromkeys(path.parent for path in paths):
        with _naming(folder):
            _sync(folder)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextlib.contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Errors of the system that name no file, or the one beside, name the file itself."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename not in (None, str(_beside(path))):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
