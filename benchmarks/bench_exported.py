"""A regression forest as an ONNX graph beside the forest itself: size, speed on one core, leaves and joints.

Run: python benchmarks/bench_exported.py --model FILE --corpus DIR [--frames 60]
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import onnxruntime

from forests.frames import DepthFrame
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model
from pipelines.corpus import Corpus
from pipelines.corpus.sequence import CorpusFrames
from pipelines.export.forest.write import to_onnx


class Compared(NamedTuple):
    """One frame: milliseconds of CPU, pixels with another leaf, and distances of the joints [mm]."""

    ours_ms: float
    theirs_ms: float
    n_leaves_apart: int
    n_leaves: int
    apart_mm: np.ndarray


def cpu_ms(call: Callable[[], object], repeats: int = 3) -> float:
    """Milliseconds of CPU, the best of several calls."""
    times = []
    for _ in range(repeats):
        start = time.thread_time()
        call()
        times.append((time.thread_time() - start) * 1e3)
    return min(times)


def compare(predictor: Predictor, session: onnxruntime.InferenceSession, frame: DepthFrame) -> Compared:
    depth, camera = frame.depth, frame.camera
    inputs = {
        "depth": depth,
        "intrinsics": np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32),
        "box": np.array([0, 0, *depth.shape[::-1]], np.float32),
    }
    proposals, theirs = session.run(["proposals", "leaves"], inputs)
    leaves, _ = predictor.reach_leaves(depth, camera)
    joints = predictor.predict(depth, camera).joints
    return Compared(
        cpu_ms(lambda: predictor.predict(depth, camera)),
        cpu_ms(lambda: session.run(None, inputs)),
        int((leaves != theirs).sum()) if leaves.shape == theirs.shape else leaves.size,
        leaves.size,
        1e3 * np.linalg.norm(proposals[:, 0] - joints, axis=1),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=60)
    options = parser.parse_args()
    model, corpus = load_model(options.model), Corpus.open(options.corpus)
    start = time.process_time()
    graph = to_onnx(model)
    print(
        f"model file {options.model.stat().st_size / 1e6:.1f} MB, graph {len(graph) / 1e6:.1f} MB, "
        f"written in {time.process_time() - start:.1f} s of CPU"
    )
    alone = onnxruntime.SessionOptions()
    alone.intra_op_num_threads = 1
    start = time.process_time()
    session = onnxruntime.InferenceSession(graph, alone, providers=["CPUExecutionProvider"])
    print(f"opened in {time.process_time() - start:.1f} s of CPU")

    test, predictor = CorpusFrames(corpus, corpus.split("test")), Predictor(replace(model, skeleton=None))
    frames = [test[int(k)] for k in np.linspace(0, len(test) - 1, min(options.frames, len(test)))]
    compare(predictor, session, frames[0])  # compiles
    rows = [compare(predictor, session, frame) for frame in frames]
    ours, theirs = (float(np.mean(of)) for of in ([row.ours_ms for row in rows], [row.theirs_ms for row in rows]))
    apart = np.concatenate([row.apart_mm for row in rows])
    print(
        f"{len(rows)} frames, ms of CPU a frame: forest {ours:.2f}, graph {theirs:.1f}, {theirs / ours:.1f} times"
    )
    print(f"{sum(row.n_leaves_apart for row in rows)} of {sum(row.n_leaves for row in rows)} leaves differ")
    print(
        f"{len(apart)} joints: {np.isnan(apart).sum()} not found, at most {np.nanmax(apart):.3f} mm apart, "
        f"{(apart > 1).sum()} by more than 1 mm"
    )


if __name__ == "__main__":
    main()
