"""Sections of tables: the paper's two, further measures, labels of pixels."""

from collections.abc import Iterator, Mapping

import numpy as np

from pipelines.metrics import MEASURES
from pipelines.models import paper
from pipelines.report.methods import METHODS, pair_name
from pipelines.report.page import Section, Table
from pipelines.report.source import Source
from pipelines.report.text import NOTHING, UNITS, counted, difference, measured, number

GROUPS: Mapping[str, str] = {"": "all joints", "non_occluded": "non-occluded", "occluded": "occluded"}
"""Groups of joints in the ablation's document, and how the page calls them."""
_HEADINGS: Mapping[str, str] = {
    "accuracy_10cm": "within 10 cm [%]",
    "auc_20cm": "area 0-20 cm [%]",
    "mean_error_cm": "mean error [cm]",
    "median_error_cm": "median error [cm]",
    "missing": "missing [%]",
}


def precision_section(source: Source) -> Section:
    """Mean average precision beside the paper's table 1, and paired differences."""
    told = source.document["paper_map_10cm"]

    def rows() -> Iterator[list[str]]:
        for name in source.rows:
            row = source.main["rows"][name]
            groups = [measured(_group(row, group), "map_10cm") for group in GROUPS]
            spread = number(row["map_10cm_sd"], UNITS["map_10cm"])
            yield [METHODS[name].name, number(told.get(name), 100.0), *groups, spread, str(row["n_seeds"])]

    headings = ["", "paper, table 1", *GROUPS.values(), "sd of trainings", "trainings"]
    title = "Mean average precision at 10 cm"
    values = {
        "scores": Table("precision", f"{title} [%], with 95 % intervals", headings, list(rows())),
        "differences": _differences(source, "map_10cm", "precision-differences"),
        "has_seeds": any(row["n_seeds"] > 1 for row in source.main["rows"].values()),
    }
    return Section("map", title, values)


def _group(row: Mapping, group: str) -> Mapping:
    return row[group] if group else row


def _differences(source: Source, measure: str, name: str) -> Table | None:
    """None if no two methods were asked about the same joints."""
    pairs = source.main["differences"]
    if not pairs:
        return None
    rows = [
        [pair_name(key), *(difference(_group(values, group), measure) for group in GROUPS)]
        for key, values in pairs.items()
    ]
    caption = "Paired differences on the same frames [percentage points], with 95 % intervals and p-values"
    return Table(name, caption, ["", *GROUPS.values()], rows)


_PAPERS: Mapping[str, tuple[str, Mapping[str, paper.DetectionAccuracy]]] = {
    "synthetic": ("The paper, table 2, trained on synthetic images", paper.TRAINED_ON_SYNTHETIC),
    "both": ("The paper, table 2, trained on real and synthetic images", paper.TRAINED_ON_BOTH),
}


def detection_section(source: Source) -> Section:
    """Detection accuracy in the image in the form of the paper's table 2."""
    groups = ("occluded", "non_occluded", "")
    headings = ["", *(GROUPS[group] for group in groups)]
    here = [
        [METHODS[name].name, *(measured(_group(source.main["rows"][name], g), "accuracy_2d") for g in groups)]
        for name in source.rows
    ]
    caption = "Here: joints found within 0.1 of the upper body's size [%]"
    papers = []
    for key, (words, figures) in _PAPERS.items():
        rows = [[METHODS[name].name, *(f"{value:.2f}" for value in row)] for name, row in figures.items()]
        papers.append(Table(f"detection-{key}", f"{words} [%]", headings, rows))
    values = {
        "here": Table("detection-here", caption, headings, here),
        "differences": _differences(source, "accuracy_2d", "detection-differences"),
        "papers": papers,
    }
    return Section("detection", "Detection accuracy in the image", values)


def measures_section(source: Source) -> Section:
    """The other measures of every method, by group."""
    names = [name for name in MEASURES if name in _HEADINGS]
    tables = []
    for group, words in GROUPS.items():
        rows = [
            [METHODS[name].name, *(measured(_group(source.main["rows"][name], group), m) for m in names)]
            for name in source.rows
        ]
        n_joints = _group(source.main["rows"][source.rows[0]], group)["n_joints"]
        caption = f"{words[0].upper()}{words[1:]}: {counted(n_joints, 'joint', 'joints')}"
        tables.append(Table(f"measures-{group or 'all'}", caption, ["", *(_HEADINGS[m] for m in names)], rows))
    return Section("measures", "Further measures", {"tables": tables})


def pixels_section(source: Source) -> Section:
    """How pixels are labelled, means over trainings."""
    title = "Labels of pixels"
    keys = ("part_accuracy", "occluder_accuracy", "class_accuracy", "body_recall", "object_recall")
    rows = []
    for name in source.rows:
        by_seed = source.main["rows"][name]["pixels"]
        if all(by_seed):
            rows.append([METHODS[name].name, *(_mean_percent([of[key] for of in by_seed]) for key in keys)])
    if not rows:
        return Section("pixels", title, missing="no method labels pixels")
    headings = ["", "body parts", "objects' classes", "all classes", "person as body", "objects as objects"]
    return Section("pixels", title, {"labels": Table("pixel-labels", "Pixels [%]", headings, rows)})


def _mean_percent(values: list[float | None]) -> str:
    known = [value for value in values if value is not None]
    return number(float(np.mean(known)), 100.0) if len(known) == len(values) else NOTHING
