"""Leaf tables: leaves x joints a second, against the mean shift from every vote and its slow twin in the same run.

python benchmarks/bench_leaves.py [--corpus DIR] [--frames 1110] [--threads 1] [--starts 10 32 64 96 128]
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from forests.crops import Crops
from forests.growing import GrownTree, GrowthConfig, grow_class_tree
from forests.oarf.leaves import N_DRAWN, N_STARTS, LeafRules, leaf_table
from forests.samples import Samples, TrainingSet, gather
from forests.tree import NODE_DTYPE
from tests.reference_forests_modes import leaf_modes

BANDWIDTH, N_MODES = 0.05, 2


def grown_on(corpus, n_frames, n_threads):
    """(training set, classes, n_classes, n_parts, tree) of a corpus."""
    from forests.oarf.classes import ClassTable
    from pipelines.corpus import Corpus
    from pipelines.corpus.sequence import CorpusFrames

    opened = Corpus.open(corpus)
    frames = CorpusFrames(opened, opened.split("train")[:n_frames])
    training = gather(frames, "composite", 1000, 1000, 0)
    table = ClassTable.of(frames.labels, "semantic")
    classes = table.of_label(frames.labels)[training.samples.label]
    config = GrowthConfig(n_candidates=200, n_finalists=20)
    tree = grow_class_tree(training.crops, training.samples, classes, table.n_classes, config, 0, 0, n_threads)
    return training, classes, table.n_classes, table.n_parts, tree


def made_up(n_samples=400_000, n_frames=400, n_joints=15):
    """Leaves of the sizes of a real tree's (most have a few samples, a hundredth hundreds)."""
    rng = np.random.default_rng(0)
    sizes = np.minimum(5 + rng.pareto(0.9, n_samples // 20) * 3, 10_000).astype(np.int64)
    leaf_start = np.concatenate([[0], np.cumsum(sizes)])
    leaf_start = leaf_start[leaf_start <= n_samples]
    n = int(leaf_start[-1])
    frame = np.sort(rng.integers(0, n_frames, n)).astype(np.int32)
    place = [rng.integers(1, 100, n).astype(np.int16) for _ in range(2)]
    z_mm = rng.integers(1900, 2100, n).astype(np.uint16)
    samples = Samples(frame, *place, z_mm, np.ones(n, np.uint8))
    zeros = np.zeros(n_frames, np.int64)
    size = np.full(n_frames, 100, np.int32)
    lens = np.tile(np.float32([400, 400, 50, 50]), (n_frames, 1))
    crops = Crops(np.zeros(0, np.uint16), zeros, size, size, np.zeros((n_frames, 2), np.int32), lens)
    joints = rng.normal([0, 0, 2], 0.1, (n_frames, n_joints, 3)).astype(np.float32)
    order = rng.permutation(n).astype(np.int32)
    classes = rng.choice([0, 1], n, p=[0.9, 0.1]).astype(np.uint8)
    return (
        TrainingSet(crops, samples, joints),
        classes,
        2,
        1,
        GrownTree(np.zeros(0, NODE_DTYPE), leaf_start, order),
    )


def timed(work):
    begin, begin_cpu = time.perf_counter(), time.process_time()
    out = work()
    return out, time.perf_counter() - begin, time.process_time() - begin_cpu


def nearness(table, exact, has):
    """Shares of first modes within 1 cm, and the mean difference of their weights."""
    apart = np.linalg.norm(table.vote[..., 0, :] - exact.vote[..., 0, :], axis=-1)[has]
    weight = np.abs(table.weight[..., 0] - exact.weight[..., 0])[has]
    return f"{100 * (apart < 0.01).mean():6.2f} % within 1 cm, weights {weight.mean():.4f} apart"


def twin(training, classes, n_parts, tree, table):
    """Compares with the slow twin on leaves small enough for it; returns its seconds a leaf and joint."""
    sizes = np.diff(tree.leaf_start)
    leaves = np.flatnonzero((sizes > 0) & (sizes <= 150))
    leaves = leaves[np.linspace(0, len(leaves) - 1, 60).astype(int)]
    points = training.samples.points(training.crops)
    begin, n_near, n = time.process_time(), 0, 0
    for leaf in leaves:
        members = tree.order[tree.leaf_start[leaf] : tree.leaf_start[leaf + 1]]
        offsets = (training.joints[training.samples.frame[members]] - points[members][:, None]).astype(float)
        mode, weight = leaf_modes(offsets, classes[members] >= n_parts, BANDWIDTH, N_MODES, table.weight.shape[1])
        # Where two modes weigh the same, either may come first.
        is_clear = weight[..., 0] > weight[..., 1] + 1e-6
        apart = np.linalg.norm(table.vote[leaf, ..., 0, :] - mode[..., 0, :], axis=-1)
        n_near += (apart < 0.01)[is_clear].sum()
        n += is_clear.sum()
    cpu = (time.process_time() - begin) / (len(leaves) * training.joints.shape[1])
    print(
        f"slow twin, {len(leaves)} leaves          {1 / cpu:12.0f} /CPU s  {100 * n_near / n:6.2f} % within 1 cm"
    )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--corpus", help="grow the tree on this corpus instead of making leaves up")
    parser.add_argument("--frames", type=int, default=1110)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--starts", type=int, nargs="*", default=[10, 32, 64, N_STARTS, 128])
    options = parser.parse_args()
    made = grown_on(options.corpus, options.frames, options.threads) if options.corpus else made_up()
    training, classes, n_classes, n_parts, tree = made
    n = (len(tree.leaf_start) - 1) * training.joints.shape[1]
    print(f"{len(classes)} samples, {len(tree.leaf_start) - 1} leaves, {training.joints.shape[1]} joints")

    rules = LeafRules(n_classes, n_parts, BANDWIDTH, N_MODES, 0, 0)

    def run(n_starts):
        return leaf_table(training, classes, tree, rules._replace(n_starts=n_starts), options.threads)

    one_leaf = tree._replace(leaf_start=tree.leaf_start[[0, -1]])
    _, compile_s, _ = timed(lambda: leaf_table(training, classes, one_leaf, rules))
    print(f"compile, or load from the cache {compile_s:8.2f} s")
    exact, wall, exact_cpu = timed(lambda: run(N_DRAWN))
    print(f"every vote climbs               {n / exact_cpu:12.0f} /CPU s  {exact_cpu:.2f} CPU s, {wall:.2f} s")
    has = exact.weight[..., 0] > 0
    for n_starts in options.starts:
        table, wall, cpu = timed(lambda n_starts=n_starts: run(n_starts))
        print(
            f"{n_starts:4d} climb                      {n / cpu:12.0f} /CPU s  {cpu:.2f} CPU s, {wall:.2f} s, "
            f"{exact_cpu / cpu:.1f} times as fast; {nearness(table, exact, has)}"
        )
    twin(training, classes, n_parts, tree, exact)


if __name__ == "__main__":
    main()
