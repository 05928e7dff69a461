"""Training a regression forest from frames."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from forests.frames import DepthFrame, FrameSequence, is_known
from forests.growing import grow_class_tree
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.leaves import LeafRules, leaf_table
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.packed import pack_leaves
from forests.oarf.predict import Predictor
from forests.oarf.tune import tune, untuned
from forests.samples import Layer, TrainingSet, gather
from forests.skeleton.answers import N_CANDIDATES, Answers, Truth, answers_of
from forests.skeleton.folds import FOLD_SEED, N_FOLDS, Answering, ShiftedStore
from forests.skeleton.learn import learn_from_frames
from forests.tree import TreeStore

_GATHER_SHARE, _TUNE_SHARE = 0.05, 0.05
"""Of the time that training takes, about; for the progress bar."""
_FARTHEST_MM = 32000
_GROW_SHARE = 0.8
"""Of a tree's time; the rest goes to its leaves."""


def train(
    frames: FrameSequence,
    config: OARFConfig,
    *,
    validation: FrameSequence | None = None,
    n_threads: int = 1,
    checkpoint: TreeStore[ForestTree] | None = None,
    on_progress: Callable[[float], object] = lambda share: None,
) -> OARFModel:
    """Trains a regression forest and, if the config says so, what makes one skeleton out of its proposals.

    For the latter, two forests of one tree each learn from one half of the frames and answer the other half; see
    `forests.skeleton.learn`.

    Args:
        frames: Training frames; each is read a few times.
        config: How it is trained.
        validation: Frames to learn lambda_j, b_j and the probabilities on; None leaves them at their defaults.
        n_threads: Threads; the forest is the same to the byte for any number.
        checkpoint: Keeps finished trees; those of the halves follow the forest's own.
        on_progress: Told the share of the work that is done, 0..1.

    Raises:
        ValueError: No frames, none that shows a person, or none that knows a joint.
    """
    share = config.n_trees / (config.n_trees + 1.0) if config.learn_skeleton else 1.0
    model = train_forest(
        frames,
        config,
        validation=validation,
        n_threads=n_threads,
        checkpoint=checkpoint,
        on_progress=lambda done: on_progress(share * done),
    )
    if not config.learn_skeleton:
        return model

    def train_apart(others: FrameSequence, fold: int) -> Answering:
        halved = replace(config, n_trees=1, seed=config.seed + FOLD_SEED + fold)
        store = ShiftedStore(checkpoint, config.n_trees + fold) if checkpoint else None
        part = train_forest(others, halved, n_threads=n_threads, checkpoint=store)
        on_progress(share + (1.0 - share) * (fold + 1) / (N_FOLDS + 1))
        return partial(_answers, replace(part, tuning=model.tuning))

    answers = partial(_answers, model)
    skeleton = learn_from_frames(model.labels.joints, frames, validation, train_apart, answers, config.seed)
    on_progress(1.0)
    return replace(model, skeleton=skeleton)


def _answers(model: OARFModel, frames: FrameSequence, is_cut: bool) -> tuple[Answers, Truth]:
    predictor = Predictor(model)

    def ask(frame: DepthFrame) -> JointEstimate:
        return predictor.given(frame.hints).predict_joints(frame.depth, frame.camera, n_proposals=N_CANDIDATES)

    return answers_of(ask, frames, is_cut=is_cut)


