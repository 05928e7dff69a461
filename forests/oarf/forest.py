"""Training a regression forest from frames, and the forest as an estimator."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forests.estimate import JointEstimate
from forests.estimator import Estimator, hold_out
from forests.frames import FrameSequence, Pinhole, is_known
from forests.growing import grow_class_tree
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.leaves import leaf_table
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.predict import Predictor
from forests.oarf.storage import quantised
from forests.oarf.tune import tune, untuned
from forests.samples import Layer, TrainingSet, gather

_GATHER_SHARE, _TUNE_SHARE = 0.05, 0.05
"""Of the time that training takes, about; for the progress bar."""
_GROW_SHARE = 0.8
"""Of a tree's time; the rest goes to its leaves."""


class TreeStore(Protocol):
    """Keeps finished trees, so that interrupted training goes on after the last of them."""

    def load(self, tree: int) -> ForestTree | None:
        """A tree that was finished before, or None."""
        ...

    def save(self, tree: int, grown: ForestTree) -> None:
        """Keeps a finished tree."""
        ...


def train(
    frames: FrameSequence,
    config: OARFConfig,
    *,
    validation: FrameSequence | None = None,
    n_threads: int = 1,
    checkpoint: TreeStore | None = None,
    on_progress: Callable[[float], object] = lambda share: None,
) -> OARFModel:
    """Trains a regression forest (Rafi et al. 2015, section 3).

    The baseline learns from the body layer, the other modes from the composite with pixels of the objects too; the
    pixels of the body that both layers show are drawn alike. Where no frame shows an object, all modes are the
    same but for the classes' names.

    Frames may lack joints (NaN). A joint that no frame knows gets no votes: the forest answers NaN with
    confidence 0.

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
    )
    leaves = leaf_table(
        training,
        wanted,
        classes.n_classes,
        classes.n_parts,
        grown,
        config.leaf_bandwidth_m,
        config.n_modes,
        n_threads,
        config.seed,
        tree,
    )
    on_share(1.0)
    return quantised(ForestTree(grown.nodes, leaves))


class OcclusionAwareForest(Estimator):
    """A regression forest for joints of people whom objects may hide, used as an estimator of scikit-learn's kind.

    Attributes:
        config: How it is trained and asked.
        n_threads: Threads for training.
        model_: The trained forest, after `fit`.
    """

    def __init__(self, config: OARFConfig = OARFConfig(), n_threads: int = 1) -> None:  # noqa: B008 frozen
        self.config = config
        self.n_threads = n_threads

    def fit(self, frames: FrameSequence, validation: FrameSequence | None = None) -> "OcclusionAwareForest":
        """Trains on frames.

        Args:
            frames: Training frames, such as a `FrameBatch`.
            validation: Frames to tune on; None holds out every tenth training frame.

        Raises:
            ValueError: No frames, none that shows a person, or none that knows a joint.
        """
        if validation is None:
            frames, validation = hold_out(frames)
        self.model_ = train(frames, self.config, validation=validation, n_threads=self.n_threads)
        self._predictor = Predictor(self.model_)
        return self

    def predict(
        self, depth: ArrayLike, camera: Pinhole, box: tuple[int, int, int, int] | None = None
    ) -> JointEstimate:
        """Finds the joints in a depth image.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Intrinsics.
            box: (left, top, right, bottom) [px], right and bottom excluded: where to look; None = everywhere.

        Raises:
            ValueError: Not fitted yet, or no depth image.
        """
        return self._asked().predict(np.asarray(depth), camera, box)

    def label_pixels(self, depth: ArrayLike, camera: Pinhole) -> NDArray[np.uint8]:
        """(height, width) uint8: class + 1 of every pixel with depth (`model_.classes.names`), 0 elsewhere."""
        return self._asked().label_pixels(np.asarray(depth), camera)

    def _asked(self) -> Predictor:
        if not hasattr(self, "_predictor"):
            raise ValueError("this forest is not fitted yet: call fit first")
        return self._predictor
