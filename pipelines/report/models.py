"""The models behind the main table, where they still lie in the ablation's folder."""

from pathlib import Path
from typing import Any, NamedTuple

from pipelines.models.asking import Contestant
from pipelines.models.opening import file_digest, open_model
from pipelines.report.source import Source


class Trained(NamedTuple):
    """A model out of its file.

    Attributes:
        contestant: As it is asked.
        about: What is told of the file: name, kind, digest, configuration.
    """

    contestant: Contestant
    about: dict[str, Any]


def first_model(source: Source, name: str) -> Trained | None:
    """The model of a method's first training, if the file is the one that was scored."""
    model = source.main["rows"][name]["trainings"][0]["model"]
    path: Path = source.folder / model["file"]
    if not path.is_file() or file_digest(path) != model["digest"]:
        return None
    return Trained(*open_model(path))


def first_models(source: Source) -> dict[str, Trained]:
    """By method, those that are there."""
    models = {name: first_model(source, name) for name in source.rows}
    return {name: model for name, model in models.items() if model is not None}
