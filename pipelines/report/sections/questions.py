"""The section of further questions: their conditions side by side."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pipelines.report.chart import Axis, Point, Series, line_chart, round_axis
from pipelines.report.methods import HEADLINES, METHODS, pair_name
from pipelines.report.page import Chart, Section, Table
from pipelines.report.source import Source
from pipelines.report.text import NOTHING, difference, measured

_TITLES: Mapping[str, str] = {
    "context": "Does the gain need the relation of object and pose?",
    "paper_scenes": "Is the gain larger among tables and laptops alone, the paper's objects?",
    "unseen_class": "Does the gain hold for a class of objects that was never seen?",
    "sensor": "Does the gain hold under a sensor's noise?",
    "imported": "Does the gain hold on recorded poses and other people's objects?",
    "skeletons": "What does it gain to make one skeleton out of the proposals of all joints?",
    "frames": "How do the scores grow with training frames?",
    "trees": "How do the scores grow with trees?",
    "pixels": "How do the scores grow with voting pixels?",
    "rooms": "What is lost in rooms with several people, whom a finder finds?",
}
_SETTINGS: Mapping[str, str] = {
    "is_context_kept": "relation kept",
    "class": "class",
    "is_seen_in_training": "seen in training",
    "in_training": "in training",
    "in_test": "in test",
    "is_one_skeleton": "one skeleton",
    "told": "told beside depth",
    "n_train_frames": "training frames",
    "n_trees": "trees",
    "n_voting_pixels": "voting pixels",
    "people": "people are",
    "box": "box",
}
_NOTES: Mapping[str, str] = {
    "imported": "The forests are those of the main table, all trainings of them, and learned from procedural "
    "frames alone; only the test frames are others.",
}
_MEASURE = "map_10cm"
Condition = Mapping[str, Any]


def questions_section(source: Source) -> Section:
    """What else was asked, each question with a table of its conditions, and a chart if they are numbers."""
    title = "Further questions"
    asked = {name: conditions for name, conditions in source.document["questions"].items() if conditions}
    if not asked:
        return Section("questions", title, missing="the ablation asked none")
    n_seeds = source.document["settings"]["n_question_seeds"]
    values = {
        "trainings": f"{n_seeds} {'training' if n_seeds == 1 else 'trainings'}",
        "questions": [_question(name, conditions) for name, conditions in asked.items()],
    }
    return Section("questions", title, values)


def _question(name: str, conditions: Sequence[Condition]) -> dict[str, Any]:
    settings = list(conditions[0]["settings"])
    rows = [row for row in METHODS if row in conditions[0]["rows"]]
    groups: tuple[tuple[str, str, Callable[[Mapping], Mapping]], ...] = (
        ("all", "All joints", lambda scores: scores),
        ("occluded", "Occluded joints", lambda scores: scores["occluded"]),
    )
    tables = [_table(f"question-{name}-{key}", words, conditions, rows, of) for key, words, of in groups]
    return {
        "title": _TITLES.get(name, name),
        "note": _NOTES.get(name, ""),
        "charts": _charts(conditions, settings, rows),
        "methods": [METHODS[row] for row in rows],
        "tables": tables,
    }


def _table(
    name: str, caption: str, conditions: Sequence[Condition], rows: Sequence[str], of: Callable[[Mapping], Mapping]
) -> Table:
    """The conditions below each other.

    Args:
        name: The table's.
        caption: What it shows.
        conditions: Of a question.
        rows: Methods.
        of: Takes a group of joints out of a method's scores.
    """
    settings = list(conditions[0]["settings"])
    pairs = [pair for pair in HEADLINES if pair in conditions[0]["differences"]]
    body = [
        [
            *(_setting(condition["settings"][key]) for key in settings),
            str(next(iter(condition["rows"].values()))["n_frames"]),
            *(measured(of(condition["rows"][row]), _MEASURE) for row in rows),
            *(_gap(condition, pair, of) for pair in pairs),
        ]
        for condition in conditions
    ]
    names = [METHODS[row].name for row in rows] + [pair_name(pair) for pair in pairs]
    return Table(name, caption, [*(_SETTINGS.get(key, key) for key in settings), "test frames", *names], body)


def _gap(condition: Condition, pair: str, of: Callable[[Mapping], Mapping]) -> str:
    return (
        difference(of(condition["differences"][pair]), _MEASURE) if pair in condition["differences"] else NOTHING
    )


def _setting(value: str | float | bool | None) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "clean" if value is None else f"{value:,}" if isinstance(value, int) else str(value)


def _charts(conditions: Sequence[Condition], settings: Sequence[str], rows: Sequence[str]) -> list[Chart]:
    """Curves over the one setting, if it is a number; else none."""
    values = [condition["settings"][settings[0]] for condition in conditions]
    if len(settings) > 1 or len(set(values)) < 2 or any(type(value) is not int for value in values):
        return []
    margin = (max(values) / min(values)) ** 0.06
    low, high = min(values) / margin, max(values) * margin
    x = Axis(_SETTINGS.get(settings[0], settings[0]), low, high, tuple(values), is_log=True)
    charts = []
    for group, words in {"": "All joints", "occluded": "Occluded joints"}.items():
        series = [
            Series(METHODS[row], tuple(_point(condition, settings[0], row, group) for condition in conditions))
            for row in rows
        ]
        ends = [end for item in series for point in item.points for end in (point.low, point.high, point.y)]
        y = round_axis("mean average precision [%]", ends, (0.0, 10.0))
        charts.append(Chart(words, line_chart(f"{words}, by {x.label}", series, x, y)))
    return charts


def _point(condition: Condition, setting: str, row: str, group: str) -> Point:
    scores = condition["rows"][row]
    scores = scores[group] if group else scores
    ends = scores[f"{_MEASURE}_ci"] or (None, None)
    values = (None if value is None else 100.0 * value for value in (scores[_MEASURE], *ends))
    return Point(condition["settings"][setting], *values)
