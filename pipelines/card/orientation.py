"""Composes the card of an orientation net as Markdown, from the net's file and from its scores on corpora."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pipelines.card.sources import Source, check_told, source_of, sources_told, template
from pipelines.corpus.joined import sensors_of
from pipelines.corpus.read import Corpus
from pipelines.errors import UserError
from pipelines.orientation.opening import open_net
from pipelines.orientation.scoring import OrientationScoring, score_orientation
from pipelines.report.text import with_interval

MEASURES = {
    "mean_error_deg": ("mean error [degrees]", 1.0),
    "median_error_deg": ("median error [degrees]", 1.0),
    "within_22deg": ("within 22.5 degrees [%]", 100.0),
    "flipped": ("off by more than 90 degrees [%]", 100.0),
    "posture_accuracy": ("posture right [%]", 100.0),
    "tilt_error_deg": ("tilt off by [degrees]", 1.0),
    "roll_error_deg": ("roll off by [degrees]", 1.0),
}
"""What is told of each group, and times what."""


class Score(NamedTuple):
    """What a net scored on one corpus.

    Attributes:
        source: The corpus.
        title: Over the score, in words.
        n_frames: Frames that were scored.
        columns: What is told of each group.
        rows: Name of a group, its frames, and its measures, ready to be shown.
    """

    source: Source
    title: str
    n_frames: int
    columns: list[str]
    rows: list[tuple[str, int, list[str]]]


def orientation_card(model: Path, corpora: Sequence[Corpus], sensor: str, limit: int) -> str:
    """The card of an orientation net.

    Args:
        model: File of the net.
        corpora: Open corpora; the net is scored on the split test of each that has one.
        sensor: Sensor model for the depth of generated frames.
        limit: Most frames of each that are scored; 0 = all.

    Raises:
        UserError: torch is missing, there is no such net or sensor, the net does not say what it was trained on, or no
            corpus has a frame of the split test that tells the angle.
    """
    predictor, about = open_net(model)
    told, learned = check_told(model)
    sources = [source_of(corpus, corpus.digest in learned) for corpus in corpora]
    scores = []
    for corpus, source, noise in zip(corpora, sources, sensors_of(corpora, sensor), strict=True):
        if len(corpus.split("test")):
            document = score_orientation(predictor, about, corpus, OrientationScoring("test", noise, limit))
            scores.append(_score(source, document, noise))
    if not scores:
        raise UserError(f"{', '.join(source.name for source in sources)}: no frames of the split test to score on")
    return template("orientation.md").render(
        name=model.stem,
        file=model.name,
        digest=about["digest"],
        megabytes=model.stat().st_size / 1e6,
        told=told,
        scores=scores,
        **sources_told(sources, learned, corpora),
    )


def _score(source: Source, document: Mapping[str, Any], noise: str | None) -> Score:
    keys = [key for key in MEASURES if document[key] is not None]
    groups = {"all": document}
    groups |= {f"joints hidden: {name}": values for name, values in document["by_hidden_joints"].items()}
    groups |= dict(document["by_posture"])
    return Score(
        source,
        f"{source.name}, {noise or ('as recorded' if source.is_recorded else 'clean depth')}",
        document["n_frames"],
        [MEASURES[key][0] for key in keys],
        [
            (name, values["n_frames"], [_cell(values, key) for key in keys])
            for name, values in groups.items()
            if values["n_frames"]
        ],
    )


def _cell(values: Mapping[str, Any], key: str) -> str:
    if values[key] is None or None in values[f"{key}_ci"]:
        return "-"
    return with_interval(values[key], values[f"{key}_ci"], MEASURES[key][1])
