"""Who finds the joints: the votes of the body's pixels, those of the objects' pixels, or both together.

A leaf keeps the offsets of body samples and of object samples apart. Leaving out one of the two, and tuning anew
how far votes may come from and how wide the kernel is, shows what the other knows by itself. What both together
add to the body's votes is the most that the objects' pixels, and so their classes' names, can be worth. Files of format
version 2 hold no votes that are longer than their tuning lets vote, so that tuning anew can only shorten them.

    python benchmarks/audit_votes.py --corpus DIR --model FILE [--model FILE ...] [--limit 0] [--threads 2]
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forests.calibration import WITHIN_M
from forests.oarf.model import OARFModel
from forests.oarf.packed import pack_leaves
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model
from forests.oarf.tune import tune
from pipelines.corpus import Corpus
from pipelines.corpus.sequence import CorpusFrames
from pipelines.spread import at_most

LAYERS = {"both": (0, 1), "body": (0,), "objects": (1,)}
"""Layers of the leaf modes that vote."""


def silenced(model: OARFModel, layers: tuple[int, ...]) -> OARFModel:
    """The forest with votes of these layers alone."""
    trees = []
    for tree in model.trees:
        table = tree.leaves.unpacked()
        weight = np.zeros_like(table.weight)
        weight[:, list(layers)] = table.weight[:, list(layers)]
        trees.append(tree._replace(leaves=pack_leaves(table._replace(weight=weight))))
    return replace(model, trees=tuple(trees))


def found(model: OARFModel, frames: CorpusFrames) -> NDArray[np.bool_]:
    """(n_frames, n_joints) whether the first proposal is within 10 cm."""
    predictor, out = Predictor(model), []
    for k in range(len(frames)):
        frame = frames[k]
        joints = predictor.predict(frame.depth, frame.camera).joints
        out.append(np.linalg.norm(joints - frame.joints, axis=1) <= WITHIN_M)  # NaN is not within
    return np.array(out)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--model", type=Path, action="append", required=True)
    parser.add_argument("--limit", type=int, default=0, help="so many of the test frames, evenly spread")
    parser.add_argument("--threads", type=int, default=2)
    asked = parser.parse_args()
    corpus = Corpus.open(asked.corpus)
    validation = CorpusFrames(corpus, corpus.split("val"))
    numbers = corpus.split("test")
    test = CorpusFrames(corpus, numbers[at_most(len(numbers), asked.limit)])
    is_occluded = np.stack([test[k].is_occluded for k in range(len(test))])
    print(f"{len(test)} test frames, {is_occluded.sum()} occluded joints; share within 10 cm")
    for path in asked.model:
        model = load_model(path)
        for name, layers in LAYERS.items():
            if model.classes.n_classes == model.classes.n_parts:
                raise SystemExit(f"{path} knows no objects")
            hits = found(tune(silenced(model, layers), validation, asked.threads), test)
            print(
                f"{path.name:44} {name:8} all {hits.mean():.3f}  occluded {hits[is_occluded].mean():.3f}  "
                f"others {hits[~is_occluded].mean():.3f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
