"""Regression forests in model files: arrays and metadata out of a model, and a checked model out of them."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forests.frames import LabelTable
from forests.modelfile import naming_file, read_model, take_array, write_model
from forests.oarf.calibrate import TERMS
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.model import ForestTree, LeafTable, OARFModel, Tuning
from forests.oarf.vote import WEIGHT_ONE
from forests.records import from_json, to_json
from forests.treefile import pack_nodes, unpack_nodes

KIND = "oarf"

_PROBABILITY_ONE = 65535
_FARTHEST_MM = 32000
"""Longest offset along an axis of a leaf mode, as votes take it."""


def save_model(path: Path, model: OARFModel, extra_metadata: Mapping[str, Any] | None = None) -> None:
    """Writes a forest to a file.

    Args:
        path: The file; replaced if there is one.
        model: A forest of quantised trees, as `train` gives it.
        extra_metadata: Further JSON values by name, such as the corpus that it was trained on.

    Raises:
        ValueError: A name of `extra_metadata` that is taken.
    """
    own = {"config": to_json(model.config), "labels": to_json(model.labels)}
    extra = extra_metadata or {}
    if taken := sorted(own.keys() & extra.keys()):
        raise ValueError(f"extra_metadata must not name {', '.join(taken)}")
    write_model(path, KIND, pack_model(model), own | dict(extra))


def load_model(path: Path) -> OARFModel:
    """Reads a forest from a file.

    Raises:
        ModelFileError: No such file, or no sound forest in it.
    """
    contents = read_model(path, KIND)
    with naming_file(path):
        return unpack_model(contents.arrays, contents.metadata)


def pack_model(model: OARFModel) -> dict[str, np.ndarray]:
    """A forest's arrays as a model file holds them."""
    arrays: dict[str, np.ndarray] = {f"tuning.{name}": values for name, values in vars(model.tuning).items()}
    for number, tree in enumerate(model.trees):
        arrays |= {f"tree{number}.{name}": values for name, values in pack_tree(tree).items()}
    return arrays


