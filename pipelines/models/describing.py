"""What a report tells of each kind of model: figures beside the paper's, and differences from the paper."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from pipelines.models import paper


class Figure(NamedTuple):
    """A figure of the experiment.

    Attributes:
        name: What it is.
        paper: The paper's; None if it does not tell.
        here: This ablation's.
    """

    name: str
    paper: str | None
    here: str


class Description(NamedTuple):
    """What is told of a kind of model.

    Attributes:
        figures: Its settings.
        differences: From the paper, a sentence each.
    """

    figures: tuple[Figure, ...]
    differences: tuple[str, ...]


def regression_forest(config: Mapping[str, Any]) -> Description:
    """What is told of a regression forest with these settings, as JSON values."""
    growth = config["growth"]
    figures = (
        Figure("Trees", str(paper.N_TREES), str(config["n_trees"])),
        Figure("Depth of trees, at most", str(paper.MAX_DEPTH), str(growth["max_depth"])),
        Figure("Pixels of the body a training frame", str(paper.N_PIXELS), str(config["n_pixels"])),
        Figure("Pixels of objects a training frame", None, str(config["n_occluder_pixels"])),
        Figure("Features tried a node", str(paper.N_CANDIDATES), str(growth["n_candidates"])),
        Figure("Bandwidth in leaves [m]", str(paper.BANDWIDTH_M), str(config["leaf_bandwidth_m"])),
        Figure("Pixels that vote a frame", None, str(config["n_voting_pixels"])),
    )
    differences = (
        "Bandwidths and the reach of votes are tuned on the validation frames; the paper took the bandwidths of "
        "the work that it builds on.",
        "A feature that is tried is scored at several thresholds, on some of the pixels where a node has many.",
    )
    return Description(figures, differences)


def random_walk_forest(config: Mapping[str, Any]) -> Description:
    """What is told of a random walk forest with these settings, as JSON values."""
    boxed = ", ".join(name.replace("_", " ") for name in config["box_joints"])
    words = (
        "Random walk forests are given the box around the true places of some joints, as by a perfect "
        f"detector ({boxed}); the regression forests are given nothing but the image."
    )
    return Description((), (words,))
