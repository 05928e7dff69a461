"""Learns what the finder of people knows, from the training split of a corpus of rooms; writes its model file.

Needs scikit-learn. Trees are grown three times; from the second time on the negatives are those that the trees before
take for people. Frames of val tell from which score on a place is a person. Nothing is kept on the way: a run that is
stopped starts anew.

    undergrowth generate out/rooms --config examples/rooms.toml --seed 77 --frames 2000
    python tools/learn_finder.py out/rooms [--frames 1350] [--trees 280] [--out forests/finder/people.safetensors]
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingClassifier

from forests.finder.find import INSIDE_M, PeopleFinder
from forests.finder.model import (
    DEPTH,
    N_ANSWERS,
    N_QUESTIONS,
    FinderModel,
    Trees,
    template_scores,
    tree_scores,
    write_finder,
)
from forests.finder.probes import FINE, contour, features_at, view_of
from pipelines.corpus import Corpus
from pipelines.corpus.rooms.matching import floor_of, judge_axes, level_distances, recall_at, truths_of
from pipelines.progress import progress
from synth.frame import RoomFrame

INNER_M, SIDE_M, BAND_M = 0.3, 0.1, 0.1
"""Places this near a person's trunk line are the person's; tops this far from the head to the side, or this far below
the highest place where the head is hidden, are examples of people [m]."""
PER_FRAME = 90
WITHOUT_FLOOR = 5
"""Every so many frames are shown without a floor."""
FALSE_PER_FRAME = 0.1
MARGIN = 0.1
"""Between the lowest sum of an example of a person on the way and the bound for giving up."""
LOWEST = -4.0
"""Of scores that are looked at when the bound is set."""


def labels_of(frame: RoomFrame, tops: NDArray[np.int32]) -> tuple[NDArray[np.int8], NDArray[np.uint8]]:
    """(n,) 1 = top of a person, 0 = not, -1 = neither, and whose it is, of places in a frame."""
    camera, T, truths = frame.camera, frame.T_world_camera, truths_of(frame)
    z = tops[:, 2] * 1e-3
    points = np.stack(
        [(tops[:, 0] - camera.cx) / camera.fx * z, (tops[:, 1] - camera.cy) / camera.fy * z, z], axis=1
    )
    world = points @ T[:3, :3].T + T[:3, 3]
    ahead = world[:, :2] - T[:2, 3]
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    distances = level_distances(truths.trunk, world[:, :2] + INSIDE_M * ahead)
    below = np.minimum(frame.depth.shape[0] - 1, tops[:, 1] + (camera.fy * 0.04 / np.maximum(z, 0.1)).astype(int))
    person = np.maximum(frame.person[below, tops[:, 0]], frame.person[tops[:, 1], tops[:, 0]])
    out = np.zeros(len(tops), np.int8)
    for k in range(len(frame.people)):
        is_near, is_own = distances[:, k] < INNER_M, person == k + 1
        out[is_near] = -1
        if truths.visible[k] < 0.2:
            out[is_own] = -1
            continue
        head, neck = truths.trunk[k, 0], truths.trunk[k, 1]
        side = np.abs((world[:, 0] - head[0]) * ahead[:, 1] - (world[:, 1] - head[1]) * ahead[:, 0])
        is_head = is_near & is_own & (world[:, 2] > neck[2] + 0.02) & (side < SIDE_M)
        if not is_head.any() and (is_near & is_own).any():
            inner = is_near & is_own
            is_head = inner & (world[:, 2] > world[inner, 2].max() - BAND_M)
        out[is_head] = 1
    return out, person


class Shown:
    """Frames as a sensor shows them, kept in memory."""

    def __init__(self, corpus: Corpus, split: str, first: int, last: int) -> None:
        self.truths, self.poses, self.views, self.tops, self.labels, self.people = [], [], [], [], [], []
        sensors = ("random", "kinect_v2", "kinect_v1", "ideal")
        numbers = corpus.split(split)[first:last]
        for number, index in enumerate(progress(numbers, "frame", f"read {split}")):
            clean = corpus.scene(int(index))
            depth = corpus.arrays("depth", [index], sensors[number % len(sensors)])[0]
            is_floored = number % WITHOUT_FLOOR != 0
            view = view_of(depth, clean.camera, floor_of(clean) if is_floored else None)
            tops = contour(view)
            self.truths.append(truths_of(clean))
            self.poses.append(clean.T_world_camera)
            self.views.append(view)
            self.tops.append(tops)
            labels, people = labels_of(clean, tops)
            self.labels.append(labels)
            self.people.append(people)


def examples(shown: Shown, trees: Trees | None, seed: int) -> tuple[NDArray[np.float32], NDArray[np.int8]]:
    """Features and labels of all positives and of so many negatives a frame, the worst ones if there are trees."""
    rng = np.random.default_rng(seed)
    rows, answers = [], []
    places = list(zip(shown.views, shown.tops, shown.labels, strict=True))
    for view, tops, labels in progress(places, "frame", "examples"):
        good, bad = np.flatnonzero(labels == 1), np.flatnonzero(labels == 0)
        chosen = rng.permutation(bad)[: PER_FRAME if trees is None else PER_FRAME // 3]
        if trees is not None and len(bad):
            scores = tree_scores(view, tops[bad], trees)
            worst = bad[np.argsort(-scores, kind="stable")[:PER_FRAME]]
            chosen = np.unique(np.concatenate([chosen, worst]))
        picked = np.concatenate([rng.permutation(good)[:PER_FRAME], chosen])
        rows.append(features_at(view, tops[picked]))
        answers.append(labels[picked])
    return np.concatenate(rows), np.concatenate(answers)


def booster_of(n_trees: int, seed: int) -> HistGradientBoostingClassifier:
    """What grows the trees."""
    return HistGradientBoostingClassifier(
        max_iter=n_trees, max_depth=DEPTH, max_leaf_nodes=N_ANSWERS, learning_rate=0.12, min_samples_leaf=30,
        l2_regularization=1.0, max_features=0.3, early_stopping=False, random_state=seed,
    )  # fmt: skip


def grown(x: NDArray[np.float32], y: NDArray[np.int8], n_trees: int, seed: int) -> Trees:
    """Boosted trees of DEPTH levels."""
    booster = booster_of(n_trees, seed).fit(x, y)
    feature = np.zeros((n_trees, N_QUESTIONS), np.int16)
    threshold = np.zeros((n_trees, N_QUESTIONS), np.float32)
    answer = np.zeros((n_trees, N_ANSWERS), np.float32)
    for t, (predictor,) in enumerate(booster._predictors):
        _fill(predictor.nodes, 0, 0, feature[t], threshold[t], answer[t])
    answer[0] += float(np.ravel(booster._baseline_prediction)[0])
    return Trees(feature, threshold, answer, np.full(n_trees, -np.inf, np.float32))


def _fill(nodes, node, place, feature, threshold, answer) -> None:  # type: ignore[no-untyped-def]
    """A tree of scikit-learn as a full tree; a leaf higher up is repeated below."""
    item = nodes[node]
    if place >= N_QUESTIONS:
        answer[place - N_QUESTIONS] = item["value"]
        return
    is_leaf = bool(item["is_leaf"])
    if not is_leaf:
        feature[place], threshold[place] = item["feature_idx"], item["num_threshold"]
    left, right = (node, node) if is_leaf else (int(item["left"]), int(item["right"]))
    _fill(nodes, left, 2 * place + 1, feature, threshold, answer)
    _fill(nodes, right, 2 * place + 2, feature, threshold, answer)


def with_early_ends(trees: Trees, x: NDArray[np.float32], y: NDArray[np.int8]) -> Trees:
    """The trees with bounds under which a place is given up: no example of a person that ends above 0 is lost."""
    node = np.zeros((len(x), len(trees.feature)), np.int64)
    tree = np.arange(len(trees.feature))
    for _ in range(DEPTH):
        value = x[np.arange(len(x))[:, None], trees.feature[tree, node]]
        node = 2 * node + np.where(value <= trees.threshold[tree, node], 1, 2)
    sums = np.cumsum(trees.answer[tree, node - N_QUESTIONS], axis=1)
    good = sums[y == 1]
    # The margin is for people who are not among the examples.
    bound = good[good[:, -1] > 0].min(axis=0) - MARGIN
    bound[:4] = -np.inf
    return trees._replace(floor_of=bound.astype(np.float32))


def scored(shown: Shown, model: FinderModel, by_template: bool) -> tuple[float, float]:
    """Recall at the allowed number of false places, and the score that it takes."""
    finder = PeopleFinder(model)
    verdicts, scores = [], []
    for truths, T, view, tops in zip(shown.truths, shown.poses, shown.views, shown.tops, strict=True):
        score = (
            template_scores(view, tops, model.template) if by_template else tree_scores(view, tops, model.trees)
        )
        people = finder.best(view, tops, score, None, LOWEST)
        verdicts.append(judge_axes(truths, [one.axis for one in people], T))
        scores.append(np.array([one.score for one in people]))
    return recall_at(verdicts, scores, FALSE_PER_FRAME)


def reached(shown: Shown) -> float:
    """Share of the wanted people who have a place that is learned as theirs: no finder of these places does better."""
    n_reached = n_wanted = 0
    for truths, labels, people in zip(shown.truths, shown.labels, shown.people, strict=True):
        n_wanted += int(truths.is_wanted.sum())
        n_reached += len(set(people[labels == 1].tolist()) & set((np.flatnonzero(truths.is_wanted) + 1).tolist()))
    return n_reached / max(1, n_wanted)


def learn(options: argparse.Namespace) -> None:
    """Grows trees, sets where they end early and from which score on a place is a person, and writes them."""
    corpus = Corpus.open(options.corpus)
    shown = Shown(corpus, "train", 0, options.frames)
    checked = Shown(corpus, "val", 0, options.check)
    print(f"{len(shown.views)} frames, {np.mean([len(t) for t in shown.tops]):.0f} places a frame; ", end="")
    print(f"{reached(shown):.3f} of the wanted people have a place", flush=True)
    trees = None
    for turn in range(options.turns):
        x, y = examples(shown, trees, options.seed + turn)
        n_trees = options.trees if turn == options.turns - 1 else options.trees // 2
        print(f"turn {turn}: {n_trees} trees of {len(y)} examples, {(y == 1).mean():.3f} of people", flush=True)
        trees = grown(x, y, n_trees, options.seed)
    assert trees is not None
    trees = with_early_ends(trees, x, y)
    template = np.minimum(x[y == 1, : FINE * FINE], 1.0).mean(axis=0).reshape(FINE, FINE)
    facts = {"seed": corpus.header.seed, "frames": len(shown.views), "checked": len(checked.views)}
    model = FinderModel(trees, template.astype(np.float32), 0.0, {**facts, "false_per_frame": FALSE_PER_FRAME})
    by_template, _ = scored(checked, model, True)
    by_trees, bound = scored(checked, model, False)
    print(f"{len(checked.views)} frames of val, recall at {FALSE_PER_FRAME} false places a frame: ", end="")
    print(f"template {by_template:.3f}, trees {by_trees:.3f} from score {bound:.2f}")
    facts = {**model.facts, "recall": round(by_trees, 4)}
    write_finder(options.out, replace(model, score=float(bound), facts=facts))
    print(f"wrote {options.out}")


def main() -> None:
    """Learns and writes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--frames", type=int, default=1350)
    parser.add_argument("--trees", type=int, default=280)
    parser.add_argument("--check", type=int, default=200)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("forests/finder/people.safetensors"))
    options = parser.parse_args()
    learn(options)


if __name__ == "__main__":
    main()
