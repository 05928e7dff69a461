"""Files that others made: whatever a reader raises about one becomes one sentence that names the file."""

import contextlib
import logging
from collections.abc import Iterator
from pathlib import Path

from pipelines.errors import UserError

MAX_BYTES = 2**31
"""No foreign file may make a reader take more memory than this."""
_LIBRARIES = ("collada", "trimesh", "yourdfpy")
"""Readers that log what they dislike; our users are told in errors, in one line."""


class ForeignFileError(UserError):
    """A file that cannot be read; the others of its folder can."""


@contextlib.contextmanager
def reading(path: Path, what: str) -> Iterator[None]:
    """Reads a foreign file inside; an error becomes a `ForeignFileError` of one line.

    Args:
        path: The file.
        what: What it should be, with its article, such as "a BVH file".

    Raises:
        ForeignFileError: The file cannot be opened, is damaged, or is something else.
    """
    try:
        with _quiet():
            yield
    except UserError:
        raise
    except FileNotFoundError:
        raise ForeignFileError(f"there is no file {path}") from None
    except OSError as error:
        raise ForeignFileError(f"cannot read {path}: {error.strerror or _one_line(error)}") from None
    except MemoryError:
        raise ForeignFileError(
            f"{path} asks for more memory than there is; it is damaged, or not {what}"
        ) from None
    except Exception as error:  # libraries raise anything about a damaged file
        raise ForeignFileError(f"{path} is damaged, or not {what}: {_one_line(error)}") from None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keeps the libraries' log lines off the terminal."""
    loggers = [logging.getLogger(name) for name in _LIBRARIES]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def check_size(path: Path, n_bytes: int, what: str) -> None:
    """Refuses a file whose header promises too much, before memory is taken.

    Args:
        path: The file.
        n_bytes: What its contents would take in memory.
        what: What takes it, such as "its 30000x30000 pixels".

    Raises:
        ForeignFileError: It is more than `MAX_BYTES`.
    """
    if n_bytes > MAX_BYTES:
        limit = MAX_BYTES / 2**30
        raise ForeignFileError(
            f"{path}: {what} would take {n_bytes / 2**30:.1f} GiB; at most {limit:g} GiB are read"
        )


def _one_line(error: BaseException) -> str:
    """The first line of an error's message, or its type's name if it has none."""
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else type(error).__name__
