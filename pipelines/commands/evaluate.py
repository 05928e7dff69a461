"""undergrowth evaluate: scores a model on a corpus against the rendered truth."""

import json
import logging
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.corpus import Corpus
from pipelines.errors import UserError
from pipelines.metrics import N_RESAMPLES
from pipelines.metrics.document import table_lines
from pipelines.metrics.offsets import AXES
from pipelines.metrics.results import is_results
from pipelines.metrics.views import view_lines
from pipelines.models.opening import open_model
from pipelines.models.scoring import Scoring, score_model
from pipelines.orientation.opening import is_orientation_net, open_net
from pipelines.orientation.scoring import OrientationScoring, score_orientation
from pipelines.orientation.scoring import table_lines as orientation_lines
from pipelines.targets import check_file
from storage.ranges import MAX_FRAMES, MAX_SEED, MAX_THREADS, check_fields

_RANGES = {
    "limit": (0, MAX_FRAMES),
    "joint_offsets": (0, MAX_FRAMES),
    "threads": (1, MAX_THREADS),
    "resamples": (1, 10**6),
    "seed": (0, MAX_SEED),
}
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class EvaluateSettings:
    """Scores a model on a corpus and prints a table with 95 % intervals.

    Of a corpus of rooms, everybody is scored who ought to be found: 1 to 5 m away, at least a quarter visible. Where
    several cameras see a scene, their answers are also fused.

    Orientation nets are scored by their angles; --joint-offsets, --rows, --pixels, --found and --skeleton do not
    concern them.

    Attributes:
        model: File of the model.
        corpus: Folder of the corpus.
        split: Split to score on: train, val or test.
        sensor: Name of a sensor model whose noise is added to the depth of generated frames. By default the depth
            stays clean.
        limit: Use at most this many frames, evenly spread; 0 uses all.
        joint_offsets: Learn on this many frames, which are not scored, where the corpus defines its joints
            relative to the model's, and score a second time with the answers moved by these offsets; 0 scores
            once.
        json: Print one JSON object instead of a table.
        rows: Write every answer beside the truth to this .npz file.
        threads: Number of frames that are processed at the same time. The scores do not depend on it.
        pixels: Also score the labels of pixels, if the model gives any.
        skeleton: Make one skeleton out of the model's proposals. Without, each joint is found on its own.
        resamples: Number of bootstrap resamples of the frames for the confidence intervals.
        seed: Seed of the resamples.
        found: In rooms, cut people out where the finder finds them; those whom it does not find count as wrong. By
            default everybody is cut out at their true place.
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
    skeleton: bool = True
    resamples: int = N_RESAMPLES
    seed: int = 0
    found: bool = False

    def __post_init__(self) -> None:
        check_fields(self, _RANGES)

    def run(self) -> int:
        """Scores the model and prints."""
        is_net = is_orientation_net(self.model)
        document = self._orientation_scores() if is_net else self.scores()
        if self.json:
            sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
            return 0
        log.info("%s on %s, split %s: %s", self.model, self.corpus, self.split, _scored(document))
        if is_net:
            for line in orientation_lines(document):
                log.info("%s", line)
            return 0
        for line in (*table_lines(document), *view_lines(document["views"]), *_pixel_lines(document["pixels"])):
            log.info("%s", line)
        for line in _offset_lines(document["joint_offsets"]):
            log.info("%s", line)
        return 0

    def _orientation_scores(self) -> dict:
        """All scores of an orientation net as JSON values.

        Raises:
            UserError: As of `scores`, or a setting that does not concern such nets.
        """
        if self.rows is not None or self.joint_offsets or self.found:
            raise UserError(
                f"{self.model} is an orientation net; --rows, --joint-offsets and --found are for joints"
            )
        predictor, about = open_net(self.model)
        scoring = OrientationScoring(self.split, self.sensor, self.limit, self.resamples, self.seed)
        return score_orientation(predictor, about, Corpus.open(self.corpus), scoring)

    def scores(self) -> dict:
        """All scores as JSON values; writes the rows if asked.

        Raises:
            UserError: The model, corpus, split or sensor does not exist or is damaged, no frames are left, or the
                rows would replace a file of others.
        """
        if self.rows is not None:
            check_file(self.rows, is_results)
        contestant, about = open_model(self.model, self.skeleton)
        scoring = Scoring(
            self.split,
            self.sensor,
            self.limit,
            self.joint_offsets,
            self.pixels,
            self.resamples,
            self.seed,
            self.skeleton,
            self.found,
        )
        return score_model(contestant, about, Corpus.open(self.corpus), scoring, self.threads, self.rows)


def _scored(document: dict) -> str:
    """What the scores are of, in words."""
    n_scenes = document.get("n_scenes")
    if n_scenes is None:
        return f"{document['n_frames']} frames"
    where = "where the finder finds them" if document["configuration"]["found"] else "at their true places"
    return f"{document['n_frames']} people in {n_scenes} scenes, cut out {where}"


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
