"""Regression forests in model files: arrays and metadata out of a model, and a checked model out of them."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from forests.frames import LabelTable
from forests.modelfile import arrays_of_tree, naming_file, read_model, take_array, write_model
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.evidence import TERMS
from forests.oarf.model import ForestTree, OARFModel, Tuning
from forests.oarf.packed import PackedLeaves, check_leaves, voting
from forests.records import from_json, to_json
from forests.skeleton.storage import pack_skeleton, unpack_skeleton
from forests.tree import pack_inner_nodes, pack_nodes, unpack_nodes

KIND = "oarf"

_CONTEXT = "context."
"""Of the names of the arrays of a forest whose labels are asked for."""
_LEAF_ARRAYS = ("has_class", "probability", "has_vote", "vote", "weight")


def save_model(path: Path, model: OARFModel, extra_metadata: Mapping[str, Any] | None = None) -> None:
    """Writes a forest to a file.

    Args:
        path: The file; replaced if there is one.
        model: The forest.
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
    """A forest's arrays as a model file holds them: without the votes that are too long to be cast."""
    arrays: dict[str, np.ndarray] = {f"tuning.{name}": values for name, values in vars(model.tuning).items()}
    for number, tree in enumerate(model.trees):
        leaves = voting(tree.leaves, model.tuning.max_offset_m)
        packed = pack_inner_nodes(tree.nodes) | _pack_leaves(tree._replace(leaves=leaves))
        arrays |= {f"tree{number}.{name}": values for name, values in packed.items()}
    if model.context is not None:
        arrays |= {_CONTEXT + name: values for name, values in pack_model(model.context).items()}
    return arrays | pack_skeleton(model.skeleton)


def unpack_model(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> OARFModel:
    """A forest out of a model file's contents, checked so that no kernel can read beyond an array.

    Raises:
        ValueError: Anything missing, of another shape, or out of its range.
    """
    config = from_json(OARFConfig, metadata.get("config"))
    labels = from_json(LabelTable, metadata.get("labels"))
    trees = []
    for number in range(config.n_trees):
        trees.append(unpack_tree(arrays_of_tree(arrays, number), labels, config))
    classes = ClassTable.of(labels, config.mode)
    tuning, skeleton = _tuning(arrays, labels.n_joints), unpack_skeleton(arrays, labels.joints)
    first = {name.removeprefix(_CONTEXT): arrays[name] for name in arrays if name.startswith(_CONTEXT)}
    if any(name.startswith(_CONTEXT) for name in first):
        raise ValueError("a forest that others ask for labels asks for labels itself")
    context = unpack_model(first, metadata) if first else None
    return OARFModel(config, labels, classes, tuple(trees), tuning, skeleton, context)


def pack_tree(tree: ForestTree) -> dict[str, np.ndarray]:
    """A tree's arrays as files hold it while training runs, with all its votes."""
    return pack_nodes(tree.nodes) | _pack_leaves(tree)


def _pack_leaves(tree: ForestTree) -> dict[str, np.ndarray]:
    further: dict[str, np.ndarray] = {"facing": tree.leaves.facing} if len(tree.leaves.facing) else {}
    if tree.hints is not None:
        further["hints"] = tree.hints
    return {name: getattr(tree.leaves, name) for name in _LEAF_ARRAYS} | further


def unpack_tree(arrays: Mapping[str, np.ndarray], labels: LabelTable, config: OARFConfig) -> ForestTree:
    """Undoes `pack_tree`, and what `pack_model` does with a tree.

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
    shape = (n_leaves, n_layers, labels.n_joints, config.n_leaf_votes)
    weight = take_array(arrays, "weight", np.int16, (None,))
    leaves = PackedLeaves(
        classes.n_classes,
        shape,
        take_array(arrays, "has_class", np.uint8, (-(-n_leaves * classes.n_classes // 8),)),
        take_array(arrays, "probability", np.uint16, (None,)),
        take_array(arrays, "has_vote", np.uint8, (-(-math.prod(shape) // 8),)),
        take_array(arrays, "vote", np.int16, (len(weight), 3)),
        weight,
        take_array(arrays, "facing", np.int8, (None, 2)) if "facing" in arrays else np.empty((0, 2), np.int8),
    )
    check_leaves(leaves)
    hints = take_array(arrays, "hints", np.int16, (len(nodes),)) if "hints" in arrays else None
    return ForestTree(nodes, leaves, hints)


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
