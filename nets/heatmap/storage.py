"""Heat map nets as model files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from forests.modelfile import naming_file, read_model, take_array, write_model
from forests.records import from_json, to_json
from nets.heatmap.config import HeatmapConfig
from nets.heatmap.model import N_TERMS, OUTCOMES, HeatmapModel

KIND = "heatmap"
"""In model files."""
_NET = "net."


def save_model(path: Path, model: HeatmapModel, metadata: Mapping[str, Any]) -> None:
    """Writes a model file.

    Args:
        path: The file; replaced if there is one.
        model: The trained net.
        metadata: JSON values that are told beside it.
    """
    arrays = {_NET + name: values for name, values in model.weights.items()}
    own = {"config": to_json(model.config), "joints": list(model.joints)}
    write_model(path, KIND, arrays | {"calibration": model.calibration}, {**metadata, **own})


def load_model(path: Path | str) -> HeatmapModel:
    """Reads a model file.

    Raises:
        ModelFileError: No such file, another kind, or no sound model in it.
    """
    path = Path(path)
    contents = read_model(path, KIND)
    with naming_file(path):
        return unpack_model(contents.arrays, contents.metadata)


def unpack_model(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> HeatmapModel:
    """A model out of what a file holds.

    Raises:
        ValueError: Settings, names or arrays that are none of such a model.
    """
    joints = tuple(metadata["joints"])
    if not joints or not all(isinstance(name, str) for name in joints):
        raise ValueError("its joints have no names")
    calibration = take_array(arrays, "calibration", np.float32, (len(OUTCOMES), len(joints), N_TERMS))
    weights = {name[len(_NET) :]: values for name, values in arrays.items() if name.startswith(_NET)}
    return HeatmapModel(from_json(HeatmapConfig, metadata["config"]), joints, weights, calibration)
