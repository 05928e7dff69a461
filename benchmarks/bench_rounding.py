"""How far joints move when the numbers of a regression forest's file are rounded, and what each part of the file takes.

Files keep what prediction reads to the bit. This says what coarser numbers would cost: each sort of number is rounded
alone, then all together, and the joints of frames are compared with those of the file as it is.
"""

import argparse
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from forests.modelfile import read_model
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.packed import FACING_ONE, WEIGHT_ONE, PackedLeaves, voting
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model
from pipelines.corpus import Corpus
from pipelines.corpus.sequence import CorpusFrames
from pipelines.spread import at_most


def steps_of(model: OARFModel, n_steps: int) -> NDArray[np.float64]:
    """(n_joints,) [mm], so that so many steps reach the longest vote of a joint."""
    longest = np.zeros(len(model.tuning.max_offset_m))
    for tree in model.trees:
        np.maximum.at(longest, joints_of(tree.leaves), np.abs(tree.leaves.vote).max(axis=1))
    return np.maximum(longest / n_steps, 1e-3)


def joints_of(leaves: PackedLeaves) -> NDArray[np.int64]:
    """(n_set,) the joint of each vote."""
    places = np.flatnonzero(np.unpackbits(leaves.has_vote, count=int(np.prod(leaves.shape))))
    return places // leaves.shape[3] % leaves.shape[2]


def with_offsets(tree: ForestTree, steps: NDArray[np.float64]) -> ForestTree:
    step = steps[joints_of(tree.leaves)][:, None]
    vote = np.rint(np.rint(tree.leaves.vote / step) * step).astype(np.int16)
    return tree._replace(leaves=tree.leaves._replace(vote=vote))


def with_weights(tree: ForestTree, n_steps: int) -> ForestTree:
    """Weights in steps of their square roots, which keeps light ones apart."""
    root = np.maximum(np.rint(np.sqrt(tree.leaves.weight / WEIGHT_ONE) * n_steps), 1) / n_steps
    weight = np.maximum(np.rint(root**2 * WEIGHT_ONE), 1).astype(np.int16)
    return tree._replace(leaves=tree.leaves._replace(weight=weight))


def with_facings(tree: ForestTree, n_steps: int) -> ForestTree:
    facing = np.rint(np.rint(tree.leaves.facing / FACING_ONE * n_steps) / n_steps * FACING_ONE).astype(np.int8)
    return tree._replace(leaves=tree.leaves._replace(facing=facing))


def with_probes(tree: ForestTree) -> ForestTree:
    nodes = tree.nodes.copy()
    unit = max(np.abs(nodes["u"]).max(), np.abs(nodes["v"]).max()) / 32767
    for name in ("u", "v"):
        nodes[name] = np.rint(nodes[name] / unit) * unit
    return tree._replace(nodes=nodes)


def joints_by(model: OARFModel, frames: CorpusFrames) -> NDArray[np.float32]:
    """(2, n_frames, n_joints, 3) float32: each joint's first mode, and those of one skeleton [m]."""
    predictor, out = Predictor(model), []
    for k in range(len(frames)):
        frame = frames[k]
        asked = predictor.predict_joints, predictor.predict
        out.append([ask(frame.depth, frame.camera).joints for ask in asked])
    return np.array(out).swapaxes(0, 1)


def report(name: str, before: NDArray[np.float32], after: NDArray[np.float32]) -> None:
    for what, one, two in zip(("first modes", "skeletons"), before, after, strict=True):
        moved = 1000.0 * np.linalg.norm(two - one, axis=2)
        moved = moved[np.isfinite(moved)]
        print(
            f"{name:26s} {what:11s} moved by more than 1 mm: {100 * (moved > 1).mean():5.2f} % of {moved.size}, "
            f"median {np.median(moved):.3f}, 99.9 % {np.quantile(moved, 0.999):.2f}, at most {moved.max():.2f} mm",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=100, help="so many of the test frames, evenly spread")
    asked = parser.parse_args()
    parts: Counter[str] = Counter()
    for name, values in read_model(asked.model).arrays.items():
        parts[name.split(".")[-1] if name.startswith("tree") else name.split(".")[0]] += values.nbytes
    print(", ".join(f"{name} {n / 1e6:.2f} MB" for name, n in parts.most_common()))
    model = load_model(asked.model)
    reach = model.tuning.max_offset_m
    model = replace(model, trees=tuple(tree._replace(leaves=voting(tree.leaves, reach)) for tree in model.trees))
    corpus = Corpus.open(asked.corpus)
    numbers = corpus.split("test")
    frames = CorpusFrames(corpus, numbers[at_most(len(numbers), asked.frames)])
    before, steps = joints_by(model, frames), steps_of(model, 511)
    ways = {
        "probes in 16 bits": with_probes,
        "offsets in 10 bits": lambda tree: with_offsets(tree, steps),
        "weights in 8 bits": lambda tree: with_weights(tree, 255),
        "facings in 2 x 4 bits": lambda tree: with_facings(tree, 7),
        "all of them": lambda tree: with_facings(with_weights(with_offsets(with_probes(tree), steps), 255), 7),
    }
    for name, way in ways.items():
        rounded = replace(model, trees=tuple(map(way, model.trees)))
        report(name, before, joints_by(rounded, frames))


if __name__ == "__main__":
    main()
