"""The kinds of model that a file may hold, and how each is made ready to be asked."""

from collections.abc import Callable
from pathlib import Path

from forests.estimate import JointPredictor
from forests.modelfile import ModelFileError, naming_file, read_model
from storage.digested import Contents


def load_model(path: Path | str) -> JointPredictor:
    """Reads a model of any kind and makes it ready to be asked.

    Args:
        path: The model's file.

    Raises:
        ModelFileError: No such file, a kind that is unknown, or no sound model in it.
    """
    path = Path(path)
    return predictor_of(path, read_model(path))


def predictor_of(path: Path, contents: Contents) -> JointPredictor:
    """Makes what was read from a model file ready to be asked.

    Args:
        path: The file, for messages.
        contents: What it holds.

    Raises:
        ModelFileError: A kind that is unknown, or no sound model.
    """
    if contents.kind not in KINDS:
        raise ModelFileError(f"{path} holds a model of kind {contents.kind!r}; known are {', '.join(KINDS)}")
    with naming_file(path):
        return KINDS[contents.kind](contents)


def _regression_forest(contents: Contents) -> JointPredictor:
    from forests.oarf.predict import Predictor
    from forests.oarf.storage import unpack_model

    return Predictor(unpack_model(contents.arrays, contents.metadata))


def _random_walk_forest(contents: Contents) -> JointPredictor:
    from forests.rwf.predict import Predictor
    from forests.rwf.storage import unpack_model

    return Predictor(unpack_model(contents.arrays, contents.metadata))


KINDS: dict[str, Callable[[Contents], JointPredictor]] = {
    "oarf": _regression_forest,
    "rwf": _random_walk_forest,
}
"""By the kind that a model file names."""
