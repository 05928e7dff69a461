"""Model files: digested files of trained forests and of their single trees."""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from storage.digested import Contents, DigestedFormat, read_digested, read_kind, write_digested


class ModelFileError(ValueError):
    """A file that is no model, or none that can be used. The message is one sentence that names the file."""


FORMAT = DigestedFormat("undergrowth model", 2, "model file", ModelFileError, older=(1,))


def write_model(path: Path, kind: str, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> None:
    """Writes a model file: beside, synced and renamed, so that it is whole or absent.

    The same contents give the same bytes, whatever the order of the two mappings.

    Args:
        path: The file; replaced if there is one.
        kind: Which sort of model.
        arrays: By name; integers, floats or booleans.
        metadata: JSON values; no NaN and no infinity.

    Raises:
        ValueError: An array or a value that the file cannot hold.
    """
    write_digested(path, FORMAT, kind, arrays, metadata)


def read_model(path: Path, kind: str | None = None, is_mapped: bool = False) -> Contents:
    """Reads a model file.

    Args:
        path: The file.
        kind: The sort of model that is wanted; None takes any.
        is_mapped: Leave the arrays in the file, see `storage.digested.read_digested`.

    Raises:
        ModelFileError: No such file, no safetensors file, truncated, damaged, another program's, another version
            or kind.
    """
    return read_digested(path, FORMAT, kind, is_mapped)


def read_model_kind(path: Path) -> str:
    """The kind of a model file, by its header; whether the file is whole is found out when it is read.

    Raises:
        ModelFileError: As for `read_model`.
    """
    return read_kind(path, FORMAT)


def take_array(
    arrays: Mapping[str, np.ndarray], name: str, dtype: np.dtype | type, shape: tuple[int | None, ...]
) -> np.ndarray:
    """An array of a model file that must be there.

    Args:
        arrays: As they were read.
        name: Its name.
        dtype: What it must be.
        shape: What it must be; None where any length is right.

    Raises:
        ValueError: It is missing, or of another dtype or shape.
    """
    if name not in arrays:
        raise ValueError(f"array {name} is missing")
    values = arrays[name]
    fits = values.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, values.shape, strict=True))
    if values.dtype != dtype or not fits:
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise ValueError(f"array {name} is {values.dtype} {values.shape}, must be {np.dtype(dtype)} ({wanted})")
    return values


def arrays_of_tree(arrays: Mapping[str, np.ndarray], number: int) -> dict[str, np.ndarray]:
    """The arrays of one tree by their names in it."""
    prefix = f"tree{number}."
    return {name.removeprefix(prefix): values for name, values in arrays.items() if name.startswith(prefix)}


@contextlib.contextmanager
def naming_file(path: Path) -> Iterator[None]:
    """Turns an error about the contents of a file into a ModelFileError that names the file."""
    with FORMAT.naming_file(path):
        yield
