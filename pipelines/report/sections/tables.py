"""Sections of tables: the paper's two, further measures, labels of pixels."""

from collections.abc import Iterator, Mapping

import numpy as np

from pipelines.metrics import MEASURES
from pipelines.report import paper
from pipelines.report.markup import Section, left_out, paragraph, table
from pipelines.report.methods import METHODS, pair_name
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
    body = (
        table("precision", f"{title} [%], with 95 % intervals", headings, rows())
        + _differences(source, "map_10cm", "precision-differences")
        + paragraph(_seeds_told(source))
    )
    return Section("map", title, body)


def _group(row: Mapping, group: str) -> Mapping:
    return row[group] if group else row


def _differences(source: Source, measure: str, name: str) -> str:
    pairs = source.main["differences"]
    if not pairs:
        return paragraph("No two methods were asked about the same joints: there is nothing to compare.")
    rows = (
        [pair_name(key), *(difference(_group(values, group), measure) for group in GROUPS)]
        for key, values in pairs.items()
    )
    caption = "Paired differences on the same frames [percentage points], with 95 % intervals and p-values"
    return table(name, caption, ["", *GROUPS.values()], rows)


def _seeds_told(source: Source) -> str:
    if any(row["n_seeds"] > 1 for row in source.main["rows"].values()):
        return "Scores are means over trainings with different seeds; sd is the standard deviation between them."
    return "Every method was trained once: how much the scores vary between trainings is not known."


_PAPERS: Mapping[str, tuple[str, Mapping[str, paper.DetectionAccuracy]]] = {
    "synthetic": ("The paper, table 2, trained on synthetic images", paper.TRAINED_ON_SYNTHETIC),
    "both": ("The paper, table 2, trained on real and synthetic images", paper.TRAINED_ON_BOTH),
}


def detection_section(source: Source) -> Section:
    """Detection accuracy in the image in the form of the paper's table 2."""
    groups = ("occluded", "non_occluded", "")
    headings = ["", *(GROUPS[group] for group in groups)]
    here = (
        [METHODS[name].name, *(measured(_group(source.main["rows"][name], g), "accuracy_2d") for g in groups)]
        for name in source.rows
    )
    tables = [
        table("detection-here", "Here: joints found within 0.1 of the upper body's size [%]", headings, here)
    ]
    for key, (caption, figures) in _PAPERS.items():
        rows = ([METHODS[name].name, *(f"{value:.2f}" for value in row)] for name, row in figures.items())
        tables.append(table(f"detection-{key}", f"{caption} [%]", headings, rows))
    note = (
        "The paper's figures are of 800 real images with joints marked by hand; those here are of rendered images "
        "with exact joints. Beside each other they show whether the order of the methods is the same, not more."
    )
    differences = _differences(source, "accuracy_2d", "detection-differences")
    body = tables[0] + differences + "".join(tables[1:]) + paragraph(note)
    return Section("detection", "Detection accuracy in the image", body)


def measures_section(source: Source) -> Section:
    """The other measures of every method, by group."""
    names = [name for name in MEASURES if name in _HEADINGS]
    tables = []
    for group, words in GROUPS.items():
        rows = (
            [METHODS[name].name, *(measured(_group(source.main["rows"][name], group), m) for m in names)]
            for name in source.rows
        )
        n_joints = _group(source.main["rows"][source.rows[0]], group)["n_joints"]
        caption = f"{words[0].upper()}{words[1:]}: {counted(n_joints, 'joint', 'joints')}"
        tables.append(table(f"measures-{group or 'all'}", caption, ["", *(_HEADINGS[m] for m in names)], rows))
    note = (
        "Distances are in three dimensions, to the joint's centre inside the body. A joint that a method does not "
        "answer is a miss; the mean error is of the joints that it did answer."
    )
    return Section("measures", "Further measures", paragraph(note) + "".join(tables))


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
        return left_out("pixels", title, "no method labels pixels")
    headings = ["", "body parts", "objects' classes", "all classes", "person as body", "objects as objects"]
    notes = (
        "The first three columns are means over classes of the share of their pixels that is labelled right; the "
        "last two the share of all pixels of the person, and of the objects, that is taken for one at all. "
        "Without semantics the one class of objects is right for each; a baseline calls every pixel of an object "
        "a body part."
    )
    return Section("pixels", title, table("pixel-labels", "Pixels [%]", headings, rows) + paragraph(notes))


def _mean_percent(values: list[float | None]) -> str:
    known = [value for value in values if value is not None]
    return number(float(np.mean(known)), 100.0) if len(known) == len(values) else NOTHING
