"""Growing trees: feature evaluations and seconds a tree, against scikit-learn's forests in the same run.

python benchmarks/bench_growing.py [--corpus DIR] [--frames 1110] [--random-forest 20000] [--extra-trees 40000]
    [--min-leaf 20] [--trees 2] [--threads 2]
"""

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from numba import njit
from sklearn.ensemble import ExtraTreesClassifier, RandomForestClassifier

sys.path[:0] = [str(Path(__file__).parents[1])]

from forests.features import difference, draw_feature, feature_values, pixels_per_metre, probe  # noqa: E402
from forests.growing import GrowthConfig, grow_class_tree  # noqa: E402
from forests.growing.buffers import Target, empty_buffers, first, gather_node  # noqa: E402
from forests.oarf.classes import ClassTable  # noqa: E402
from forests.samples import Samples, gather  # noqa: E402
from pipelines.commands.generate import GenerateSettings  # noqa: E402
from pipelines.corpus import Corpus  # noqa: E402
from pipelines.corpus.sequence import LABELS, CorpusFrames  # noqa: E402

SEED = 0
SHORTER_RACE = {"n_racing_samples": 64, "n_finalists": 20}
"""All candidates in every large node still, judged on fewer samples: faster, a little less accurate."""
MAX_OFFSET = GrowthConfig().max_offset_m


@njit(cache=True, nogil=True)
def evaluate(pixels, node, n_candidates, column_major):
    """All candidates of the root, as columns."""
    m = len(node.x)
    places, values, feature = np.empty(m, np.int32), np.empty(m, np.int32), np.empty(4, np.float32)
    x, y, fx_z, fy_z, right, bottom = node.x, node.y, node.fx_z, node.fy_z, node.right, node.bottom
    width, start, z_mm = node.width, node.start, node.z_mm
    for candidate in range(n_candidates):
        draw_feature(SEED, 0, 1, candidate, MAX_OFFSET, feature)
        feature_values(pixels, x, y, fx_z, fy_z, right, bottom, width, start, z_mm, feature, places, values)
        if candidate < len(column_major):
            column_major[candidate] = values


@njit(cache=True, nogil=True)
def descend(crops, samples, nodes):
    """Leaf of every sample."""
    leaves = np.empty(len(samples.frame), np.int32)
    half = np.float32(0.5)
    for s in range(len(leaves)):
        f, z = samples.frame[s], samples.z_mm[s]
        x, y = np.float32(samples.x[s]) + half, np.float32(samples.y[s]) + half
        scale_x = pixels_per_metre(crops.intrinsics[f, 0], z)
        scale_y = pixels_per_metre(crops.intrinsics[f, 1], z)
        start, width, height = crops.start[f], crops.width[f], crops.height[f]
        number = 0
        while nodes[number].leaf < 0:
            u, v = nodes[number].u, nodes[number].v
            a = probe(crops.pixels, start, width, height, x, y, scale_x, scale_y, u[0], u[1])
            b = probe(crops.pixels, start, width, height, x, y, scale_x, scale_y, v[0], v[1])
            number = nodes[number].left + (difference(a, b) > nodes[number].threshold)
        leaves[s] = nodes[number].leaf
    return leaves


class Data:
    """Crops, samples and classes of one split."""

    def __init__(self, corpus, split, n_frames, n_pixels):
        frames = CorpusFrames(corpus, corpus.split(split)[:n_frames])
        training = gather(frames, "composite", n_pixels, n_pixels, SEED)
        classes = ClassTable.of(LABELS, "semantic")
        self.crops, self.samples = training.crops, training.samples
        self.n_classes = classes.n_classes
        self.classes = classes.of_label(LABELS)[self.samples.label]

    def select(self, chosen):
        """The same images with some of the samples."""
        data = object.__new__(Data)
        data.crops, data.n_classes, data.classes = self.crops, self.n_classes, self.classes[chosen]
        data.samples = Samples(*(column[chosen] for column in self.samples))
        return data

    def some(self, n):
        """Evenly drawn samples, in order."""
        return self.select(np.sort(np.random.default_rng(SEED).permutation(len(self.classes))[:n]))

    def buffers(self):
        """All samples as a node."""
        n = len(self.classes)
        buffers = empty_buffers(n, 0)
        target = Target(self.classes, self.n_classes, np.empty((0, 3), np.int16))
        columns = np.zeros(256, np.int32)
        gather_node(
            self.crops, self.samples, target, np.arange(n, dtype=np.int32), n, SEED, 0, 1, columns, buffers
        )
        return first(buffers, n)

    def matrix(self, n_candidates):
        """(n, n_candidates) float32, all candidates as columns."""
        columns = np.empty((n_candidates, len(self.classes)), np.int16)
        evaluate(self.crops.pixels, self.buffers(), n_candidates, columns)
        return np.ascontiguousarray(columns.T, np.float32)


