"""Opens model files of every kind."""

import hashlib
from pathlib import Path

from forests.modelfile import ModelFileError, read_model
from forests.skeleton.storage import without_skeleton
from pipelines.errors import UserError
from pipelines.models.asking import Contestant, contestant_of
from pipelines.models.kinds import kind_named


def open_model(path: Path, has_skeleton: bool = True) -> tuple[Contestant, dict]:
    """A model out of its file, and what is told of the file: name, kind, digest, configuration.

    Args:
        path: The file.
        has_skeleton: Whether the model makes one skeleton out of its proposals, if it has learned to.

    Raises:
        UserError: There is no such file, or it holds no model of a known kind.
    """
    try:
        found = read_model(path)
        found = found if has_skeleton else without_skeleton(found)
        predictor = kind_named(found.kind, path).tools().open(path, found)
    except ModelFileError as error:
        raise UserError(str(error)) from None
    config = found.metadata.get("config")
    about = {"name": path.name, "kind": found.kind, "digest": file_digest(path), "config": config}
    return contestant_of(path.stem, predictor), about


def file_digest(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
