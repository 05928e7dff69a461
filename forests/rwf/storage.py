"""Random walk forests in model files: arrays and metadata out of a model, and a checked model out of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from forests.frames import LabelTable
from forests.modelfile import arrays_of_tree, naming_file, read_model, take_array, write_model
from forests.records import from_json, to_json
from forests.rwf.config import MOST_WALKS, RWFConfig
from forests.rwf.evidence import OUTCOMES, TERMS
from forests.rwf.model import Experts, ExpertTree, Limbs, PackedTree, RWFModel, WalkPlan
from forests.rwf.skeleton import chosen_joints
from forests.rwf.tables import WEIGHT_ONE, pack_experts
from forests.skeleton.storage import pack_skeleton, unpack_skeleton
from forests.tree import LONGEST_PROBE_M, pack_nodes, shape_of, unpack_nodes

KIND = "rwf"
_FARTHEST_M = 10.0
"""Longest offset to a joint, scatter and bandwidth [m]."""


def save_model(path: Path, model: RWFModel, extra_metadata: Mapping[str, Any] | None = None) -> None:
    """Writes a forest to a file.

    Args:
        path: The file; replaced if there is one.
        model: The forest.
        extra_metadata: Further JSON values by name, such as the corpus that it was trained on.

    Raises:
        ValueError: A name of `extra_metadata` that is taken.
    """
    counts = {"n_steps": model.plan.n_steps}
    own = {"config": to_json(model.config), "labels": to_json(model.labels), "walk": counts}
    extra = extra_metadata or {}
    if taken := sorted(own.keys() & extra.keys()):
        raise ValueError(f"extra_metadata must not name {', '.join(taken)}")
    write_model(path, KIND, pack_model(model), own | dict(extra))


def load_model(path: Path) -> RWFModel:
    """Reads a forest from a file.

    Raises:
        ModelFileError: No such file, or no sound forest in it.
    """
    contents = read_model(path, KIND)
    with naming_file(path):
        return unpack_model(contents.arrays, contents.metadata)


def pack_model(model: RWFModel) -> dict[str, np.ndarray]:
    """A forest's arrays as a model file holds them."""
    arrays: dict[str, np.ndarray] = {f"plan.{name}": getattr(model.plan, name) for name in _PLAN}
    arrays |= {f"limbs.{name}": values for name, values in model.limbs._asdict().items()}
    arrays["weights"] = model.weights
    arrays["units"] = np.array([model.experts.probe_m, model.experts.offset_m], np.float32)
    for number, tree in enumerate(tree for trees in model.experts.trees for tree in trees):
        arrays |= {f"tree{number}.{name}": values for name, values in tree._asdict().items()}
    return arrays | pack_skeleton(model.skeleton)


