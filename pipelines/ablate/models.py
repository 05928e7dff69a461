"""Models of every kind: trained into a file, tree by tree, and asked as a scoring wants it."""

from dataclasses import replace
from pathlib import Path

from forests.frames import FrameSequence
from pipelines.ablate.jobs import ScoringJob, TrainingJob
from pipelines.ablate.progress import SetShare
from pipelines.errors import UserError
from pipelines.models.asking import Contestant
from pipelines.models.kinds import KINDS, Tools
from pipelines.models.opening import open_model
from pipelines.models.training import train_into


def train_model(
    job: TrainingJob,
    corpus_digest: str,
    frames: FrameSequence,
    validation: FrameSequence,
    path: Path,
    n_threads: int,
    on_share: SetShare,
) -> None:
    """Trains a job's model into a file; finished trees lie beside it until it is there.

    Args:
        job: What to train.
        corpus_digest: Of the frames' corpus.
        frames: Frames to learn from.
        validation: Frames to tune on.
        path: The file.
        n_threads: Threads; nets, which depend on their number, are trained with one.
        on_share: Told the share that is done.

    Raises:
        UserError: Torch is missing, frames that nothing can be learned from, or another process trains there.
    """
    metadata = {"row": job.row, "key": job.key, "corpus": corpus_digest, "sensor": job.sensor, "told": job.told}
    try:
        train_into(
            path,
            job.kind if job.told != "predicted" else replace(job.kind, tools=_context_tools),
            job.config,
            frames,
            validation,
            identity={"key": job.key},
            metadata=lambda model: metadata,
            n_threads=1 if job.kind.is_net else n_threads,
            on_share=on_share,
        )
    except ValueError as error:
        raise UserError(f"{job.row} cannot be trained: {error}") from None


def _context_tools() -> Tools:
    """The functions of regression forests, with a training that learns from the predictions of a first forest."""
    from forests.oarf.context import train_with_context

    return KINDS["oarf"].tools()._replace(train=train_with_context)


def read_contestant(job: ScoringJob, path: Path) -> Contestant:
    """A job's model as it is asked.

    Pixels are labelled by forests that are asked as they were trained, of depth alone and of single people.

    Args:
        job: With how many trees and voting pixels it is asked.
        path: The model's file.

    Raises:
        UserError: The file is damaged.
    """
    contestant = replace(open_model(path, is_told=job.training.told is not None)[0], method=job.training.row)
    if job.training.told is not None or job.place is not None:
        return replace(contestant, labeller=None)
    if not (job.n_trees or job.n_pixels):
        return contestant
    reduced = job.training.kind.reduced
    if reduced is None:
        raise UserError(f"{job.training.row} cannot be asked with fewer trees or other voting pixels")
    return replace(contestant, predictor=reduced(contestant.predictor, job.n_trees, job.n_pixels), labeller=None)
