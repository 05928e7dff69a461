"""Opens orientation nets, and tells their files from those of other models."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from forests.modelfile import ModelFileError, read_model_kind
from forests.records import to_json
from pipelines.errors import UserError
from pipelines.models.opening import file_digest

if TYPE_CHECKING:
    from nets.orientation.model import OrientationModel
    from nets.orientation.predict import OrientationPredictor

KIND = "orientation"
"""In model files."""


def check_torch() -> None:
    """Makes sure that torch is installed.

    Raises:
        UserError: It is not; says how to get it.
    """
    from nets.runtime import MissingLibraryError, load_torch

    try:
        load_torch()
    except MissingLibraryError as error:
        raise UserError(str(error)) from None


def is_orientation_net(path: Path) -> bool:
    """Whether a file says that it is the model of an orientation net; what is wrong with it is told elsewhere."""
    try:
        return read_model_kind(path) == KIND
    except (ModelFileError, OSError):
        return False


def model_kind(path: Path) -> str:
    """The kind of a model file.

    Raises:
        UserError: It is none.
    """
    try:
        return read_model_kind(path)
    except ModelFileError as error:
        raise UserError(str(error)) from None


def open_orientation_model(path: Path) -> "OrientationModel":
    """A trained net out of its file; torch is not needed.

    Raises:
        UserError: There is no such file, or it holds no orientation net.
    """
    from nets.orientation.storage import load_model

    try:
        return load_model(path)
    except ModelFileError as error:
        raise UserError(str(error)) from None


def open_net(path: Path) -> tuple["OrientationPredictor", dict[str, Any]]:
    """A net out of its file, and what is told of the file: name, kind, digest, configuration.

    Raises:
        UserError: There is no such file, it holds no orientation net, or torch is not installed.
    """
    check_torch()
    from nets.orientation.predict import OrientationPredictor

    model = open_orientation_model(path)
    try:
        predictor = OrientationPredictor(model)
    except ValueError as error:
        raise UserError(f"{path} holds no usable model: {error}") from None
    config = to_json(model.config)
    return predictor, {"name": path.name, "kind": KIND, "digest": file_digest(path), "config": config}
