"""Finished trees in a folder beside the model, so that interrupted training goes on after the last of them."""

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np

from forests.modelfile import ModelFileError, read_model, write_model
from pipelines.corpus.folder import first_difference, locked_folder
from pipelines.errors import UserError
from storage.atomic import TEMPORARY_SUFFIX

TreeT = TypeVar("TreeT")

_KIND = "tree"
TREE_FILES = "tree_*.safetensors"
"""Pattern of the names of their files."""


class TreeFolder(Generic[TreeT]):
    """A folder of finished trees, one file each; a `TreeStore` for training.

    Attributes:
        path: The folder.
    """

    def __init__(
        self,
        path: Path,
        settings: Mapping[str, Any],
        pack: Callable[[TreeT], dict[str, np.ndarray]],
        unpack: Callable[[dict[str, np.ndarray]], TreeT],
        noun: str = "trees",
    ) -> None:
        """Takes a folder as it is; `open_trees` checks it.

        Args:
            path: The folder.
            settings: All that the trees hang on, as JSON values.
            pack: A tree as arrays.
            unpack: Undoes `pack`; raises ValueError for other arrays.
            noun: What the pieces are called in errors.
        """
        self.path = path
        self._settings = json.loads(json.dumps(settings))
        self._pack, self._unpack = pack, unpack
        self._noun = noun

    @property
    def n_trees(self) -> int:
        """Trees that are there."""
        return sum(1 for _ in self.path.glob(TREE_FILES))

    def load(self, tree: int) -> TreeT | None:
        """A tree that was finished before, or None."""
        try:
            return self._unpack(read_model(self._file(tree), _KIND).arrays)
        except ValueError:
            return None

    def save(self, tree: int, grown: TreeT) -> None:
        """Keeps a finished tree."""
        write_model(self._file(tree), _KIND, self._pack(grown), self._settings)

    def clear(self) -> None:
        """Forgets all trees."""
        _remove_trees(self.path)

    def check(self) -> None:
        """Makes sure that all trees are of these settings; a damaged file does not count and is removed.

        Raises:
            UserError: Trees of other settings.
        """
        for file in sorted(self.path.glob(TREE_FILES)):
            try:
                there = read_model(file, _KIND).metadata
            except ModelFileError:
                file.unlink()
                continue
            if there != self._settings:
                difference = first_difference("", there, self._settings).lstrip(".")
                raise UserError(
                    f"{self.path} holds {self._noun} trained with other settings: {difference}; "
                    "finish that training, or give --overwrite to delete them"
                )

    def _file(self, tree: int) -> Path:
        return self.path / f"tree_{tree:03d}.safetensors"


def _remove_trees(folder: Path) -> None:
    for file in [*folder.glob(TREE_FILES), *folder.glob("*" + TEMPORARY_SUFFIX)]:
        file.unlink()


def drop_trees(folder: Path) -> None:
    """Removes the folder of trees that a process left that was killed just after it wrote the model.

    Args:
        folder: Where the trees are; may be missing.

    Raises:
        UserError: Another process trains there.
    """
    if folder.is_dir():
        with locked_folder(folder):
            _remove_trees(folder)
            with contextlib.suppress(OSError):
                folder.rmdir()


@contextlib.contextmanager
def open_trees(folder: TreeFolder[TreeT], drops_others: bool = False) -> Iterator[TreeFolder[TreeT]]:
    """Makes and locks the folder, and removes it in the end if no tree is in it.

    Args:
        folder: Where.
        drops_others: Forget trees of other settings instead of refusing.

    Raises:
        UserError: Trees of other settings, or another process trains there.
    """
    folder.path.mkdir(parents=True, exist_ok=True)
    with locked_folder(folder.path):
        try:
            folder.check()
        except UserError:
            if not drops_others:
                raise
            folder.clear()
        try:
            yield folder
        finally:
            with contextlib.suppress(OSError):
                folder.path.rmdir()
