"""Scores as JSON values and as a table for the terminal."""

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from pipelines.metrics import groups
from pipelines.metrics.bodies import measure_bodies
from pipelines.metrics.measures import CURVE_CM, MEASURES, Measure, Summary, accuracy_curve, summarise
from pipelines.metrics.pixels import Confusion
from pipelines.metrics.resampling import FrameWeights
from pipelines.metrics.results import Results

_TABLES = {
    "by_hiding_class": groups.by_hiding_class,
    "by_object_in_frame": groups.by_object_in_frame,
    "by_visible_fraction": groups.by_visible_fraction,
    "by_family": groups.by_family,
}
_CURVES = ("visible", "occluded", "non_occluded")
_SHOWN = {"map_10cm": "AP 10 cm", "accuracy_10cm": "accuracy 10 cm", "mean_error_cm": "mean error [cm]"}
"""Measures that the table shows, with their headings."""
_BODIES = {
    "swapped": "joints on the other side's joint",
    "heading_flipped": "frames with the heading off by more than 90 degrees",
    "heading_error_deg": "median error of the heading [degrees]",
}
"""Likewise, of whole skeletons."""


def score_document(results: Results, weights: FrameWeights) -> dict:
    """All measures of all groups as JSON values; docs/metrics.md describes the keys.

    Args:
        results: What a method answered.
        weights: (n_resamples, n_frames) int16, resamples of the frames.
    """

    def values(is_counted: NDArray[np.bool_]) -> dict:
        return summary_values(summarise(results, is_counted, weights))

    truths = results.truths
    everything = np.ones(truths.state.shape, np.bool_)
    states = groups.by_state(truths)
    document = values(everything) | {name: values(is_in) for name, is_in in states.items()}
    document["by_joint"] = {
        name: values(is_in) | {state: values(is_in & states[state]) for state in ("occluded", "non_occluded")}
        for name, is_in in groups.by_joint(truths).items()
    }
    for table, split in _TABLES.items():
        document[table] = {name: values(is_in) for name, is_in in split(truths).items()}
    curves = {"all": everything} | {name: states[name] for name in _CURVES}
    document["accuracy_curve"] = {"cm": list(CURVE_CM)} | {
        name: [number(share) for share in accuracy_curve(results, is_in)] for name, is_in in curves.items()
    }
    document["bodies"] = {}
    for name, measure in measure_bodies(results, weights).items():
        document["bodies"] |= _with_ends(name, measure)
    document["seconds_per_frame"] = number(np.median(results.seconds))
    return document


def summary_values(summary: Summary) -> dict:
    """One group's measures as JSON values: each with its interval under the name and "_ci"."""
    values: dict[str, object] = {"n_frames": summary.n_frames, "n_joints": summary.n_joints}
    for name in MEASURES:
        values |= _with_ends(name, summary.measures[name])
    return values


def _with_ends(name: str, measure: Measure) -> dict[str, object]:
    estimate, ends = number(measure.estimate), [number(measure.low), number(measure.high)]
    return {name: estimate, f"{name}_ci": None if estimate is None else ends}


def pixel_values(confusion: Confusion) -> dict:
    """Labels of pixels as JSON values."""
    return {
        "n_pixels": int(confusion.counts.sum()),
        "part_accuracy": number(confusion.part_accuracy),
        "occluder_accuracy": number(confusion.occluder_accuracy),
        "class_accuracy": number(confusion.class_accuracy),
        "body_recall": number(confusion.body_recall),
        "object_recall": number(confusion.object_recall),
        "labels": list(confusion.labels),
        "classes": list(confusion.classes),
        "confusion": confusion.counts.tolist(),
    }


def number(value: float | np.floating) -> float | None:
    """A JSON number; None for what JSON has no number for."""
    return float(value) if math.isfinite(value) else None


def table_lines(document: Mapping) -> Iterator[str]:
    """The terminal's table of a document: states with intervals, then joints."""
    yield f"{'':<16}{'joints':>8}" + "".join(f"{heading:>26}" for heading in _SHOWN.values())
    for name, values in (
        ("all", document),
        *((key, document[key]) for key in ("occluded", "non_occluded", "visible")),
    ):
        yield f"{name:<16}{values['n_joints']:>8}" + "".join(
            f"{_with_interval(values, key):>26}" for key in _SHOWN
        )
    yield ""
    for name, heading in _BODIES.items():
        yield f"{heading:<52}{_with_interval(document['bodies'], name)}"
    yield ""
    yield f"{'':<24}" + "".join(f"{heading:>26}" for heading in _SHOWN.values())
    columns = "".join(f"{word:>9}" for word in ("all", "occl.", "others"))[1:]
    yield f"{'':<24}" + f"{columns}" * len(_SHOWN)
    for name, values in document["by_joint"].items():
        cells = ((values, values["occluded"], values["non_occluded"]) for _ in _SHOWN)
        shown = zip(_SHOWN, cells, strict=True)
        yield f"{name:<24}" + "".join("".join(f"{_plain(v[key], key):>9}" for v in row)[1:] for key, row in shown)


def _with_interval(values: Mapping, key: str) -> str:
    if values[key] is None:
        return "-"
    low, high = (_plain(end, key) for end in values[f"{key}_ci"])
    return f"{_plain(values[key], key)} [{low}, {high}]"


def _plain(value: float | None, key: str) -> str:
    if value is None:
        return "-"
    return f"{value:.1f}" if key.endswith(("_cm", "_deg")) else f"{value:.3f}"