def unpack_model(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> RWFModel:
    """A forest out of a model file's contents, checked so that no kernel can read beyond an array.

    Raises:
        ValueError: Anything missing, of another shape, or out of its range.
    """
    config = from_json(RWFConfig, metadata.get("config"))
    labels = from_json(LabelTable, metadata.get("labels"))
    joints = tuple(labels.joints[place] for place in chosen_joints(labels.joints, config.joints))
    experts = _experts(arrays, config, len(joints), labels)
    plan = _plan(arrays, metadata.get("walk"), len(joints), config.n_trees)
    weights = take_array(arrays, "weights", np.float32, (len(OUTCOMES), len(joints), len(TERMS)))
    if np.isinf(weights).any():
        raise ValueError("the weights of a joint's probability are not finite")
    skeleton = unpack_skeleton(arrays, joints)
    return RWFModel(config, labels, joints, experts, plan, _limbs(arrays, plan), weights, skeleton)


def _experts(arrays: Mapping[str, np.ndarray], config: RWFConfig, n_joints: int, labels: LabelTable) -> Experts:
    n_trees = config.n_trees
    own = [arrays_of_tree(arrays, number) for number in range(n_joints * n_trees)]
    if "units" not in arrays:  # a file of version 1, which holds the trees as they were grown
        grown = [unpack_tree(each, labels, config) for each in own]
        return pack_experts(tuple(tuple(grown[j * n_trees : (j + 1) * n_trees]) for j in range(n_joints)))
    units = take_array(arrays, "units", np.float32, (2,))
    for unit, longest in zip(units, (LONGEST_PROBE_M, _FARTHEST_M), strict=True):
        if not 0.0 < unit * WEIGHT_ONE <= 1.001 * longest:
            raise ValueError(f"units must be above 0 and at most {longest} m / {WEIGHT_ONE}, not {unit} m")
    trees = [_packed_tree(each, config.n_clusters) for each in own]
    by_joint = tuple(tuple(trees[j * n_trees : (j + 1) * n_trees]) for j in range(n_joints))
    return Experts(by_joint, units[0], units[1], config.n_clusters)


def _packed_tree(arrays: Mapping[str, np.ndarray], n_clusters: int) -> PackedTree:
    threshold = take_array(arrays, "threshold", np.int16, (None,))
    vote = take_array(arrays, "vote", np.int16, (None, 4))
    is_leaf = take_array(arrays, "is_leaf", np.uint8, (None,))
    is_last = take_array(arrays, "is_last", np.uint8, (-(-len(vote) // 8),))
    probe = take_array(arrays, "probe", np.int16, (len(threshold), 4))
    shape_of(is_leaf, len(threshold))
    ends = np.flatnonzero(np.unpackbits(is_last))
    if len(ends) != len(threshold) + 1 or ends[-1] != len(vote) - 1:
        raise ValueError(f"is_last must name the last votes of {len(threshold) + 1} leaves and end with a vote")
    if np.diff(ends, prepend=-1).max() > n_clusters:
        raise ValueError(f"a leaf has more than {n_clusters} votes")
    if (vote[:, 3] <= 0).any():
        raise ValueError("the weights of votes must be above 0")
    return PackedTree(is_leaf, probe, threshold, vote, is_last)


def pack_tree(tree: ExpertTree) -> dict[str, np.ndarray]:
    """A grown tree's arrays as files hold it while training runs."""
    return pack_nodes(tree.nodes) | {"offset": tree.offset, "share": tree.share, "spread": tree.spread}


def unpack_tree(arrays: Mapping[str, np.ndarray], labels: LabelTable, config: RWFConfig) -> ExpertTree:
    """Undoes `pack_tree`.

    Args:
        arrays: The tree's.
        labels: The forest's; a tree of offsets does not depend on them.
        config: The forest's.

    Raises:
        ValueError: Anything missing, of another shape, or out of its range.
    """
    nodes = unpack_nodes(arrays)
    n_leaves = int((nodes["leaf"] >= 0).sum())
    offset = take_array(arrays, "offset", np.float32, (n_leaves, config.n_clusters, 3))
    share = take_array(arrays, "share", np.float32, (n_leaves, config.n_clusters))
    spread = take_array(arrays, "spread", np.float32, (n_leaves, config.n_clusters))
    if not (np.abs(offset) <= _FARTHEST_M).all():
        raise ValueError(f"offsets to joints must be within {_FARTHEST_M} m")
    if not ((spread >= 0) & (spread <= _FARTHEST_M)).all():
        raise ValueError(f"spreads of clusters must be in 0..{_FARTHEST_M} m")
    if not ((share >= 0).all() and (share[:, 0] > 0).all() and (np.abs(share.sum(axis=1) - 1.0) < 1e-3).all()):
        raise ValueError("the shares of a leaf's clusters must be at least 0 and sum to 1")
    return ExpertTree(nodes, offset, share, spread)


_PLAN = ("order", "start_from", "scatter_m", "bandwidth_m", "n_arriving", "gate_m", "n_walks")


def _plan(arrays: Mapping[str, np.ndarray], counts: object, n_joints: int, n_trees: int) -> WalkPlan:
    n_steps = _count(counts, "n_steps")
    if "plan.n_walks" not in arrays:  # a file of an earlier version: all joints have as many
        arrays = {**arrays, "plan.n_walks": np.full(n_joints, _count(counts, "n_walks"), np.int32)}
    plan = WalkPlan(
        take_array(arrays, "plan.order", np.int32, (n_joints,)),
        take_array(arrays, "plan.start_from", np.int32, (n_joints,)),
        take_array(arrays, "plan.scatter_m", np.float32, (n_joints,)),
        take_array(arrays, "plan.bandwidth_m", np.float32, (n_joints,)),
        take_array(arrays, "plan.n_arriving", np.int32, (n_joints,)),
        take_array(arrays, "plan.gate_m", np.float32, (n_joints, n_trees, 2)),
        take_array(arrays, "plan.n_walks", np.int32, (n_joints,)),
        n_steps,
    )
    if not np.array_equal(np.sort(plan.order), np.arange(n_joints)):
        raise ValueError("the order of the walks must name each joint once")
    _check_parents("start", plan.start_from, plan)
    for name in ("scatter_m", "bandwidth_m"):
        values = getattr(plan, name)
        if not ((values > 0) & (values <= _FARTHEST_M)).all():
            raise ValueError(f"{name} must be in 0..{_FARTHEST_M} m")
    if (plan.n_walks < 1).any() or (plan.n_walks > MOST_WALKS).any():
        raise ValueError(f"n_walks must be in 1..{MOST_WALKS}")
    if (plan.n_arriving < 0).any() or (plan.n_arriving >= plan.n_steps).any():
        raise ValueError(f"n_arriving must be in 0..{plan.n_steps - 1}")
    if not (plan.gate_m >= 0).all():
        raise ValueError("gates must be at least 0 m")
    return plan


def _count(counts: object, name: str) -> int:
    value = counts.get(name) if isinstance(counts, Mapping) else None
    if type(value) is not int or not 1 <= value <= MOST_WALKS:
        raise ValueError(f"the metadata's walk has {name}={value}, must be an integer in 1..{MOST_WALKS}")
    return value


def _limbs(arrays: Mapping[str, np.ndarray], plan: WalkPlan) -> Limbs:
    n_joints = len(plan.order)
    limbs = Limbs(
        take_array(arrays, "limbs.parent", np.int32, (n_joints,)),
        take_array(arrays, "limbs.length_m", np.float32, (n_joints, 2)),
    )
    _check_parents("limb", limbs.parent, plan)
    low, high = limbs.length_m.T
    if not ((low >= 0) & (low <= high)).all():
        raise ValueError("a limb's length ends before it begins")
    return limbs


def _check_parents(what: str, parents: np.ndarray, plan: WalkPlan) -> None:
    """Parents are joints that are walked to before, or -1."""
    rank = np.empty(len(parents), np.int64)
    rank[plan.order] = np.arange(len(parents))
    is_known = (parents >= -1) & (parents < len(parents))
    if not is_known.all() or (rank[parents[parents >= 0]] >= rank[parents >= 0]).any():
        raise ValueError(f"the {what} of a joint is no joint that is walked to before it")
