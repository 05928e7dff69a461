"""Training a regression forest from frames."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from forests.frames import DepthFrame, FrameSequence, FrameSubset, is_known
from forests.growing import Crew, GrownTree, grow_class_tree
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.descend import leaves_of_samples
from forests.oarf.leaves import LeafRules, leaf_table, regrouped
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.packed import PackedLeaves, pack_leaves
from forests.oarf.predict import Predictor
from forests.oarf.tune import tune, untuned
from forests.samples import Layer, TrainingSet, gather
from forests.skeleton.answers import N_CANDIDATES, Answers, Truth, View, answers_of
from forests.skeleton.folds import N_FOLDS, Answering
from forests.skeleton.heading import facings_of
from forests.skeleton.learn import learn_from_frames
from forests.skeleton.model import SkeletonModel
from forests.tree import TreeStore

_GATHER_SHARE, _TUNE_SHARE = 0.05, 0.05
"""Of the time that training takes, about; for the progress bar."""
N_WAYS = 2
"""In how many ways training frames are halved for skeletons."""
_SKELETON_SHARE = 0.4
"""Likewise, of the whole training."""
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
    crew: Crew | None = None,
) -> OARFModel:
    """Trains a regression forest (Rafi et al. 2015, section 3) and, if the config says so, whole skeletons.

    The baseline learns from the body layer, the other modes from the composite with pixels of the objects too; the
    pixels of the body that both layers show are drawn alike. Where no frame shows an object, all modes are the
    same but for the classes' names. Frames may lack joints (NaN): a joint that no frame knows gets no votes.

    Skeletons are learned from answers on training frames by leaves that have learned from the other half of the
    frames; see `forests.skeleton.learn`.

    Args:
        frames: Training frames; each is read a few times.
        config: How it is trained.
        validation: Frames to learn lambda_j, b_j and the probabilities on; None leaves them at their defaults.
        n_threads: Threads; the forest is the same to the byte for any number.
        checkpoint: Keeps finished trees.
        on_progress: Told the share of the work that is done, 0..1.
        crew: Gathers pixels, grows subtrees and learns leaves, of the same frames; the forest is the same.

    Raises:
        ValueError: No frames, none that shows a person, none that knows a joint, or skeletons of frames with hints.
    """
    if len(frames) == 0:
        raise ValueError("there are no training frames")
    share = 1.0 - _SKELETON_SHARE if config.learn_skeleton else 1.0
    learner = _Learner(frames, config, n_threads, lambda done: on_progress(share * done), crew)
    trees = tuple(_trees(learner, checkpoint))
    model = OARFModel(config, frames.labels, learner.classes, trees, untuned(frames.labels.n_joints))
    if validation is not None and len(validation):
        model = tune(model, validation, n_threads=n_threads)
    if config.learn_skeleton:
        skeleton = _learned_skeleton(
            model, learner, validation, lambda done: on_progress(share + done - share * done)
        )
        model = replace(model, skeleton=skeleton)
    on_progress(1.0)
    return model


class _Learner:
    """What trees are learned from: gathered when it is first asked for, since all trees may be finished."""

    def __init__(
        self,
        frames: FrameSequence,
        config: OARFConfig,
        n_threads: int,
        on_share: Callable[[float], object],
        crew: Crew | None,
    ) -> None:
        self.frames, self.config, self.n_threads, self.on_share = frames, config, n_threads, on_share
        self.crew = crew
        self.classes = ClassTable.of(frames.labels, config.mode)

    @cached_property
    def training(self) -> TrainingSet:
        """Pixels of all frames."""
        n_frames = len(self.frames)
        return _gathered(
            self.frames,
            self.config,
            self.n_threads,
            lambda n: self.on_share(_GATHER_SHARE * n / n_frames),
            self.crew,
        )

    @cached_property
    def wanted(self) -> NDArray[np.uint8]:
        """(n_samples,) uint8, their classes."""
        return self.classes.of_label(self.frames.labels)[self.training.samples.label]

    def leaves_of(self, grown: GrownTree, tree: int) -> PackedLeaves:
        """What the leaves of a tree learn from its samples."""
        config, training = self.config, self.training
        rules = LeafRules(
            self.classes.n_classes,
            self.classes.n_parts,
            config.leaf_bandwidth_m,
            config.n_leaf_votes,
            config.seed,
            tree,
            n_silent=self.classes.n_silent,
        )
        facing = facings_of(training.joints, self.frames.labels.joints) if config.learn_skeleton else None
        return pack_leaves(
            leaf_table(training, self.wanted, grown, rules, self.n_threads, facing=facing, crew=self.crew)
        )


def _trees(learner: _Learner, checkpoint: TreeStore[ForestTree] | None) -> Iterator[ForestTree]:
    n_trees = learner.config.n_trees
    per_tree = (1.0 - _GATHER_SHARE - _TUNE_SHARE) / n_trees
    for tree in range(n_trees):

        def show(done: float, begun: float = _GATHER_SHARE + per_tree * tree) -> None:
            learner.on_share(begun + per_tree * done)

        kept = checkpoint.load(tree) if checkpoint else None
        if kept:
            show(1.0)
        grown = kept or _train_tree(learner, tree, show)
        if checkpoint and kept is None:
            checkpoint.save(tree, grown)
        yield grown


def _learned_skeleton(
    model: OARFModel, learner: _Learner, validation: FrameSequence | None, on_share: Callable[[float], object]
) -> SkeletonModel:
    if any(tree.hints is not None for tree in model.trees):
        raise ValueError("no skeletons can be learned of trees that are told more than depth")
    samples, crops = learner.training.samples, learner.training.crops
    leaves = [leaves_of_samples(crops, samples, tree.nodes, tree.leaves.n_leaves) for tree in model.trees]

    def train_apart(others: FrameSubset, fold: int) -> Answering:
        on_share(fold / (N_FOLDS * N_WAYS + 2))
        is_kept = np.zeros(len(learner.frames), np.bool_)
        is_kept[list(others.indices)] = True
        trees = []
        for number, (tree, leaf) in enumerate(zip(model.trees, leaves, strict=True)):
            grown = regrouped(tree.nodes, tree.leaves.n_leaves, leaf, is_kept[samples.frame])
            trees.append(ForestTree(tree.nodes, learner.leaves_of(grown, number)))
        return partial(_answers, replace(model, trees=tuple(trees)), learner.n_threads)

    answers = partial(_answers, model, learner.n_threads)
    reads_headings = Predictor(model).reads_headings
    names, seed = model.labels.joints, model.config.seed
    return learn_from_frames(names, learner.frames, validation, train_apart, answers, reads_headings, N_WAYS, seed)


def _answers(model: OARFModel, n_threads: int, frames: FrameSequence, view: View) -> tuple[Answers, Truth]:
    predictor = Predictor(model)

    def ask(frame: DepthFrame, heading: float, _: NDArray[np.float32]) -> JointEstimate:
        return predictor.predict_joints(frame.depth, frame.camera, n_proposals=N_CANDIDATES, heading=heading)

    return answers_of(ask, frames, view, n_threads=n_threads)


def _gathered(
    frames: FrameSequence,
    config: OARFConfig,
    n_threads: int,
    on_frames: Callable[[int], object],
    crew: Crew | None,
) -> TrainingSet:
    n_read = 0

    def count(n: int = 1) -> None:
        nonlocal n_read
        n_read += n
        on_frames(n_read)

    layer: Layer = "body" if config.mode == "baseline" else "composite"
    n_body, n_objects = config.pixels_a_frame(len(frames))
    if crew is None:
        training = gather(frames, layer, n_body, n_objects, config.seed, n_threads=n_threads, on_frame=count)
    else:
        training = crew.gather(layer, n_body, n_objects, config.seed, count)
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


def _train_tree(learner: _Learner, tree: int, on_share: Callable[[float], object]) -> ForestTree:
    config, n_samples = learner.config, len(learner.wanted)
    n_settled = 0

    def settle(n: int) -> None:
        nonlocal n_settled
        n_settled += n
        on_share(_GROW_SHARE * n_settled / n_samples)

    grown = grow_class_tree(
        learner.training.crops,
        learner.training.samples,
        learner.wanted,
        learner.classes.n_classes,
        config.growth,
        config.seed,
        tree,
        learner.n_threads,
        settle,
        to_body(learner.training) if len(learner.training.crops.classes) else None,
        learner.crew,
    )
    leaves = learner.leaves_of(grown, tree)
    on_share(1.0)
    return ForestTree(grown.nodes, leaves, grown.hints if len(grown.hints) else None)
