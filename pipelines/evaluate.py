"""undergrowth evaluate: scores a model on a corpus against the rendered truth."""

import hashlib
import json
import logging
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from tqdm import tqdm

from forests.modelfile import ModelFileError, read_model
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model as load_regression_forest
from forests.rwf.forest import Walker
from pipelines.corpus import Corpus
from pipelines.corpus.header import software_versions
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import UserError
from pipelines.metrics import N_RESAMPLES, draw_frames, read_truths
from pipelines.metrics.document import pixel_values, score_document, table_lines
from pipelines.predictions import Contestant, contestant_of, predict_frames
from pipelines.results import write_results

log = logging.getLogger(__name__)

SCHEMA = "undergrowth evaluation"
SCHEMA_VERSION = 1


@dataclass(frozen=True)
class EvaluateSettings:
    """Scores a model on a corpus.

    Attributes:
        model: The model's file.
        corpus: The corpus' folder.
        split: Which of its frames: train, val or test.
        sensor: Sensor model for the depth; by default clean depth.
        limit: Take so many frames only, evenly spread; 0 takes all.
        json: Print one JSON object instead of a table.
        rows: Write what was answered beside the truth to this .npz file.
        threads: Frames in work at a time; the scores do not depend on it.
        pixels: Score the labels of pixels too, if the model gives any.
        resamples: Resamples of the frames for the confidence intervals.
        seed: Of the resamples.
    """

    model: Annotated[Path, tyro.conf.Positional]
    corpus: Annotated[Path, tyro.conf.Positional]
    split: str = "test"
    sensor: str | None = None
    limit: int = 0
    json: bool = False
    rows: Path | None = None
    threads: int = 1
    pixels: bool = True
    resamples: int = N_RESAMPLES
    seed: int = 0

    def __post_init__(self) -> None:
        for name, least in {"limit": 0, "threads": 1, "resamples": 1, "seed": 0}.items():
            if getattr(self, name) < least:
                raise ValueError(f"{name}={getattr(self, name)} must be at least {least}")

    def run(self) -> int:
        """Scores the model and prints."""
        document = evaluate(self)
        if self.json:
            sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
            return 0
        log.info("%s on %s, split %s: %d frames", self.model, self.corpus, self.split, document["n_frames"])
        for line in table_lines(document):
            log.info("%s", line)
        if document["pixels"]:
            log.info("")
            for name in ("part_accuracy", "occluder_accuracy", "class_accuracy", "object_recall"):
                value = document["pixels"][name]
                log.info("%-24s%9s", name, "-" if value is None else f"{value:.3f}")
        return 0


def evaluate(settings: EvaluateSettings) -> dict:
    """Scores a model; writes the rows if asked.

    Returns:
        All scores as JSON values, see docs/metrics.md.

    Raises:
        UserError: No such model, corpus, split or sensor; a corpus or model that is damaged.
    """
    contestant, about = load_contestant(settings.model)
    if not settings.pixels:
        contestant = replace(contestant, classes=None)
    corpus = Corpus.open(settings.corpus)
    indices = spread(corpus.split(settings.split), settings.limit)
    if not len(indices):
        raise UserError(f"{settings.corpus} has no frames of the split {settings.split}")
    frames = CorpusFrames(corpus, indices, settings.sensor)
    with tqdm(total=len(frames), unit="frame", delay=2.0, dynamic_ncols=True) as bar:
        results, confusion = predict_frames(
            contestant, frames, read_truths(corpus, indices), settings.threads, bar.update
        )
    names = ("split", "sensor", "limit", "pixels", "resamples", "seed")
    context = {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "model": about,
        "corpus": {"name": settings.corpus.resolve().name, "digest": corpus.digest},
        "configuration": {name: getattr(settings, name) for name in names},
        "software": software_versions(),
    }
    if settings.rows is not None:
        write_results(settings.rows, [results], context)
    weights = draw_frames(len(frames), settings.resamples, np.random.default_rng(settings.seed))
    pixels = None if confusion is None else pixel_values(confusion)
    return context | score_document(results, weights) | {"pixels": pixels}


def load_contestant(path: Path) -> tuple[Contestant, dict]:
    """A model out of its file, and what is told of it: name, digest, configuration.

    Raises:
        UserError: There is no such file, or it holds no model.
    """
    try:
        contents = read_model(path)
        if contents.kind not in _PREDICTORS:
            known = ", ".join(_PREDICTORS)
            raise UserError(f"{path} holds a model of kind {contents.kind!r}; known are {known}")
        predictor = _PREDICTORS[contents.kind](path)
    except ModelFileError as error:
        raise UserError(str(error)) from None
    config = contents.metadata.get("config")
    about = {"name": path.name, "kind": contents.kind, "digest": file_digest(path), "config": config}
    return contestant_of(path.stem, predictor), about


def _regression_forest(path: Path) -> Predictor:
    return Predictor(load_regression_forest(path))


def _random_walk_forest(path: Path) -> Walker:
    from forests.rwf.storage import load_model

    return Walker(load_model(path))


_PREDICTORS: dict[str, Callable[[Path], object]] = {"oarf": _regression_forest, "rwf": _random_walk_forest}
"""How a model of a kind is made ready to be asked."""


def spread(indices: np.ndarray, limit: int) -> np.ndarray:
    """At most `limit` of the frame numbers, evenly spread; all if it is 0."""
    if not 0 < limit < len(indices):
        return indices
    return indices[np.arange(limit) * len(indices) // limit]


def file_digest(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