def unpack_model(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> OARFModel:
    """A forest out of a model file's contents, checked so that no kernel can read beyond an array.

    Raises:
        ValueError: Anything missing, of another shape, or out of its range.
    """
    config = from_json(OARFConfig, metadata.get("config"))
    labels = from_json(LabelTable, metadata.get("labels"))
    trees = []
    for number in range(config.n_trees):
        prefix = f"tree{number}."
        own = {name.removeprefix(prefix): values for name, values in arrays.items() if name.startswith(prefix)}
        trees.append(unpack_tree(own, labels, config))
    classes = ClassTable.of(labels, config.mode)
    return OARFModel(config, labels, classes, tuple(trees), _tuning(arrays, labels.n_joints))


def quantised(tree: ForestTree) -> ForestTree:
    """The tree as a file keeps it: modes to a millimetre, weights to the step that votes are counted in.

    A mode whose weight comes to nothing is left out.
    """
    table = tree.leaves
    units = np.rint(table.weight * WEIGHT_ONE).astype(np.int16)
    mode_mm = np.rint(np.clip(table.mode * 1000.0, -_FARTHEST_MM, _FARTHEST_MM)).astype(np.int16)
    mode_mm *= (units > 0)[..., None]
    probability = np.rint(table.probability * _PROBABILITY_ONE).astype(np.uint16)
    return ForestTree(tree.nodes, _leaf_table(probability, mode_mm, units))


def pack_tree(tree: ForestTree) -> dict[str, np.ndarray]:
    """A quantised tree's arrays as a model file holds them: of the leaf tables only what is not 0."""
    table = tree.leaves
    units = np.rint(table.weight * WEIGHT_ONE).astype(np.int16)
    probability = np.rint(table.probability * _PROBABILITY_ONE).astype(np.uint16)
    return {
        **pack_nodes(tree.nodes),
        "has_class": np.packbits(probability > 0),
        "probability": probability[probability > 0],
        "has_mode": np.packbits(units > 0),
        "mode": np.rint(table.mode[units > 0] * 1000.0).astype(np.int16),
        "weight": units[units > 0],
    }


def unpack_tree(arrays: Mapping[str, np.ndarray], labels: LabelTable, config: OARFConfig) -> ForestTree:
    """Undoes `pack_tree`.

    Args:
        arrays: The tree's.
        labels: The forest's.
        config: The forest's.

    Raises:
        ValueError: Anything missing, of another shape, or out of its range.
    """
    classes = ClassTable.of(labels, config.mode)
    nodes = unpack_nodes(arrays)
    n_leaves = int((nodes["leaf"] >= 0).sum())
    n_layers = 1 if classes.n_classes == classes.n_parts else 2
    probability = _scattered(arrays, "probability", "has_class", np.uint16, (n_leaves, classes.n_classes), ())
    shape = (n_leaves, n_layers, labels.n_joints, config.n_modes)
    units = _scattered(arrays, "weight", "has_mode", np.int16, shape, ())
    mode_mm = _scattered(arrays, "mode", "has_mode", np.int16, shape, (3,))
    if not (units.min(initial=0) >= 0 and np.abs(mode_mm.astype(np.int32)).max(initial=0) <= _FARTHEST_MM):
        raise ValueError(f"leaf modes must be within {_FARTHEST_MM} mm, their weights not below 0")
    total = probability.sum(axis=1, dtype=np.int64)
    if (np.abs(total - _PROBABILITY_ONE) > classes.n_classes).any():
        raise ValueError("the class probabilities of a leaf do not sum to 1")
    return ForestTree(nodes, _leaf_table(probability, mode_mm, units))


def _leaf_table(
    probability: NDArray[np.uint16], mode_mm: NDArray[np.int16], units: NDArray[np.int16]
) -> LeafTable:
    return LeafTable(
        probability.astype(np.float32) / np.float32(_PROBABILITY_ONE),
        mode_mm.astype(np.float32) / np.float32(1000.0),
        units.astype(np.float32) / np.float32(WEIGHT_ONE),
    )


def _scattered(
    arrays: Mapping[str, np.ndarray],
    name: str,
    mask_name: str,
    dtype: type,
    shape: tuple[int, ...],
    of_entry: tuple[int, ...],
) -> np.ndarray:
    """A table of which the file holds the entries that are not 0, and a bit for each entry."""
    size = math.prod(shape)
    bits = take_array(arrays, mask_name, np.uint8, (-(-size // 8),))
    is_kept = np.unpackbits(bits, count=size).astype(bool).reshape(shape)
    kept = take_array(arrays, name, dtype, (int(is_kept.sum()), *of_entry))
    table: np.ndarray = np.zeros((*shape, *of_entry), dtype)
    table[is_kept] = kept
    return table


def _tuning(arrays: Mapping[str, np.ndarray], n_joints: int) -> Tuning:
    weights = (n_joints, len(TERMS))
    tuning = Tuning(
        take_array(arrays, "tuning.max_offset_m", np.float32, (n_joints,)),
        take_array(arrays, "tuning.bandwidth_m", np.float32, (n_joints,)),
        take_array(arrays, "tuning.within_weights", np.float32, weights),
        take_array(arrays, "tuning.hidden_weights", np.float32, weights),
    )
    if not (tuning.max_offset_m > 0).all():
        raise ValueError("max_offset_m of a joint is not above 0")
    if not ((tuning.bandwidth_m > 0.001) & (tuning.bandwidth_m < 10.0)).all():
        raise ValueError("bandwidth_m of a joint is not in 0.001..10 m")
    for values in (tuning.within_weights, tuning.hidden_weights):
        if np.isinf(values).any() or (np.isnan(values).any(axis=1) != np.isnan(values).all(axis=1)).any():
            raise ValueError("the weights of a joint's probability are not finite")
    return tuning
