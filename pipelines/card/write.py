"""Composes a model card as Markdown: one template, filled from the model's file and from its scores on corpora."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from pipelines.card.sources import Source, check_told, source_of, sources_told, template
from pipelines.corpus.joined import sensors_of
from pipelines.corpus.read import Corpus
from pipelines.errors import UserError
from pipelines.models.asking import Contestant
from pipelines.models.kinds import kind_named
from pipelines.models.opening import open_model
from pipelines.models.scoring import Scoring, score_model
from pipelines.report.text import measured, with_interval

MEASURES = ("accuracy_10cm", "map_10cm", "mean_error_cm")
GROUPS = {"all joints": None, "visible": "visible", "occluded by an object": "occluded"}
BODIES = {
    "joints on the other side's joint [%]": "swapped",
    "frames with the heading off by more than 90 degrees [%]": "heading_flipped",
}


class Score(NamedTuple):
    """What a model scored on one corpus.

    Attributes:
        source: The corpus.
        title: Over the score, in words.
        n_frames: Frames that were scored.
        n_joints: Known joints in them.
        rows: Name of a group and its measures, ready to be shown.
        joints: Name of a joint and its measures, likewise.
        bodies: Names and values of the measures of whole skeletons.
    """

    source: Source
    title: str
    n_frames: int
    n_joints: int
    rows: list[tuple[str, list[str]]]
    joints: list[tuple[str, list[str]]]
    bodies: list[tuple[str, str]]


def card_of(
    model: Path, corpora: Sequence[Corpus], sensor: str, joint_offsets: int, limit: int, n_threads: int
) -> str:
    """A model's card.

    Args:
        model: File of the model.
        corpora: Open corpora; the model is scored on the split test of each that has one.
        sensor: Sensor model for the depth of generated frames.
        joint_offsets: Frames of recorded corpora on which offsets between definitions of joints are learned.
        limit: Most frames of each that are scored; 0 = all.
        n_threads: Frames in work at a time.

    Raises:
        UserError: There is no such model or sensor, the model does not say what it was trained on, or no corpus
            has a frame of the split test.
    """
    contestant, about = open_model(model)
    told, learned = check_told(model)
    sources = [source_of(corpus, corpus.digest in learned) for corpus in corpora]
    scores: list[Score] = []
    for corpus, source, noise in zip(corpora, sources, sensors_of(corpora, sensor), strict=True):
        if len(corpus.split("test")):
            scoring = Scoring("test", noise, limit, joint_offsets if source.is_recorded else 0, pixels=False)
            scores += _scores(source, scoring, score_model(contestant, about, corpus, scoring, n_threads))
    if not scores:
        raise UserError(f"{', '.join(source.name for source in sources)}: no frames of the split test to score on")
    return template("card.md").render(
        name=model.stem,
        file=model.name,
        digest=about["digest"],
        megabytes=model.stat().st_size / 1e6,
        kind=kind_named(about["kind"], model).title,
        told=told,
        scores=scores,
        boxed=_boxed(contestant),
        **sources_told(sources, learned, corpora),
    )


def _boxed(contestant: Contestant) -> str:
    """The joints whose true box a model is given when it is scored, in words; empty = none."""
    if set(contestant.box_joints) == set(contestant.joints):
        return "all joints"
    return ", ".join(name.replace("_", " ") for name in contestant.box_joints)


def _scores(source: Source, scoring: Scoring, document: dict) -> Iterator[Score]:
    """What was scored on a corpus, as it is, and with offsets if there are any."""
    yield _score(source, document, scoring.sensor or ("as recorded" if source.is_recorded else "clean depth"))
    if document["joint_offsets"] is not None:
        moved = document["joint_offsets"]["scores"]
        yield _score(source, moved, f"with offsets learned on {scoring.joint_offsets} other frames")


def _score(source: Source, document: dict, how: str) -> Score:
    return Score(
        source,
        f"{source.name}, {how}",
        document["n_frames"],
        document["n_joints"],
        [(name, _cells(document if key is None else document[key])) for name, key in GROUPS.items()],
        [(name, _cells(values)) for name, values in document["by_joint"].items() if values["n_joints"]],
        [(words, _percent(document["bodies"], name)) for words, name in BODIES.items()],
    )


def _cells(values: dict) -> list[str]:
    return [measured(values, name) for name in MEASURES]


def _percent(values: dict, name: str) -> str:
    return with_interval(values[name], values[f"{name}_ci"], 100.0)
