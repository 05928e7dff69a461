"""Opens model files of every kind."""

import hashlib
from pathlib import Path

from forests.modelfile import ModelFileError, read_model
from forests.skeleton.storage import without_skeleton
from pipelines.errors import UserError
from pipelines.models.asking import Contestant, TakesHints, contestant_of
from pipelines.models.kinds import kind_named


def open_model(path: Path, has_skeleton: bool = True, is_told: bool = False) -> tuple[Contestant, dict]:
    """A model out of its file, and what is told of the file: name, kind, digest, configuration.

    Args:
        path: The file.
        has_skeleton: Whether the model makes one skeleton out of its proposals, if it has learned to.
        is_told: Whether it will be told what its trees ask for beside depth, as in an experiment.

    Raises:
        UserError: There is no such file, it holds no model of a known kind, or one that asks for more than depth.
    """
    try:
        found = read_model(path)
        found = found if has_skeleton else without_skeleton(found)
        predictor = kind_named(found.kind, path).tools().open(path, found)
    except ModelFileError as error:
        raise UserError(str(error)) from None
    if not is_told and isinstance(predictor, TakesHints) and predictor.asks_for_hints:
        raise UserError(
            f"{path} is of an experiment: its trees ask for more than depth, and nothing can tell them"
        )
    config = found.metadata.get("config")
    about = {"name": path.name, "kind": found.kind, "digest": file_digest(path), "config": config}
    return contestant_of(path.stem, predictor), about


def file_digest(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
