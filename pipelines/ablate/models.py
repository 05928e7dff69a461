"""Forests of either kind: trained into a file with resumable trees, read back, made ready to be asked."""

import importlib
from pathlib import Path
from typing import Any

from forests.modelfile import ModelFileError
from forests.oarf.config import OARFConfig
from forests.oarf.forest import train
from forests.oarf.model import OARFModel
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model as load_oarf
from forests.oarf.storage import save_model as save_oarf
from forests.rwf.forest import Walker
from forests.rwf.model import RWFModel
from forests.rwf.train import train_rwf
from pipelines.ablate.jobs import TrainingJob
from pipelines.ablate.progress import SetShare
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import UserError


def train_model(
    job: TrainingJob,
    train_frames: CorpusFrames,
    val_frames: CorpusFrames,
    path: Path,
    n_threads: int,
    on_share: SetShare,
) -> None:
    """Trains a job's forest into a file.

    Args:
        job: What to train.
        train_frames: Frames to learn from.
        val_frames: Frames to tune on.
        path: The file.
        n_threads: Threads.
        on_share: Told the share that is done.
    """
    metadata = {"row": job.row, "key": job.key, "corpus_digest": train_frames.corpus.digest, "sensor": job.sensor}
    if isinstance(job.forest, OARFConfig):
        forest = train(train_frames, job.forest, validation=val_frames, n_threads=n_threads, on_progress=on_share)
        save_oarf(path, forest, metadata)
    else:
        walks = train_rwf(
            train_frames, job.forest, validation=val_frames, n_threads=n_threads, on_progress=on_share
        )
        _rwf_storage().save_model(path, walks, metadata)


def load_model(job: TrainingJob, path: Path) -> OARFModel | RWFModel:
    """A trained forest out of its file.

    Raises:
        UserError: The file is damaged.
    """
    try:
        return load_oarf(path) if isinstance(job.forest, OARFConfig) else _rwf_storage().load_model(path)
    except ModelFileError as error:
        raise UserError(str(error)) from None


def predictor_of(model: OARFModel | RWFModel) -> Predictor | Walker:
    """A forest ready to be asked."""
    return Predictor(model) if isinstance(model, OARFModel) else Walker(model)


def _rwf_storage() -> Any:
    return importlib.import_module("forests.rwf.storage")
