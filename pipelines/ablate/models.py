"""Forests of either kind: trained into a file, tree by tree, and asked as a scoring wants it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from forests.oarf.config import OARFConfig
from forests.oarf.predict import Predictor
from pipelines.ablate.jobs import ScoringJob, TrainingJob
from pipelines.ablate.progress import SetShare
from pipelines.commands.evaluate import load_contestant
from pipelines.commands.train import KINDS
from pipelines.corpus.sequence import LABELS, CorpusFrames
from pipelines.errors import UserError
from pipelines.models.asking import Contestant
from pipelines.models.checkpoints import TreeFolder, open_trees


def train_model(
    job: TrainingJob,
    frames: CorpusFrames,
    validation: CorpusFrames,
    path: Path,
    n_threads: int,
    on_share: SetShare,
) -> None:
    """Trains a job's forest into a file; finished trees lie beside it until it is there.

    Args:
        job: What to train.
        frames: Frames to learn from.
        validation: Frames to tune on.
        path: The file.
        n_threads: Threads.
        on_share: Told the share that is done.

    Raises:
        UserError: Frames that nothing can be learned from, or another process trains there.
    """
    kind = KINDS["oarf" if isinstance(job.forest, OARFConfig) else "rwf"]()
    store: TreeFolder[Any] = TreeFolder(
        path.with_name(path.name + ".partial"),
        {"key": job.key},
        kind.pack_tree,
        lambda arrays: kind.unpack_tree(arrays, LABELS, job.forest),
    )
    metadata = {"row": job.row, "key": job.key, "corpus": frames.corpus.digest, "sensor": job.sensor}
    with open_trees(store):
        try:
            model = kind.train(
                frames,
                job.forest,
                validation=validation,
                n_threads=n_threads,
                checkpoint=store,
                on_progress=on_share,
            )
        except ValueError as error:
            raise UserError(f"{job.row} cannot be trained: {error}") from None
        kind.save(path, model, metadata)
        store.clear()


def read_contestant(job: ScoringJob, path: Path) -> Contestant:
    """A job's forest as it is asked; pixels are labelled by forests that are asked as they were trained.

    Args:
        job: With how many trees and voting pixels it is asked.
        path: The model's file.

    Raises:
        UserError: The file is damaged.
    """
    contestant = replace(load_contestant(path)[0], method=job.training.row)
    if not (job.n_trees or job.n_pixels):
        return contestant
    assert isinstance(contestant.predictor, Predictor)
    model = contestant.predictor.model
    config = replace(model.config, n_voting_pixels=job.n_pixels or model.config.n_voting_pixels)
    model = replace(model, config=config, trees=model.trees[: job.n_trees or None])
    return replace(contestant, predictor=Predictor(model), classes=None)
