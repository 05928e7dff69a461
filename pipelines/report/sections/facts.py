"""Sections of what stands behind the numbers: how it was measured, configuration, versions, digests, seeds."""

import json
from collections.abc import Iterator, Mapping

import numpy as np

from pipelines.report import paper
from pipelines.report.markup import Section, items, paragraph, table
from pipelines.report.methods import METHODS, pair_name
from pipelines.report.source import Source
from pipelines.report.text import NOTHING, counted, difference, escape
from synth.vocabulary import JointState


def lead(source: Source) -> str:
    """What was asked, of what, and the main difference, in a few plain sentences."""
    truths = source.truths
    n_hidden = int((truths.state == JointState.OCCLUDED).sum())
    sentences = [
        "Does it help a forest that looks for a person's joints in a depth image to know that something hides the "
        "person, and what it is? After Rafi, Gall and Leibe, A Semantic Occlusion Model for Human Pose Estimation "
        "from a Single Depth Image (2015), on rendered frames.",
        f"{counted(len(truths), 'test frame', 'test frames')}, {counted(truths.state.size, 'joint', 'joints')}, "
        f"of which an object hides {n_hidden:,}.",
    ]
    for key in ("semantic - occluders", "semantic - baseline"):
        values = source.main["differences"].get(key)
        if values:
            sentences.append(
                f"Mean average precision at 10 cm, {pair_name(key)}, in percentage points: all joints "
                f"{difference(values, 'map_10cm')}; occluded joints {difference(values['occluded'], 'map_10cm')}."
            )
    return "".join(map(paragraph, sentences))


def protocol_section(source: Source) -> Section:
    """What an interval is, and what differs from the paper."""
    n = len(source.truths)
    what = [
        f"Brackets are 95 % intervals of a bootstrap over the {n:,} test frames ({source.n_resamples:,} "
        "resamples, bias-corrected percentiles). They speak of other frames of the same subjects and of the same "
        "trained forests; not of other subjects, and not of other trainings.",
        "p-values are of a sign-flip test: how often a difference as large comes up when each frame's answers are "
        "given to either method by the toss of a coin. Nothing is corrected for testing many things.",
        "A joint that an object hides has a truth like any other and counts like any other.",
        "Test frames share no subject, object or pose with the frames that were learned from and tuned on.",
    ]
    differs = [
        "Bodies, poses and objects are generated; the paper retargeted motion capture to six meshes and used "
        "published models of tables and laptops.",
        "Objects are of the classes in the table below; some frames show several or none.",
        "The paper does not spell out its average precision; here all joints of all frames count, hidden ones "
        "and those outside the image too, and no precision is interpolated.",
        "Bandwidths and the reach of votes are tuned on the validation frames; the paper took the bandwidths of "
        "the work that it builds on.",
        "A feature that is tried is scored at several thresholds, on some of the pixels where a node has many.",
        "The paper also tested on real images, with joints marked in two dimensions by hand; here every image is "
        "rendered.",
    ]
    if any(name.startswith("rwf") for name in source.rows):
        boxed = ", ".join(name.replace("_", " ") for name in source.document["settings"]["rwf"]["box_joints"])
        differs.append(
            "Random walk forests are given the box around the true places of some joints, as by a perfect "
            f"detector ({boxed}); the regression forests are given nothing but the image."
        )
    body = (
        items(what)
        + "<h3>Where this differs from the paper</h3>"
        + items(differs)
        + table("figures", "Figures of the experiment", ["", "paper", "here"], _figures(source))
    )
    return Section("protocol", "How it was measured", body)


def _figures(source: Source) -> Iterator[list[str]]:
    settings = source.document["settings"]
    oarf, corpus = settings["oarf"], settings["corpus"]
    growth = oarf["growth"]
    subjects = NOTHING
    if source.corpus is not None:
        subjects = str(len({source.corpus.info(int(i)).subject_id for i in source.truths.frame}))
    seen = int(np.bitwise_or.reduce(source.truths.object_classes.astype(np.int64)))
    classes = [name for code, name in enumerate(source.truths.occluders) if code and seen >> code & 1]
    yield ["Training frames", str(paper.N_TRAIN), str(corpus["train_frames"])]
    yield ["Test frames", str(paper.N_TEST), str(len(source.truths))]
    yield ["Test subjects", str(paper.N_TEST_SUBJECTS), subjects]
    yield ["Classes of objects in test", "table, laptop", ", ".join(classes) or "none"]
    yield ["Trees", str(paper.N_TREES), str(oarf["n_trees"])]
    yield ["Depth of trees, at most", str(paper.MAX_DEPTH), str(growth["max_depth"])]
    yield ["Pixels of the body a training frame", str(paper.N_PIXELS), str(oarf["n_pixels"])]
    yield ["Pixels of objects a training frame", NOTHING, str(oarf["n_occluder_pixels"])]
    yield ["Features tried a node", str(paper.N_CANDIDATES), str(growth["n_candidates"])]
    yield ["Bandwidth in leaves [m]", str(paper.BANDWIDTH_M), str(oarf["leaf_bandwidth_m"])]
    yield ["Pixels that vote a frame", NOTHING, str(oarf["n_voting_pixels"])]
    yield ["Sensor", "clean", settings["sensor"] or "clean"]


def configuration_section(source: Source) -> Section:
    """Settings, versions, digests and seeds, so that the page can be made again."""
    document = source.document
    settings = "\n".join(f"{name} = {json.dumps(value)}" for name, value in _leaves(document["settings"]))
    versions = {**document["software"], **{f"sources of {k}": v for k, v in document["sources"].items()}}
    corpora = (
        [
            item["folder"],
            "yes" if item["is_context_kept"] else "no",
            *(item.get("imported", {}).get(name) or NOTHING for name in ("poses", "objects")),
            *map(str, item["n_frames"].values()),
            item["digest"],
        ]
        for item in document["corpora"]
    )
    trainings = (
        [
            METHODS[name].name,
            str(item["seed"]),
            str(item["n_train_frames"]),
            item["model"]["digest"],
            item["rows"]["key"],
        ]
        for name in source.rows
        for item in source.main["rows"][name]["trainings"]
    )
    body = (
        table("versions", "Versions, and digests of the sources", ["", "version or digest"], versions.items())
        + table(
            "corpora",
            "Corpora, frames by split",
            [
                "",
                "relation of object and pose kept",
                "pose library",
                "object library",
                "train",
                "val",
                "test",
                "digest",
            ],
            corpora,
        )
        + table(
            "trainings", "Trainings", ["", "seed", "frames", "digest of the model", "key of the rows"], trainings
        )
        + f"<h3>Settings</h3><pre>{escape(settings)}</pre>"
    )
    return Section("configuration", "Configuration", body)


def _leaves(values: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Settings by their full names."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value
