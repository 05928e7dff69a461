"""Corpus on disk: bytes a frame, write and read milliseconds a frame, against zarr's own pipeline in the same run.

python benchmarks/bench_corpus.py [--frames 192] [--toy] [--corpus DIR]
"""

import argparse
import functools
import resource
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import zarr

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "tests" / "pipelines")]

from pipelines.corpus import Corpus, Order, write_corpus  # noqa: E402
from pipelines.corpus.fields import stored_values  # noqa: E402
from pipelines.corpus.shards import encode_maps  # noqa: E402


class Replay:
    """Gives frames made before, so that only the writing is timed."""

    def __init__(self, frames):
        self.frames = frames

    def frame(self, index):
        """Frame of that number."""
        return self.frames[index]


def make_frames(n_frames, is_toy, corpus):
    if corpus:
        return [Corpus.open(corpus)[i] for i in range(n_frames)]
    if is_toy:
        from toy_source import ToySource

        source = ToySource(0, n_frames, width=512, height=424)
    else:
        from synth.scene import FrameSource, SceneConfig

        source = FrameSource(SceneConfig(), 0, n_frames)
        source.frame(0)
    begin = time.perf_counter()
    frames = [source.frame(i) for i in range(n_frames)]
    print(f"make a frame              {1e3 * (time.perf_counter() - begin) / n_frames:8.2f} ms")
    return frames


def size_table(corpus):
    total = 0
    for name in [*corpus.header.fields, "info"]:
        n_bytes = sum(line.n_bytes[name] for line in corpus.lines.values()) / len(corpus)
        total += n_bytes
        print(f"  {name:<24}{n_bytes / 1e3:8.2f} kB/frame")
    print(f"  {'all':<24}{total / 1e3:8.2f} kB/frame")


def write_with_zarr(corpus, root, frames):
    group = zarr.open_group(root, mode="w")
    template = zarr.open_group(corpus.path / "arrays.zarr", mode="r")
    arrays = {}
    for name in corpus.header.fields:
        like = template[name]
        arrays[name] = group.create_array(
            name, shape=like.shape, dtype=like.dtype, chunks=like.chunks, shards=like.shards,
            compressors=zarr.codecs.BloscCodec(cname="zstd", clevel=2, shuffle="shuffle"),
        )  # fmt: skip
    for first in range(0, len(frames), 64):
        block = [stored_values(frame) for frame in frames[first : first + 64]]
        for name, array in arrays.items():
            array[first : first + len(block)] = np.stack([values[name] for values in block])


def timed(name, n, work):
    begin, begin_cpu = time.perf_counter(), time.process_time()
    out = work()
    wall, cpu = time.perf_counter() - begin, time.process_time() - begin_cpu
    print(f"{name:<26}{1e3 * wall / n:8.2f} ms a frame ({1e3 * cpu / n:.2f} CPU)")
    return out, wall


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=192)
    parser.add_argument("--toy", action="store_true", help="toy frames, for a machine without the body data")
    parser.add_argument("--corpus", help="take the first frames of this corpus instead of making them")
    options = parser.parse_args()
    n = options.frames
    frames = make_frames(n, options.toy, options.corpus)
    root = Path(tempfile.mkdtemp(prefix="bench_corpus_"))
    try:
        seed = frames[0].info.seed
        order = Order(seed, n, {}, functools.partial(Replay, frames))
        write_corpus(root / "warm", Order(seed, 2, {}, functools.partial(Replay, frames)))
        Corpus.open(root / "warm")[0]
        header, ours = timed("write, this project", n, lambda: write_corpus(root / "ours", order))
        corpus = Corpus.open(root / "ours")
        items = [header.fields[name] for name in ("depth", "part", "occluder", "instance")]
        timed("  of which encode composite", n, lambda: [
            [encode_maps(item, getattr(frame, item.name)) for item in items] for frame in frames
        ])  # fmt: skip
        _, theirs = timed("write, zarr's pipeline", n, lambda: write_with_zarr(corpus, root / "zarr", frames))
        print(f"ratio {theirs / ours:.1f}")
        shuffled = np.random.default_rng(0).permutation(n).tolist()
        _, ours = timed("read a frame, random", n, lambda: [corpus[i] for i in shuffled])
        group = zarr.open_group(root / "ours" / "arrays.zarr", mode="r")
        names = list(header.fields)
        some = shuffled[:32]
        _, theirs = timed("read a frame, zarr", 32, lambda: [[group[name][i] for name in names] for i in some])
        print(f"ratio {theirs / 32 / (ours / n):.1f}")
        timed("read depth of all", n, lambda: corpus.arrays("depth"))
        size_table(corpus)
        print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")
    finally:
        shutil.rmtree(root)


if __name__ == "__main__":
    main()
