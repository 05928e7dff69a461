"""Auto-context: a second forest whose trees may also ask what a first one has predicted of pixels.

That is whether they are the person's, and of which class the objects are. After Tu and Bai 2010 (Auto-Context and Its
Application to High-Level Vision Tasks and 3D Brain Image Segmentation).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from forests.frames import DepthFrame, FrameSequence, FrameSubset, LabelTable
from forests.oarf.config import OARFConfig
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.predict import Predictor
from forests.oarf.train import train
from forests.oarf.tune import tune
from forests.skeleton.folds import FOLD_SEED, N_FOLDS, ShiftedStore
from forests.tree import TreeStore


@dataclass(frozen=True)
class PredictedFrames:
    """Frames of which is told what forests predict that have not learned from them.

    Attributes:
        frames: The frames.
        predictors: Forests; each has learned from all frames but its fold, one run of them.
    """

    frames: FrameSequence
    predictors: Sequence[Predictor]

    @property
    def labels(self) -> LabelTable:
        """What the label images mean."""
        return self.frames.labels

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, index: int) -> DepthFrame:
        frame, n_folds = self.frames[index], len(self.predictors)
        fold = next(k for k in range(n_folds) if index < fold_end(k, len(self), n_folds))
        return replace(frame, hints=self.predictors[fold].hints_of(frame.depth, frame.camera))


def fold_end(fold: int, n_frames: int, n_folds: int) -> int:
    """Number of the frame after the last of a fold; frames that follow one another may share people and objects."""
    return (fold + 1) * n_frames // n_folds


def train_with_context(
    frames: FrameSequence,
    config: OARFConfig,
    *,
    validation: FrameSequence | None = None,
    n_threads: int = 1,
    checkpoint: TreeStore[ForestTree] | None = None,
    on_progress: Callable[[float], object] = lambda share: None,
) -> OARFModel:
    """Trains a first forest, and a second one whose trees may ask what the first predicts of pixels.

    On training frames this comes from forests of one tree that have learned from the other half of the frames: the
    predictions of the first forest itself would be better there than they are on new frames.

    Args:
        frames: Training frames; each is read a few times.
        config: How both forests are trained; skeletons are not learned.
        validation: Frames to learn lambda_j, b_j and the probabilities on; None leaves them at their defaults.
        n_threads: Threads; the forest is the same to the byte for any number.
        checkpoint: Keeps finished trees: the second forest's, then the first's, then those of the halves.
        on_progress: Told the share of the work that is done, 0..1.

    Raises:
        ValueError: Fewer frames than folds, none that shows a person, or none that knows a joint.
    """
    if len(frames) < N_FOLDS:
        raise ValueError(f"{len(frames)} training frames cannot be divided into {N_FOLDS} folds")
    config = replace(config, learn_skeleton=False)
    n_trees, total = config.n_trees, 2 * config.n_trees + 1

    def show(begun: float, weight: float) -> Callable[[float], object]:
        return lambda done: on_progress((begun + weight * done) / total)

    store = ShiftedStore(checkpoint, n_trees) if checkpoint else None
    first = train(frames, config, n_threads=n_threads, checkpoint=store, on_progress=show(0, n_trees))
    predictors = []
    for fold in range(N_FOLDS):
        store = ShiftedStore(checkpoint, 2 * n_trees + fold) if checkpoint else None
        predictors.append(Predictor(_train_apart(frames, config, fold, n_threads, store)))
        on_progress((n_trees + (fold + 1) / N_FOLDS) / total)
    predicted = PredictedFrames(frames, predictors)
    shown = show(n_trees + 1, n_trees)
    second = train(predicted, config, n_threads=n_threads, checkpoint=checkpoint, on_progress=shown)
    model = replace(second, context=first)
    return tune(model, validation, n_threads) if validation is not None and len(validation) else model


def _train_apart(
    frames: FrameSequence,
    config: OARFConfig,
    fold: int,
    n_threads: int,
    store: TreeStore[ForestTree] | None,
) -> OARFModel:
    """A forest of one tree that has not learned from a fold."""
    n = len(frames)
    others = FrameSubset(frames, (*range(fold_end(fold - 1, n, N_FOLDS)), *range(fold_end(fold, n, N_FOLDS), n)))
    apart = replace(config, n_trees=1, seed=config.seed + FOLD_SEED + fold)
    return train(others, apart, n_threads=n_threads, checkpoint=store)
