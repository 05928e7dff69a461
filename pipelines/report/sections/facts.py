"""Sections of what stands behind the numbers: how it was measured, configuration, versions, digests, seeds."""

import json
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from markupsafe import Markup

from pipelines.models import paper
from pipelines.models.describing import Figure
from pipelines.models.kinds import KINDS
from pipelines.report.methods import HEADLINES, METHODS, kinds_of, pair_name
from pipelines.report.page import Section, Table, rendered
from pipelines.report.source import Source
from pipelines.report.text import NOTHING, counted, difference
from synth.vocabulary import JointState

_CORPUS_HEADINGS = (
    "", "relation of object and pose kept", "pose library", "object library", "train", "val", "test", "digest",
)  # fmt: skip
_TRAINING_HEADINGS = ("", "seed", "frames", "digest of the model", "key of the rows")


def lead(source: Source) -> Markup:
    """What was asked, of what, and the main difference, in a few plain sentences."""
    truths = source.truths
    differences = source.main["differences"]
    gains = [
        {
            "pair": pair_name(key),
            "all": difference(differences[key], "map_10cm"),
            "occluded": difference(differences[key]["occluded"], "map_10cm"),
        }
        for key in HEADLINES
        if key in differences
    ]
    return rendered(
        "lead",
        frames=counted(len(truths), "test frame", "test frames"),
        joints=counted(truths.state.size, "joint", "joints"),
        n_hidden=int((truths.state == JointState.OCCLUDED).sum()),
        gains=gains,
    )


def protocol_section(source: Source) -> Section:
    """What an interval is, and what differs from the paper."""
    settings = source.document["settings"]
    described = [KINDS[kind].describe(settings[kind]) for kind in kinds_of(source.rows)]
    figures = [*_data_figures(source), *(figure for told in described for figure in told.figures)]
    figures.append(Figure("Sensor", "clean", settings["sensor"] or "clean"))
    rows = [(figure.name, NOTHING if figure.paper is None else figure.paper, figure.here) for figure in figures]
    values = {
        "n_frames": len(source.truths),
        "n_resamples": source.n_resamples,
        "differences": [words for told in described for words in told.differences],
        "figures": Table("figures", "Figures of the experiment", ["", "paper", "here"], rows),
    }
    return Section("protocol", "How it was measured", values)


def _data_figures(source: Source) -> Iterator[Figure]:
    truths = source.truths
    subjects = NOTHING
    if source.corpus is not None:
        subjects = str(len({source.corpus.info(int(i)).subject_id for i in truths.frame}))
    seen = int(np.bitwise_or.reduce(truths.object_classes.astype(np.int64)))
    classes = [name for code, name in enumerate(truths.occluders) if code and seen >> code & 1]
    n_train = source.document["settings"]["corpus"]["train_frames"]
    yield Figure("Training frames", str(paper.N_TRAIN), str(n_train))
    yield Figure("Test frames", str(paper.N_TEST), str(len(truths)))
    yield Figure("Test subjects", str(paper.N_TEST_SUBJECTS), subjects)
    yield Figure("Classes of objects in test", "table, laptop", ", ".join(classes) or "none")


def configuration_section(source: Source) -> Section:
    """Settings, versions, digests and seeds, so that the page can be made again."""
    document = source.document
    versions = {**document["software"], **{f"sources of {k}": v for k, v in document["sources"].items()}}
    caption = "Versions, and digests of the sources"
    values = {
        "versions": Table("versions", caption, ["", "version or digest"], list(versions.items())),
        "corpora": Table("corpora", "Corpora, frames by split", _CORPUS_HEADINGS, list(_corpora(source))),
        "trainings": Table("trainings", "Trainings", _TRAINING_HEADINGS, list(_trainings(source))),
        "settings": [(name, json.dumps(value)) for name, value in _leaves(document["settings"])],
    }
    return Section("configuration", "Configuration", values)


def _corpora(source: Source) -> Iterator[Sequence[str]]:
    for item in source.document["corpora"]:
        imported = item.get("imported", {})
        libraries = (imported.get(name) or NOTHING for name in ("poses", "objects"))
        is_kept = "yes" if item["is_context_kept"] else "no"
        yield [item["folder"], is_kept, *libraries, *map(str, item["n_frames"].values()), item["digest"]]


def _trainings(source: Source) -> Iterator[Sequence[str]]:
    for name in source.rows:
        for item in source.main["rows"][name]["trainings"]:
            seed, n_frames = str(item["seed"]), str(item["n_train_frames"])
            yield [METHODS[name].name, seed, n_frames, item["model"]["digest"], item["rows"]["key"]]


def _leaves(values: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Settings by their full names."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value
