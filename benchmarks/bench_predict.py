"""Frames a second of prediction on one core, where the time goes, accuracy against the number of voting pixels.

The peer of the descent is scikit-learn's `apply` on as many trees, with features computed beforehand; that of mean
shift is the exact one, from the ten densest votes.

Run: python benchmarks/bench_predict.py --corpus DIR [--model FILE | --training-frames 300] [--frames 60]
"""

import argparse
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from sklearn.ensemble import ExtraTreesClassifier

from forests.calibration import WITHIN_M
from forests.crops import crop_image
from forests.frames import DepthFrame, FrameSubset
from forests.growing import GrowthConfig
from forests.oarf.config import OARFConfig
from forests.oarf.model import OARFModel
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model
from forests.oarf.train import train
from forests.oarf.vote import Votes
from pipelines.corpus import Corpus
from pipelines.corpus.sequence import CorpusFrames

N_PIXELS = (125, 250, 500, 1000, 2000)


def cpu_us(call: Callable[[DepthFrame], object], frames: Sequence[DepthFrame], repeats: int = 5) -> float:
    """Microseconds of CPU a frame, the best of several rounds; the first frame compiles."""
    call(frames[0])
    times = []
    for _ in range(repeats):
        start = time.thread_time()
        for frame in frames:
            call(frame)
        times.append((time.thread_time() - start) * 1e6 / len(frames))
    return min(times)