def grow_forest(data, config, n_trees, n_threads):
    """Trees and class shares of their leaves."""
    forest = []
    for tree in range(n_trees):
        grown = grow_class_tree(
            data.crops, data.samples, data.classes, data.n_classes, config, SEED, tree, n_threads
        )
        leaf = np.repeat(np.arange(len(grown.leaf_start) - 1), np.diff(grown.leaf_start))
        counts = np.zeros((len(grown.leaf_start) - 1, data.n_classes))
        np.add.at(counts, (leaf, data.classes[grown.order]), 1.0)
        forest.append((grown.nodes, counts / counts.sum(axis=1, keepdims=True)))
    return forest


def accuracy(forest, data):
    """Share of pixels whose class is found."""
    shares = sum(share[descend(data.crops, data.samples, nodes)] for nodes, share in forest)
    return (shares.argmax(axis=1) == data.classes).mean()


def timed(work):
    begin, begin_cpu = time.perf_counter(), time.process_time()
    out = work()
    return out, time.perf_counter() - begin, time.process_time() - begin_cpu


def evaluations(train):
    """Millions of feature evaluations a second on one core, of a node's samples in image order."""
    node = train.select(np.arange(min(5000, len(train.classes)))).buffers()
    nothing = np.empty((0, 0), np.int16)
    evaluate(train.crops.pixels, node, 2, nothing)
    rates = []
    for _ in range(5):
        begin = time.thread_time()
        evaluate(train.crops.pixels, node, 200, nothing)
        rates.append(200 * len(node.x) / (time.thread_time() - begin) / 1e6)
    print(f"feature evaluations, one core          {max(rates):8.0f} M/s")


def against(name, peer, train, test, n, n_candidates, n_trees, min_leaf, n_threads):
    """Our trees and scikit-learn's on the same samples."""
    part = train.some(n)
    matrix, test_matrix = part.matrix(n_candidates), test.matrix(n_candidates)
    peer.set_params(n_estimators=n_trees, min_samples_leaf=min_leaf, n_jobs=n_threads, random_state=SEED)
    _, their_s, their_cpu = timed(lambda: peer.fit(matrix, part.classes))
    theirs = (peer.predict(test_matrix) == test.classes).mean()
    print(f"{name}: {n} samples x {n_candidates} features, {n_trees} trees, leaves of {min_leaf}")
    print(f"  scikit-learn          {their_s:8.2f} s ({their_cpu:.2f} CPU)  accuracy {theirs:.4f}")
    usual = GrowthConfig(n_candidates=n_candidates, min_samples_leaf=min_leaf)
    for title, config in (("ours, the defaults", usual), ("ours, a shorter race", replace(usual, **SHORTER_RACE))):
        forest, our_s, our_cpu = timed(lambda config=config: grow_forest(part, config, n_trees, n_threads))
        ours = accuracy(forest, test)
        print(f"  {title:<21} {our_s:8.2f} s ({our_cpu:.2f} CPU)  accuracy {ours:.4f}"
              f"  ratio {their_s / our_s:.1f} (CPU {their_cpu / our_cpu:.1f})")  # fmt: skip


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--corpus", help="a corpus that is there, instead of one made for the occasion")
    parser.add_argument("--frames", type=int, default=1110, help="training frames")
    parser.add_argument("--make", type=int, default=400, help="frames of the corpus made")
    parser.add_argument("--random-forest", type=int, default=20_000, help="samples, 0 = leave out")
    parser.add_argument("--extra-trees", type=int, default=40_000, help="samples, 0 = leave out")
    parser.add_argument("--trees", type=int, default=2, help="trees against scikit-learn")
    parser.add_argument("--min-leaf", type=int, default=GrowthConfig().min_samples_leaf, help="of both")
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="bench_growing_") as folder:
        if not options.corpus:
            GenerateSettings(Path(folder) / "corpus", frames=options.make, seed=SEED).run()
        corpus = Corpus.open(options.corpus or Path(folder) / "corpus")
        train, test = Data(corpus, "train", options.frames, 1000), Data(corpus, "val", 200, 100)
    _, compile_s, _ = timed(lambda: grow_forest(train.some(1000), GrowthConfig(), 1, 1))
    print(f"compile or load, and a first tiny tree {compile_s:8.2f} s")
    evaluations(train)
    forest, wall, cpu = timed(lambda: grow_forest(train, GrowthConfig(), 1, options.threads))
    print(f"a tree of {len(train.classes)} samples: {wall:.1f} s on {options.threads} threads, {cpu:.1f} CPU s, "
          f"{len(forest[0][0])} nodes, held-out accuracy {accuracy(forest, test):.4f}")  # fmt: skip
    sizes = ((RandomForestClassifier(max_features=None), options.random_forest),
             (ExtraTreesClassifier(max_features=None), options.extra_trees))  # fmt: skip
    for peer, n in sizes:
        if n:
            name = type(peer).__name__
            against(name, peer, train, test, n, 2000, options.trees, options.min_leaf, options.threads)


if __name__ == "__main__":
    main()