def train_forest(
    frames: FrameSequence,
    config: OARFConfig,
    *,
    validation: FrameSequence | None = None,
    n_threads: int = 1,
    checkpoint: TreeStore[ForestTree] | None = None,
    on_progress: Callable[[float], object] = lambda share: None,
) -> OARFModel:
    """Trains a regression forest (Rafi et al. 2015, section 3).

    The baseline learns from the body layer, the other modes from the composite with pixels of the objects too; the
    pixels of the body that both layers show are drawn alike. Where no frame shows an object, all modes are the
    same but for the classes' names. Frames may lack joints (NaN): a joint that no frame knows gets no votes.

    Args:
        frames: Training frames; each is read once.
        config: How it is trained.
        validation: Frames to learn lambda_j, b_j and the probabilities on; None leaves them at their defaults.
        n_threads: Threads; the forest is the same to the byte for any number.
        checkpoint: Keeps finished trees.
        on_progress: Told the share of the work that is done, 0..1.

    Raises:
        ValueError: No frames, none that shows a person, or none that knows a joint.
    """
    if len(frames) == 0:
        raise ValueError("there are no training frames")
    classes = ClassTable.of(frames.labels, config.mode)
    stored = [checkpoint.load(tree) if checkpoint else None for tree in range(config.n_trees)]
    trees: list[ForestTree] = []
    if None in stored:
        training = _gathered(frames, config, lambda n: on_progress(_GATHER_SHARE * n / len(frames)))
        wanted = classes.of_label(frames.labels)[training.samples.label]
    per_tree = (1.0 - _GATHER_SHARE - _TUNE_SHARE) / config.n_trees
    for tree, kept in enumerate(stored):

        def show(done: float, begun: float = _GATHER_SHARE + per_tree * tree) -> None:
            on_progress(begun + per_tree * done)

        grown = kept or _train_tree(training, wanted, classes, config, tree, n_threads, show)
        if checkpoint and kept is None:
            checkpoint.save(tree, grown)
        trees.append(grown)
    model = OARFModel(config, frames.labels, classes, tuple(trees), untuned(frames.labels.n_joints))
    if validation is not None and len(validation):
        model = tune(model, validation, n_threads=n_threads)
    on_progress(1.0)
    return model


def _gathered(frames: FrameSequence, config: OARFConfig, on_frames: Callable[[int], object]) -> TrainingSet:
    n_read = 0

    def count() -> None:
        nonlocal n_read
        n_read += 1
        on_frames(n_read)

    layer: Layer = "body" if config.mode == "baseline" else "composite"
    training = gather(frames, layer, config.n_pixels, config.n_occluder_pixels, config.seed, on_frame=count)
    if not is_known(training.joints).any():
        raise ValueError(f"none of the {len(frames)} frames knows a joint")
    return training


def to_body(training: TrainingSet) -> NDArray[np.int16]:
    """(n_samples, 3) int16: from samples to the middle of the joints that their frame knows [mm]; 0 if none is.

    A tree that is told classes of pixels separates the objects in its first nodes. It goes on by these offsets,
    for otherwise all pixels of a class of objects would vote out of one leaf.
    """
    known, samples = is_known(training.joints), training.samples
    n_known = known.sum(axis=1)[:, None]
    middle = np.where(known[..., None], training.joints, 0.0).sum(axis=1) / np.maximum(n_known, 1)
    offsets = (middle[samples.frame] - samples.points(training.crops)) * (n_known > 0)[samples.frame]
    return np.rint(np.clip(1000.0 * offsets, -_FARTHEST_MM, _FARTHEST_MM)).astype(np.int16)


def _train_tree(
    training: TrainingSet,
    wanted: NDArray[np.uint8],
    classes: ClassTable,
    config: OARFConfig,
    tree: int,
    n_threads: int,
    on_share: Callable[[float], object],
) -> ForestTree:
    n_samples = len(wanted)
    n_settled = 0

    def settle(n: int) -> None:
        nonlocal n_settled
        n_settled += n
        on_share(_GROW_SHARE * n_settled / n_samples)

    grown = grow_class_tree(
        training.crops,
        training.samples,
        wanted,
        classes.n_classes,
        config.growth,
        config.seed,
        tree,
        n_threads,
        settle,
        to_body(training) if len(training.crops.classes) else None,
    )
    rules = LeafRules(
        classes.n_classes, classes.n_parts, config.leaf_bandwidth_m, config.n_leaf_votes, config.seed, tree
    )
    leaves = leaf_table(training, wanted, grown, rules, n_threads)
    on_share(1.0)
    return ForestTree(grown.nodes, pack_leaves(leaves), grown.hints if len(grown.hints) else None)
