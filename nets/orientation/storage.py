"""Orientation nets as model files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from forests.modelfile import naming_file, read_model, write_model
from forests.records import from_json, to_json
from nets.orientation.config import POSTURES, OrientationConfig
from nets.orientation.model import Calibration, OrientationModel

KIND = "orientation"
"""In model files."""


def save_model(path: Path, model: OrientationModel, metadata: Mapping[str, Any]) -> None:
    """Writes a model file.

    Args:
        path: The file; replaced if there is one.
        model: The trained net.
        metadata: JSON values that are told beside it.
    """
    own = {
        "config": to_json(model.config),
        "calibration": model.calibration._asdict(),
        "postures": list(POSTURES),
    }
    write_model(path, KIND, model.weights, {**metadata, **own})


def load_model(path: Path | str) -> OrientationModel:
    """Reads a model file.

    Raises:
        ModelFileError: No such file, another kind, or no sound model in it.
    """
    path = Path(path)
    contents = read_model(path, KIND)
    with naming_file(path):
        return unpack_model(contents.arrays, contents.metadata)


def unpack_model(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> OrientationModel:
    """A model out of what a file holds.

    Raises:
        ValueError: Settings or a calibration that are none, or other postures.
    """
    config = from_json(OrientationConfig, metadata["config"])
    if metadata["postures"] != list(POSTURES):
        raise ValueError(f"it knows the postures {metadata['postures']}, this program {list(POSTURES)}")
    values = {name: float(metadata["calibration"][name]) for name in Calibration._fields}
    calibration = Calibration(**values)
    if not (np.isfinite(list(values.values())).all() and 0.0 <= calibration.outliers < 1.0):
        raise ValueError(f"its calibration {values} is none")
    return OrientationModel(config, dict(arrays), calibration)
