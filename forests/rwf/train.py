"""Training a random walk forest from frames."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.boxes import upper_body_box
from forests.crops import Crops, CropWriter
from forests.estimate import JointEstimate
from forests.frames import DepthFrame, FrameSequence, is_known
from forests.growing import Crew, grow_direction_tree
from forests.rwf.clusters import leaf_clusters
from forests.rwf.config import RWFConfig
from forests.rwf.evidence import OUTCOMES, TERMS
from forests.rwf.model import ExpertTree, RWFModel, WalkPlan
from forests.rwf.points import draw_way_points, farthest_behind, growth_targets
from forests.rwf.predict import Predictor
from forests.rwf.skeleton import chosen_joints, measure_limbs, starts_of
from forests.rwf.start import seen_box, start_point
from forests.rwf.tables import pack_experts
from forests.rwf.tune import tune
from forests.samples import image_of
from forests.skeleton.answers import Answers, Truth, View, answers_of, cut_frame, edges_of
from forests.skeleton.folds import FOLD_SEED, LEAST_FRAMES, N_FOLDS, Answering, ShiftedStore
from forests.skeleton.kinematics import parents_first, parents_of
from forests.skeleton.learn import learn_from_frames
from forests.tree import TreeStore

_MAX_BYTES = 2**31
_CUT_STREAM = 0x0C07
_READ_SHARE, _TUNE_SHARE = 0.05, 0.05
"""Of the time that training takes, about; for the progress bar."""


class WalkFrames(NamedTuple):
    """Training frames as the experts learn from them.

    Attributes:
        crops: The images, some of them a second time, cut off on the person.
        joints: (n_frames, n_joints, 3) float32, the experts' joints, camera frame [m]; NaN = unknown.
        starts: (n_frames, 3) float32, where a detector's box starts a walk, camera frame [m].
    """

    crops: Crops
    joints: NDArray[np.float32]
    starts: NDArray[np.float32]


def train(
    frames: FrameSequence,
    config: RWFConfig,
    *,
    validation: FrameSequence | None = None,
    n_threads: int = 1,
    checkpoint: TreeStore[ExpertTree] | None = None,
    on_progress: Callable[[float], object] = lambda share: None,
    crew: Crew | None = None,
) -> RWFModel:
    """Trains a random walk forest and, if the config says so, what makes one skeleton out of where its walks end.

    For the latter, two forests learn from a half of the frames each; see `forests.skeleton.learn`.

    Args:
        frames: Training frames; each is read a few times.
        config: How it is trained.
        validation: Frames to tune on; None leaves all as the config has it.
        n_threads: Threads; the forest is the same to the byte for any number.
        checkpoint: Keeps finished trees, numbered joint * n_trees + tree; those of the halves follow.
        on_progress: Told the share of the work that is done, 0..1.
        crew: Grows the subtrees in place of threads; the forest is the same.

    Raises:
        ValueError: No frames, or joints that they do not have.
    """
    share = 0.5 if config.learn_skeleton and len(frames) >= LEAST_FRAMES else 1.0
    grow = partial(train_forest, n_threads=n_threads, crew=crew)
    model = grow(
        frames, config, validation=validation, checkpoint=checkpoint, on_progress=lambda x: on_progress(share * x)
    )
    if not config.learn_skeleton:
        return model

    def train_apart(others: FrameSequence, fold: int) -> Answering | None:
        halved = replace(model.config, joints=model.joints, seed=config.seed + FOLD_SEED + fold)
        store = ShiftedStore(checkpoint, len(model.joints) * config.n_trees * (1 + fold)) if checkpoint else None
        part = replace(grow(others, halved, checkpoint=store), weights=model.weights)
        if part.joints != model.joints:  # a half knows no place of a joint
            return None
        on_progress(share + (1.0 - share) * (fold + 1) / (N_FOLDS + 1))
        return partial(_answers, replace(part, config=replace(halved, seed=config.seed), plan=model.plan))

    ask = partial(_answers, model)
    skeleton = learn_from_frames(model.joints, frames, validation, train_apart, ask, False, 1, config.seed)
    on_progress(1.0)
    return replace(model, skeleton=skeleton)


def _answers(model: RWFModel, frames: FrameSequence, view: View) -> tuple[Answers, Truth]:
    """What a forest answers that is told the box of a perfect detector."""
    walker = Predictor(model)
    names = frames.labels.joints
    inside = chosen_joints(names, model.config.box_joints)

    def ask(frame: DepthFrame, _: float, edges: NDArray[np.float32]) -> JointEstimate:
        box = seen_box(upper_body_box(frame.joints[inside], frame.camera), frame.camera, edges)
        return walker.predict_joints(frame.depth, frame.camera, box, edges=edges)

    return answers_of(ask, frames, view, chosen_joints(names, model.joints))


def train_forest(
    frames: FrameSequence,
    config: RWFConfig,
    *,
    validation: FrameSequence | None = None,
    n_threads: int = 1,
    checkpoint: TreeStore[ExpertTree] | None = None,
    on_progress: Callable[[float], object] = lambda share: None,
    crew: Crew | None = None,
) -> RWFModel:
    """Trains a random walk forest, one expert a joint.

    Frames may lack joints (NaN): each expert learns from the frames that know its joint, and a joint that no frame
    knows gets none. The config of such a forest names the joints that were learned.

    Args:
        frames: Training frames; each is read once.
        config: How it is trained.
        validation: Frames to choose starts, steps and clusters on; None leaves them as the config has them.
        n_threads: Threads; the forest is the same to the byte for any number.
        checkpoint: Keeps finished trees, numbered joint * n_trees + tree.
        on_progress: Told the share of the work that is done, 0..1.
        crew: Grows the subtrees in place of threads; the forest is the same.

    Raises:
        ValueError: No frames, or joints that they do not have.
    """
    if len(frames) == 0:
        raise ValueError("there are no training frames")
    config, learned = _read_known(frames, config, lambda share: on_progress(_READ_SHARE * share))
    names = tuple(frames.labels.joints[place] for place in chosen_joints(frames.labels.joints, config.joints))
    parents = parents_of(names, config.skeleton)
    gates = _gates(learned, config)
    n_all = len(names) * config.n_trees
    trees = []
    for number in range(n_all):
        kept = checkpoint.load(number) if checkpoint else None
        trees.append(kept or _train_tree(learned, config, number, parents, gates, n_threads, crew))
        if checkpoint and kept is None:
            checkpoint.save(number, trees[-1])
        on_progress(_READ_SHARE + (1.0 - _READ_SHARE - _TUNE_SHARE) * (number + 1) / n_all)
    experts = tuple(tuple(trees[j * config.n_trees : (j + 1) * config.n_trees]) for j in range(len(names)))
    plan = _untuned(config, names, parents, gates)
    limbs = measure_limbs(learned.joints, parents, config.limb_share)
    weights = np.full((len(OUTCOMES), len(names), len(TERMS)), np.nan, np.float32)
    model = RWFModel(config, frames.labels, names, pack_experts(experts), plan, limbs, weights)
    if validation is not None and len(validation):
        model = tune(model, validation)
    on_progress(1.0)
    return model


def _gates(learned: WalkFrames, config: RWFConfig) -> NDArray[np.float32]:
    """(n_joints, n_trees, 2) float32, `WalkPlan.gate_m`."""
    n_joints = learned.joints.shape[1]
    gates = np.empty((n_joints, config.n_trees, 2), np.float32)
    gates[:, :, 0] = [config.snap_m[tree % len(config.snap_m)] for tree in range(config.n_trees)]
    for joint in range(n_joints):
        gates[joint, :, 1] = farthest_behind(learned.crops, learned.joints[:, joint], config.gate_share)
    return gates


def _untuned(
    config: RWFConfig, names: tuple[str, ...], parents: NDArray[np.int32], gates: NDArray[np.float32]
) -> WalkPlan:
    """How experts walk of whom no validation frames say better."""
    n = len(parents)
    return WalkPlan(
        parents_first(parents),
        parents,
        np.full(n, config.scatter_m, np.float32),
        np.full(n, config.bandwidth_m, np.float32),
        np.full(n, config.n_arriving, np.int32),
        gates,
        np.array(
            [config.n_box_walks if name in config.box_joints else config.n_walks for name in names], np.int32
        ),
        config.n_steps,
    )


def _read_known(
    frames: FrameSequence, config: RWFConfig, on_share: Callable[[float], object]
) -> tuple[RWFConfig, WalkFrames]:
    """The frames with the joints that any of them knows, which the config names unless they are all it wants."""
    places = chosen_joints(frames.labels.joints, config.joints)
    learned = read_frames(frames, config, places, on_share)
    has_truth = np.asarray(is_known(learned.joints).any(axis=0))
    names = [frames.labels.joints[place] for place in places]
    if not has_truth.any():
        raise ValueError(f"none of the {len(frames)} frames knows any of {', '.join(names)}")
    if has_truth.all():
        return config, learned
    known = tuple(name for name, is_there in zip(names, has_truth, strict=True) if is_there)
    return replace(config, joints=known), learned._replace(joints=learned.joints[:, has_truth])


def read_frames(
    frames: FrameSequence, config: RWFConfig, places: NDArray[np.int32], on_share: Callable[[float], object]
) -> WalkFrames:
    """Reads every frame once: its crop, the experts' joints, the middle of its upper-body box.

    The box is around the joints of it that the frame knows; a frame that knows none is started from amid all that
    it shows. A frame that shows nothing starts at its joints' mean. Some of the frames follow once more, cut off on
    the person.
    """
    joints, starts = [], []
    inside = chosen_joints(frames.labels.joints, config.box_joints)
    with CropWriter(_MAX_BYTES) as writer:
        for index in range(len(frames)):
            frame = frames[index]
            whole = replace(frame, depth=image_of(frame, config.layer)[0])
            edges = edges_of(whole.depth.shape, frame.camera)
            shown = [(whole, edges)]
            rng = np.random.default_rng([_CUT_STREAM, config.seed, index])
            if rng.random() < config.cut_share:
                shown.append(cut_frame(whole, frame.joints[places], edges, rng))
            for seen, ends in shown:
                writer.add(seen.depth, seen.camera)
                joints.append(frame.joints[places])
                box = seen_box(upper_body_box(frame.joints[inside], seen.camera), seen.camera, ends)
                found = start_point(seen.depth, seen.camera, box=box)
                starts.append(_mean_joint(frame, inside) if found is None else found)
            on_share((index + 1) / len(frames))
        return WalkFrames(writer.finish(), np.stack(joints).astype(np.float32), np.stack(starts))


def _mean_joint(frame: DepthFrame, places: NDArray[np.int32]) -> NDArray[np.float32]:
    """(3,) float32, mean of those of the joints that are known, else of all that are; NaN if none is [m]."""
    inside = frame.joints[places]
    for known in (inside[is_known(inside)], frame.joints[is_known(frame.joints)]):
        if len(known):
            return known.mean(axis=0)
    return np.full(3, np.nan, np.float32)


def _train_tree(
    learned: WalkFrames,
    config: RWFConfig,
    number: int,
    parents: NDArray[np.int32],
    gates: NDArray[np.float32],
    n_threads: int,
    crew: Crew | None,
) -> ExpertTree:
    """Trains tree `number` = joint * n_trees + tree of the joint."""
    joint = number // config.n_trees
    parent = parents[joint]
    points = draw_way_points(
        learned.crops,
        np.ascontiguousarray(learned.joints[:, joint]),
        starts_of(learned.joints, parents, joint, learned.starts),
        gates[joint, number % config.n_trees],
        config.n_points,
        config.near_share,
        config.reach_m,
        config.box_noise_m if parent < 0 else config.start_noise_m,
        config.seed,
        number,
    )
    targets = growth_targets(points.offsets, config.softness_m)
    grown = grow_direction_tree(
        learned.crops, points.samples, targets, config.growth, config.seed, number, n_threads, crew=crew
    )
    clusters = leaf_clusters(grown, points.offsets, config.n_clusters, config.cluster_bandwidth_m)
    return ExpertTree(grown.nodes, *clusters)
