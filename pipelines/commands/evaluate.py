"""undergrowth evaluate: scores a model on a corpus against the rendered truth."""

import hashlib
import json
import logging
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from tqdm import tqdm

from forests.modelfile import ModelFileError, read_model
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model as load_regression_forest
from forests.rwf.predict import Predictor as Walker
from pipelines.corpus import Corpus
from pipelines.corpus.fields import SPLITS
from pipelines.corpus.header import software_versions
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import UserError
from pipelines.metrics import N_RESAMPLES, draw_frames, read_truths
from pipelines.metrics.document import pixel_values, score_document, table_lines
from pipelines.metrics.offsets import AXES, frames_apart, learn_offsets, upwards, with_offsets
from pipelines.metrics.pixels import Confusion
from pipelines.metrics.resampling import FrameWeights
from pipelines.metrics.results import Results, write_results
from pipelines.models.asking import Contestant, contestant_of, predict_frames

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
        joint_offsets: Learn on so many frames that are not scored where the corpus' joints lie beside the model's,
            and score a second time with its answers moved there; 0 does not.
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
    joint_offsets: int = 0
    json: bool = False
    rows: Path | None = None
    threads: int = 1
    pixels: bool = True
    resamples: int = N_RESAMPLES
    seed: int = 0

    def __post_init__(self) -> None:
        for name, least in {"limit": 0, "joint_offsets": 0, "threads": 1, "resamples": 1, "seed": 0}.items():
            if getattr(self, name) < least:
                raise ValueError(f"{name}={getattr(self, name)} must be at least {least}")

    def run(self) -> int:
        """Scores the model and prints."""
        document = evaluate(self)
        if self.json:
            sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
            return 0
        log.info("%s on %s, split %s: %d frames", self.model, self.corpus, self.split, document["n_frames"])
        for line in (*table_lines(document), *_pixel_lines(document["pixels"])):
            log.info("%s", line)
        for line in _offset_lines(document["joint_offsets"]):
            log.info("%s", line)
        return 0


def evaluate(settings: EvaluateSettings) -> dict:
    """Scores a model; writes the rows if asked.

    Returns:
        All scores as JSON values, see docs/metrics.md.

    Raises:
        UserError: No such model, corpus, split or sensor; a corpus or model that is damaged; no frames are left.
    """
    contestant, about = load_contestant(settings.model)
    if not settings.pixels:
        contestant = replace(contestant, classes=None)
    corpus = Corpus.open(settings.corpus)
    corpus.check_sensor(settings.sensor)
    learning, scored = frames_apart(corpus, settings.split, settings.joint_offsets)
    indices = spread(scored, settings.limit)
    if not len(indices):
        raise UserError(f"{settings.corpus} has no frames of the split {settings.split}")
    results, confusion = _ask(settings, contestant, corpus, indices)
    names = ("split", "sensor", "limit", "joint_offsets", "pixels", "resamples", "seed")
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
    weights = draw_frames(len(indices), settings.resamples, np.random.default_rng(settings.seed))
    document = context | score_document(results, weights)
    document["pixels"] = None if confusion is None else pixel_values(confusion)
    document["joint_offsets"] = None
    if len(learning):
        taught, _ = _ask(settings, replace(contestant, classes=None), corpus, learning)
        document["joint_offsets"] = _with_offsets(corpus, taught, results, weights)
    return document


def _with_offsets(corpus: Corpus, taught: Results, results: Results, weights: FrameWeights) -> dict:
    """Offsets learned on some frames' results, and the scores of the others' with them, as JSON values."""
    learning = taught.truths.frame
    offsets = learn_offsets(taught, upwards(corpus, learning))
    moved = with_offsets(results, upwards(corpus, results.truths.frame), offsets)
    return {
        "splits": [name for name in SPLITS if name in {corpus.info(int(number)).split for number in learning}],
        "frames": learning.tolist(),
        "by_joint": offsets.values(),
        "scores": score_document(moved, weights),
    }


def _ask(
    settings: EvaluateSettings, contestant: Contestant, corpus: Corpus, indices: np.ndarray
) -> tuple[Results, Confusion | None]:
    frames = CorpusFrames(corpus, indices, settings.sensor)
    with tqdm(total=len(frames), unit="frame", delay=2.0, dynamic_ncols=True) as bar:
        return predict_frames(contestant, frames, read_truths(corpus, indices), settings.threads, bar.update)


def _pixel_lines(pixels: dict | None) -> Iterator[str]:
    """The terminal's lines about labels of pixels."""
    if pixels is not None:
        yield ""
        for name in ("part_accuracy", "occluder_accuracy", "class_accuracy", "object_recall"):
            yield f"{name:<24}{'-' if pixels[name] is None else format(pixels[name], '.3f'):>9}"


def _offset_lines(learned: dict | None) -> Iterator[str]:
    """The terminal's lines about joints that were moved by what the corpus calls them."""
    if learned is None:
        return
    frames = learned["frames"]
    yield ""
    splits = ", ".join(learned["splits"])
    yield f"offsets learned on {len(frames)} frames of {splits}, numbers {min(frames)}..{max(frames)}"
    yield f"{'[cm]':<24}" + "".join(f"{word:>9}" for word in (*AXES, "frames"))
    for name, of_joint in learned["by_joint"].items():
        numbers = ["-"] * len(AXES) if of_joint is None else [f"{of_joint[f'{axis}_cm']:.1f}" for axis in AXES]
        n = 0 if of_joint is None else of_joint["n_frames"]
        yield f"{name:<24}" + "".join(f"{number:>9}" for number in (*numbers, n))
    yield ""
    yield "with these offsets:"
    yield from table_lines(learned["scores"])


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
