"""Training whole forests: seconds with leaf modes, feature evaluations, resident memory; compilation apart.

Anonymous memory is what training needs; file-backed pages (the mapped crops) the system may drop.

    python benchmarks/bench_training.py [--corpus DIR] [--threads 2] [--mode semantic] [--trees 3] [--frames 0]
        [--all] [--crops-in-memory GB] [--model OUT]
"""

import argparse
import tempfile
import threading
import time
from dataclasses import replace
from pathlib import Path

import psutil

from forests.frames import FrameSubset
from forests.growing import GrowthConfig
from forests.oarf import train
from forests.oarf.config import OARFConfig
from forests.oarf.storage import save_model
from forests.samples import gather
from pipelines.ablate.config import paper_scenes
from pipelines.commands.generate import GenerateSettings
from pipelines.corpus import Corpus
from pipelines.corpus.sequence import CorpusFrames
from pipelines.generation.writing import write_shown

PAPER_SPLITS = (1110, 200, 440)


class Peak:
    """Watches this process' memory: the most that was anonymous, and the most in all [MiB]."""

    def __init__(self) -> None:
        self.anonymous = self.resident = 0.0
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> "Peak":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped.set()
        self._thread.join()

    def _watch(self) -> None:
        process = psutil.Process()
        while not self._stopped.wait(0.05):
            memory = process.memory_info()
            self.anonymous = max(self.anonymous, (memory.rss - memory.shared) / 2**20)
            self.resident = max(self.resident, memory.rss / 2**20)


def paper_corpus(folder: Path) -> Path:
    """A corpus of the paper's size, with validation frames between."""
    settings = GenerateSettings(folder, frames=sum(PAPER_SPLITS), seed=2015, workers=2)
    splits = dict(zip(("train", "val", "test"), map(float, PAPER_SPLITS), strict=True))
    scene = replace(paper_scenes(), splits=replace(settings.scene.splits, **splits))
    write_shown(folder, replace(settings, scene=scene).order(), settings.workers)
    return folder


def compile_all(frames: CorpusFrames, validation: CorpusFrames, mode: str) -> float:
    """Seconds that a tiny training takes, nearly all of it compilation (or reading the compiled code)."""
    start = time.perf_counter()
    config = OARFConfig(
        mode, n_trees=1, n_pixels=50, learn_skeleton=False, growth=GrowthConfig(max_depth=3, n_candidates=150)
    )
    train.train(FrameSubset(frames, (0, 1, 2)), config, validation=FrameSubset(validation, (0, 1)))
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--mode", default="semantic")
    parser.add_argument("--trees", type=int, default=3)
    parser.add_argument("--frames", type=int, default=0)
    parser.add_argument("--all", action="store_true", help="learn from every split's frames, for the memory alone")
    parser.add_argument("--crops-in-memory", type=float, default=2.0)
    parser.add_argument("--model", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        corpus = Corpus.open(options.corpus or paper_corpus(Path(folder) / "corpus"))
        run(corpus, options)


def run(corpus: Corpus, options: argparse.Namespace) -> None:
    """Trains and prints."""
    frames, validation = (CorpusFrames(corpus, corpus.split(name)) for name in ("train", "val"))
    if options.all:
        frames = replace(frames, indices=corpus.indices)
    if options.frames:
        frames = replace(frames, indices=frames.indices[: options.frames])
    print(f"compilation {compile_all(frames, validation, options.mode):.1f} s")
    config = OARFConfig(options.mode, n_trees=options.trees, learn_skeleton=False)
    limit = int(options.crops_in_memory * 2**30)
    train.gather = lambda *given, **named: gather(*given, **named, max_bytes_in_memory=limit)
    start, cpu = time.perf_counter(), time.process_time()
    with Peak() as peak:
        model = train.train(frames, config, validation=validation, n_threads=options.threads)
    seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
    leaves = [tree.leaves.n_leaves for tree in model.trees]
    print(
        f"{options.mode}: {len(frames)} frames, {options.trees} trees ({leaves} leaves), "
        f"{options.threads} threads: {seconds:.1f} s, {cpu:.1f} CPU s, tuning on {len(validation)} frames included"
    )
    print(f"memory at most: {peak.anonymous:.0f} MiB anonymous, {peak.resident:.0f} MiB with mapped files")
    if options.model:
        save_model(options.model, model)
        print(f"{options.model}: {options.model.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
