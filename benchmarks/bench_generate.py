"""Whole frames a second on one core, from drawing the scene to the written shard, and where the time goes.

Three figures: CPU seconds a frame of the whole run in one process, with compilation before and apart; the same
in a profiled run, by stage; and wall-clock frames a second with one and with two workers.

    python benchmarks/bench_generate.py [--frames 960] [--worker-frames 3200 | --no-workers] [--memory 10000]
    python benchmarks/bench_generate.py --settings 200    # the default scenes beside those of the paper's setting
"""

import argparse
import cProfile
import functools
import pstats
import tempfile
import time
from pathlib import Path

import psutil

from pipelines.ablate.config import paper_scenes
from pipelines.commands.generate import GenerateSettings
from pipelines.corpus import Order, write_corpus
from synth.scene import FrameSource, SceneConfig

STAGES = (
    ("subjects built", "pools.py", "_make_subject"),
    ("objects built", "pools.py", "_make_object"),
    ("scenes drawn (both of these included)", "source.py", "_draw_scene"),
    ("  of it base poses", "", "draw_base"),
    ("  of it arms", "", "draw_arms"),
    ("  of it soundness", "soundness.py", "is_sound"),
    ("  of it advancement", "placement.py", "advance"),
    ("rendering", "rasterize.py", "render"),
    ("visibility", "labels.py", "measure_visibility"),
    ("frames in all (drawn and rendered)", "source.py", "frame"),
)


def order(n_frames: int, seed: int) -> Order:
    """What `generate` would be asked to write."""
    return GenerateSettings(Path("unused"), frames=n_frames, seed=seed).order()


def timed_run(n_frames: int, seed: int, workers: int) -> tuple[float, float]:
    """CPU and wall seconds of writing a corpus into a temporary folder."""
    with tempfile.TemporaryDirectory() as folder:
        cpu, wall = time.process_time(), time.perf_counter()
        write_corpus(Path(folder) / "corpus", order(n_frames, seed), workers)
        return time.process_time() - cpu, time.perf_counter() - wall


def profiled_run(n_frames: int, seed: int) -> pstats.Stats:
    """Profile of the same run in one process."""
    profile = cProfile.Profile()
    with tempfile.TemporaryDirectory() as folder:
        run = functools.partial(write_corpus, Path(folder) / "corpus", order(n_frames, seed), 1)
        profile.runcall(run)
    return pstats.Stats(profile)


def memory_run(n_frames: int, seed: int) -> None:
    """Prints the memory that is resident while frames are drawn and rendered, as they go on."""
    process = psutil.Process()
    source = FrameSource(GenerateSettings(Path("unused")).scene, seed, n_frames)
    for index in range(n_frames):
        source.frame(index)
        if (index + 1) % (n_frames // 10) == 0:
            print(f"after {index + 1} frames: {process.memory_info().rss / 2**20:.0f} MiB", flush=True)


def settings_run(n_frames: int, seed: int) -> None:
    """Prints the CPU time of a frame by turns in the paper's setting and in the default scenes."""
    for turn in range(3):
        told = []
        for name, scene in (("paper's setting", paper_scenes()), ("default scenes", SceneConfig())):
            source = FrameSource(scene, seed + turn, n_frames + 1)
            source.frame(0)
            start = time.process_time()
            for index in range(1, n_frames + 1):
                source.frame(index)
            told.append(f"{name} {1000 * (time.process_time() - start) / n_frames:.2f} ms")
        print(", ".join(told), flush=True)


def cumulative(stats: pstats.Stats, file: str, function: str) -> float:
    """Cumulative seconds of a function in a profile."""
    rows = stats.stats.items()  # type: ignore[attr-defined]
    return sum(row[3] for (path, _, name), row in rows if name == function and path.endswith(file))


def main() -> None:
    """Runs the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=960)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--worker-frames", type=int, default=3200)
    parser.add_argument("--no-workers", action="store_true")
    parser.add_argument("--memory", type=int, metavar="FRAMES", help="only resident memory over FRAMES frames")
    parser.add_argument("--settings", type=int, metavar="FRAMES", help="only compare settings over FRAMES frames")
    options = parser.parse_args()
    if options.settings:
        settings_run(options.settings, options.seed)
        return
    if options.memory:
        memory_run(options.memory, options.seed)
        return

    start = time.perf_counter()
    source = FrameSource(GenerateSettings(Path("unused")).scene, options.seed + 1, 40)
    for frame in source:
        assert frame.depth.any()
    timed_run(4, options.seed, 1)
    print(f"compilation and first frames: {time.perf_counter() - start:.1f} s")

    cpu, wall = timed_run(options.frames, options.seed, 1)
    n = options.frames
    print(
        f"one process: {n / cpu:.1f} frames/s of CPU time ({1000 * cpu / n:.2f} ms a frame), "
        f"{n / wall:.1f} frames/s by the clock"
    )
    stats = profiled_run(options.frames, options.seed)
    total = stats.total_tt  # type: ignore[attr-defined]
    print(f"under the profiler: {1000 * total / n:.2f} ms a frame, of it")
    for label, file, function in STAGES:
        seconds = cumulative(stats, file, function)
        print(f"  {label:36} {1000 * seconds / n:6.2f} ms {seconds / total:6.1%}")
    if not options.no_workers:
        n = options.worker_frames
        rates = {workers: n / timed_run(n, options.seed, workers)[1] for workers in (1, 2)}
        print(
            f"workers 1: {rates[1]:.1f} frames/s, 2: {rates[2]:.1f} frames/s, ratio {rates[2] / rates[1]:.2f} "
            "(start of the processes included)"
        )


if __name__ == "__main__":
    main()