def trained(corpus: Corpus, n_frames: int) -> OARFModel:
    """A small forest: enough to vote as a large one does."""
    training, validation = (CorpusFrames(corpus, corpus.split(name)) for name in ("train", "val"))
    some = FrameSubset(training, tuple(range(0, len(training), max(1, len(training) // n_frames))))
    few = FrameSubset(validation, tuple(range(0, len(validation), max(1, len(validation) // 60))))
    return train(
        some,
        OARFConfig(learn_skeleton=False, growth=replace(GrowthConfig(), n_candidates=300)),
        validation=few,
        n_threads=2,
    )


def share_within(predictor: Predictor, frames: Iterable[DepthFrame], n_pixels: int) -> float:
    """Share of the joints that are found within 10 cm."""
    errors = [
        np.linalg.norm(
            predictor.predict(frame.depth, frame.camera, n_pixels=n_pixels).joints - frame.joints, axis=1
        )
        for frame in frames
    ]
    return float((np.stack(errors) <= WITHIN_M).mean())


def print_stages(predictor: Predictor, frames: Sequence[DepthFrame]) -> None:
    """Cumulative times of the stages, as they build on each other."""
    crop = cpu_us(lambda frame: crop_image(frame.depth, frame.camera), frames)
    leaves = cpu_us(lambda frame: predictor.reach_leaves(frame.depth, frame.camera), frames)
    votes = cpu_us(lambda frame: predictor.collect_votes(frame.depth, frame.camera), frames)
    everything = cpu_us(lambda frame: predictor.predict(frame.depth, frame.camera), frames)
    print(
        f"us a frame: crop {crop:.0f}, pixels and descent {leaves - crop:.0f}, votes {votes - leaves:.0f}, "
        f"mean shift, surface, probabilities {everything - votes:.0f}, together {everything:.0f}"
    )


def print_descent(predictor: Predictor, frames: Sequence[DepthFrame]) -> None:
    """Ours, probes included, against scikit-learn's apply, whose features are there."""
    nodes = sum(len(tree.nodes) for tree in predictor.model.trees)
    n_pixels, n_trees = predictor.model.config.n_voting_pixels, len(predictor.model.trees)
    rng = np.random.default_rng(0)
    features = rng.random((100_000, 20), np.float32)
    classes = rng.integers(0, 2, len(features))
    peer = ExtraTreesClassifier(n_trees, max_depth=20, min_samples_leaf=2, max_features=1, random_state=0)
    peer.fit(features, classes)
    peer_nodes = sum(tree.tree_.node_count for tree in peer.estimators_)
    theirs = cpu_us(lambda frame: peer.apply(features[:n_pixels]), frames)
    crop = cpu_us(lambda frame: crop_image(frame.depth, frame.camera), frames)
    ours = cpu_us(lambda frame: predictor.reach_leaves(frame.depth, frame.camera), frames) - crop
    print(
        f"descent of {n_pixels} pixels, {n_trees} trees: ours {ours:.0f} us ({nodes} nodes, features included), "
        f"scikit-learn's apply {theirs:.0f} us ({peer_nodes} nodes, features there): {theirs / ours:.1f} times"
    )


def exact_mode(places: np.ndarray, weights: np.ndarray, bandwidth: float) -> np.ndarray:
    """(3,) the densest mode: mean shift over all votes, float64, from ten of the densest votes."""

    def kernels(at: np.ndarray) -> np.ndarray:
        return weights * np.exp(-((at[:, None] - places) ** 2).sum(axis=2) / bandwidth**2)

    x = places[np.argsort(-kernels(places).sum(axis=1))[:10]]
    for _ in range(200):
        kernel = kernels(x)
        x = kernel @ places / kernel.sum(axis=1, keepdims=True)
    return x[kernels(x).sum(axis=1).argmax()]


def votes_of(votes: Votes, joint: int, n_layers: int) -> np.ndarray:
    """(n, 4) float64: all votes of a joint."""
    streams = range(joint * n_layers, (joint + 1) * n_layers)
    return np.concatenate([votes.votes[s, : votes.n_votes[s]] for s in streams]).astype(np.float64)


def print_closeness(predictor: Predictor, frames: Sequence[DepthFrame]) -> None:
    """Distances of the joints to the exact modes, and their accuracy."""
    distance, ours, theirs = [], [], []
    widths = predictor.model.tuning.bandwidth_m
    for frame in frames:
        votes = predictor.collect_votes(frame.depth, frame.camera)
        joints = predictor.predict(frame.depth, frame.camera).joints
        for joint, width in enumerate(widths):
            own = votes_of(votes, joint, predictor.table.n_layers)
            if len(own) == 0:
                continue
            mode = exact_mode(own[:, :3], own[:, 3], float(width))
            distance.append(np.linalg.norm(joints[joint] - mode))
            ours.append(np.linalg.norm(joints[joint] - frame.joints[joint]))
            theirs.append(np.linalg.norm(mode - frame.joints[joint]))
    far, good, peer = np.array(distance), np.array(ours) <= WITHIN_M, np.array(theirs) <= WITHIN_M
    print(
        f"{len(far)} joints against exact mean shift: {(far <= 0.005).mean():.1%} within 5 mm, "
        f"{(far <= 0.05).mean():.1%} within 5 cm; "
        f"{good.mean():.3f} within 10 cm of the truth, of the exact ones {peer.mean():.3f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--model", type=Path)
    parser.add_argument("--training-frames", type=int, default=300)
    parser.add_argument("--frames", type=int, default=60)
    options = parser.parse_args()
    corpus = Corpus.open(options.corpus)
    model = load_model(options.model) if options.model else trained(corpus, options.training_frames)
    test = CorpusFrames(corpus, corpus.split("test"))
    frames = [test[i] for i in range(0, len(test), max(1, len(test) // options.frames))]
    report(model, frames)


def report(model: OARFModel, frames: Sequence[DepthFrame]) -> None:
    """Prints all figures of one forest."""
    predictor = Predictor(replace(model, skeleton=None))
    print(f"{len(model.trees)} trees, {len(predictor.table.start) - 1} leaves, {len(frames)} frames")
    for n in N_PIXELS:
        us = cpu_us(lambda frame, n=n: predictor.predict(frame.depth, frame.camera, n_pixels=n), frames)
        share = share_within(predictor, frames, n)
        print(f"{n:5} pixels: {us:6.0f} us, {1e6 / us:5.0f} frames/s, {share:.3f} of the joints within 10 cm")
    if model.skeleton is not None:
        n, whole = model.config.n_voting_pixels, Predictor(model)
        us = cpu_us(lambda frame: whole.predict(frame.depth, frame.camera), frames)
        share = share_within(whole, frames, n)
        print(f"whole skeletons, {n} pixels: {us:6.0f} us, {1e6 / us:5.0f} frames/s, {share:.3f} within 10 cm")
    print_stages(predictor, frames)
    print_descent(predictor, frames)
    print_closeness(predictor, frames[:12])


if __name__ == "__main__":
    main()
