"""Scores a model on a split of a corpus, with and without offsets between joint definitions, as JSON values."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from forests.frames import LabelTable
from pipelines.corpus import Corpus
from pipelines.corpus.header import software_versions
from pipelines.corpus.rooms.views import PeopleFrames, Place, frames_shown
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import UserError
from pipelines.metrics import N_RESAMPLES, draw_frames
from pipelines.metrics.document import pixel_values, score_document
from pipelines.metrics.offsets import frames_apart, learn_offsets, upwards, with_offsets
from pipelines.metrics.pixels import Confusion
from pipelines.metrics.resampling import FrameWeights, draw_together
from pipelines.metrics.results import Results, write_results
from pipelines.metrics.truths import truths_of_frames
from pipelines.metrics.views import clips_of_rows, frames_of_rows, view_document, whole_scenes
from pipelines.models.asking import Contestant, predict_frames
from pipelines.progress import Progress
from synth.vocabulary import SPLITS

SCHEMA = "undergrowth evaluation"
SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Scoring:
    """What a score depends on besides model and corpus.

    Attributes:
        split: Which frames: train, val or test.
        sensor: Sensor model for the depth; None = clean depth.
        limit: Most frames that are scored, evenly spread, all cameras of a scene or none; 0 = all.
        joint_offsets: Frames, not scored, on which offsets between the joints of corpus and model are learned for
            a second score; 0 = none.
        pixels: Whether labels of pixels are scored too, if the model gives any.
        resamples: Resamples of the frames for the confidence intervals.
        seed: Of the resamples.
        skeleton: Whether the model makes one skeleton out of its proposals; for the record.
        found: Whether people of whole scenes are cut out where the finder finds them, and answered by nobody where it
            does not, instead of at their true places.
    """

    split: str = "test"
    sensor: str | None = None
    limit: int = 0
    joint_offsets: int = 0
    pixels: bool = True
    resamples: int = N_RESAMPLES
    seed: int = 0
    skeleton: bool = True
    found: bool = False


def score_model(
    contestant: Contestant,
    about: dict,
    corpus: Corpus,
    scoring: Scoring,
    n_threads: int = 1,
    rows: Path | None = None,
) -> dict:
    """Scores a model; writes what it answered if a file is named.

    Args:
        contestant: The model.
        about: What is told of its file, as JSON values.
        corpus: An open corpus.
        scoring: Which frames, and how.
        n_threads: Frames in work at a time; the scores do not depend on it.
        rows: .npz file for the answers beside the truth.

    Returns:
        All scores as JSON values, see docs/metrics.md.

    Raises:
        UserError: No such sensor, settings that do not concern the corpus, or nobody is left to be scored.
    """
    _check(corpus, scoring)
    if not scoring.pixels:
        contestant = replace(contestant, labeller=None)
    learning, scored = frames_apart(corpus, scoring.split, scoring.joint_offsets)
    indices = whole_scenes(corpus, scored, scoring.limit)
    if not len(indices):
        raise UserError(f"{corpus.path} has no frames of the split {scoring.split}")
    place: Place | None = ("found" if scoring.found else "true") if corpus.header.has_rooms else None
    frames = frames_shown(corpus, indices, scoring.sensor, place)
    if not len(frames):
        raise UserError(f"{corpus.path} has nobody in the split {scoring.split} who ought to be found")
    context = _context(about, corpus, scoring)
    results, confusion = _answers(_labelling(contestant, frames.labels), frames, n_threads)
    if rows is not None:
        write_results(rows, [results], context)
    weights, by_clip = _weights(corpus, indices, frames, results, scoring)
    document = context | score_document(results, weights)
    document["n_scenes"] = len(np.unique(frames.indices)) if corpus.header.has_rooms else None
    document["views"] = None if by_clip is None else view_document(corpus, indices, results, by_clip)
    document["pixels"] = None if confusion is None else pixel_values(confusion)
    document["joint_offsets"] = None
    if len(learning):
        known = CorpusFrames(corpus, learning, scoring.sensor)
        taught, _ = _answers(replace(contestant, labeller=None), known, n_threads)
        document["joint_offsets"] = _with_offsets(corpus, taught, results, weights)
    return document


def _weights(
    corpus: Corpus, indices: np.ndarray, frames: CorpusFrames | PeopleFrames, results: Results, scoring: Scoring
) -> tuple[FrameWeights, FrameWeights | None]:
    """How often each answer counts in each resample, all people of a frame alike; and each scene of several cameras."""
    rng = np.random.default_rng(scoring.seed)
    if corpus.header.cameras == 1:
        return draw_together(frames.indices, scoring.resamples, rng), None
    clips, n_clips = clips_of_rows(corpus, indices, results)
    by_clip = draw_frames(n_clips, scoring.resamples, rng)
    return by_clip[:, clips], by_clip


def _check(corpus: Corpus, scoring: Scoring) -> None:
    """Refuses settings that a corpus does not know."""
    corpus.check_sensor(scoring.sensor)
    if scoring.found and not corpus.header.has_rooms:
        raise UserError(f"{corpus.path} holds single people; --found is for corpora of rooms")
    if scoring.joint_offsets and corpus.header.has_rooms:
        raise UserError(f"{corpus.path} holds whole scenes; --joint-offsets is for frames of one person")


def _labelling(contestant: Contestant, labels: LabelTable) -> Contestant:
    """The model, without its labels of pixels where those are of other classes, as of who never saw a room."""
    if contestant.labeller is None:
        return contestant
    n_others = len(contestant.labeller.classes) - labels.n_parts
    is_known = n_others in (0, 1, labels.n_labels - labels.n_parts)
    return contestant if is_known else replace(contestant, labeller=None)


def _context(about: dict, corpus: Corpus, scoring: Scoring) -> dict:
    """What the scores are of, as JSON values."""
    return {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "model": about,
        "corpus": {"name": corpus.path.resolve().name, "digest": corpus.digest},
        "configuration": asdict(scoring),
        "software": software_versions(),
    }


def _with_offsets(corpus: Corpus, taught: Results, results: Results, weights: FrameWeights) -> dict:
    """Offsets learned on some frames' results, and the scores of the others' with them, as JSON values."""
    learning = frames_of_rows(corpus, taught)
    offsets = learn_offsets(taught, upwards(corpus, learning))
    moved = with_offsets(results, upwards(corpus, frames_of_rows(corpus, results)), offsets)
    return {
        "splits": [name for name in SPLITS if name in {corpus.info(int(number)).split for number in learning}],
        "frames": learning.tolist(),
        "by_joint": offsets.values(),
        "scores": score_document(moved, weights),
    }


def _answers(
    contestant: Contestant, frames: CorpusFrames | PeopleFrames, n_threads: int
) -> tuple[Results, Confusion | None]:
    with Progress(len(frames), "frame", "evaluate") as bar:
        return predict_frames(contestant, frames, truths_of_frames(frames), n_threads, bar.update)
