"""What the finder has learned: boosted trees over the probes, a template, and their file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.finder.probes import (
    FAR_M,
    FINE,
    N_FEATURES,
    PROBES,
    View,
    across,
    features_at,
    height_of,
    probe,
    top_at,
)  # fmt: skip
from forests.modelfile import naming_file, read_model, take_array, write_model

KIND = "people-finder"
DEPTH = 3
"""Levels of a tree: 7 questions, 8 answers."""
N_QUESTIONS, N_ANSWERS = 2**DEPTH - 1, 2**DEPTH
SHIPPED = Path(__file__).with_name("people.safetensors")
"""The model that comes with the package; `tools/learn_finder.py` makes it."""


class Trees(NamedTuple):
    """Boosted trees; the sum of their answers is the logarithm of the odds that a place is the top of a person.

    Node i asks whether a feature is at most a threshold; if so 2i+1 is next, else 2i+2.

    Attributes:
        feature: (n_trees, 7) int16.
        threshold: (n_trees, 7) float32 [m].
        answer: (n_trees, 8) float32.
        floor_of: (n_trees,) float32: a place whose sum after a tree is lower is given up.
    """

    feature: NDArray[np.int16]
    threshold: NDArray[np.float32]
    answer: NDArray[np.float32]
    floor_of: NDArray[np.float32]


@dataclass(frozen=True)
class FinderModel:
    """Everything that was learned.

    Attributes:
        trees: Boosted trees.
        template: (16, 16) float32, the mean of the fine grid over tops of people [m].
        score: Sum above which a place is a person.
        facts: What it was learned from, JSON values.
    """

    trees: Trees
    template: NDArray[np.float32]
    score: float
    facts: dict[str, Any]


def write_finder(path: Path, model: FinderModel) -> None:
    """Writes a finder's file: beside and renamed, with a digest."""
    arrays = {**model.trees._asdict(), "template": model.template, "probes": PROBES}
    write_model(path, KIND, arrays, {"score": model.score, "facts": model.facts})


def read_finder(path: Path = SHIPPED) -> FinderModel:
    """Reads a finder's file; the shipped one if none is given.

    Raises:
        ModelFileError: No such file, damaged, or of another kind or other probes.
    """
    contents = read_model(path, KIND)
    with naming_file(path):
        arrays = contents.arrays
        n = len(take_array(arrays, "feature", np.int16, (None, N_QUESTIONS)))
        trees = Trees(
            arrays["feature"],
            take_array(arrays, "threshold", np.float32, (n, N_QUESTIONS)),
            take_array(arrays, "answer", np.float32, (n, N_ANSWERS)),
            take_array(arrays, "floor_of", np.float32, (n,)),
        )
        if n == 0 or trees.feature.min() < 0 or trees.feature.max() >= N_FEATURES:
            raise ValueError(f"there must be trees, and they must ask for features 0..{N_FEATURES - 1}")
        if not np.array_equal(take_array(arrays, "probes", np.float32, PROBES.shape), PROBES):
            raise ValueError("it was learned with other probes than this program's")
        template = take_array(arrays, "template", np.float32, (FINE, FINE))
        return FinderModel(trees, template, float(contents.metadata["score"]), dict(contents.metadata["facts"]))


def tree_scores(view: View, tops: NDArray[np.int32], trees: Trees) -> NDArray[np.float32]:
    """Scores of places by the trees.

    Args:
        view: The image.
        tops: (n, 3) int32, as `contour` gives them.
        trees: The trees.

    Returns:
        (n,) float32 logarithm of the odds; -inf where a place was given up.
    """
    return np.asarray(_tree_scores(view, np.ascontiguousarray(tops), trees, PROBES))


def template_scores(view: View, tops: NDArray[np.int32], template: NDArray[np.float32]) -> NDArray[np.float32]:
    """Scores of places by the template: minus the root mean square distance of the fine grid to it.

    Args:
        view: The image.
        tops: (n, 3) int32.
        template: (16, 16) float32 [m].

    Returns:
        (n,) float32 [m].
    """
    return np.asarray(_template_scores(features_at(view, tops), template.reshape(-1)))


@njit(cache=True, nogil=True)
def _tree_scores(view, tops, trees, probes):  # type: ignore[no-untyped-def]
    out = np.empty(len(tops), np.float32)
    depth, fx, fy, cx, cy = view.depth, view.fx, view.fy, view.cx, view.cy
    feature, threshold, answer, least = trees.feature, trees.threshold, trees.answer, trees.floor_of
    n_probes, (ux, uy, uz) = len(probes), (view.up[0], view.up[1], view.up[2])
    for i in range(len(tops)):
        top = top_at(view, tops[i, 0], tops[i, 1], tops[i, 2])
        (rx, ry, rz), height = across(view, top), height_of(view, top)
        px, py, pz, distance = top.x, top.y, top.z, top.distance
        total = np.float32(0.0)
        for t in range(len(feature)):
            node = 0
            while node < N_QUESTIONS:
                k = feature[t, node]
                if k < n_probes:
                    a, b = probes[k, 0], probes[k, 1]
                    x, y, z = px + a * rx + b * ux, py + a * ry + b * uy, pz + a * rz + b * uz
                    value = np.float32(probe(depth, fx, fy, cx, cy, x, y, z, distance))
                else:
                    value = np.float32(height if k == n_probes else distance)
                node = 2 * node + (1 if value <= threshold[t, node] else 2)
            total += answer[t, node - N_QUESTIONS]
            if total < least[t]:
                total = np.float32(-np.inf)
                break
        out[i] = total
    return out


@njit(cache=True, nogil=True)
def _template_scores(features, template):  # type: ignore[no-untyped-def]
    out = np.empty(len(features), np.float32)
    for i in range(len(features)):
        total = 0.0
        for k in range(len(template)):
            off = min(FAR_M, features[i, k]) - template[k]
            total += off * off
        out[i] = -np.sqrt(total / len(template))
    return out
