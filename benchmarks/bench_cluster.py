"""Workers of a Dask scheduler against processes and threads: bytes, time, and what one scheduler can deal out.

    python benchmarks/bench_cluster.py --frames 2000 --repeats 2
    python benchmarks/bench_cluster.py --deal 15625 --workers 2

The first makes a corpus and a forest with 1, 2 and 4 workers and with none, in turn, and compares their bytes; times
are those of the whole command, CPU times those of all its processes. The second deals tasks that do nothing, but
carry the orders and manifest lines of real shards. Needs undergrowth[cluster].
"""

import argparse
import functools
import hashlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]


def command(*words):
    """Runs a command; (wall, CPU) seconds of it and its processes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "pipelines.cli", *map(str, words)], check=True, cwd=ROOT, stdout=subprocess.DEVNULL
    )
    wall = time.perf_counter() - begun
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def digest(path):
    """SHA-256 over a file, or all files of a folder."""
    total = hashlib.sha256()
    for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
        if file.is_file():
            total.update(file.relative_to(path).as_posix().encode() + file.read_bytes())
    return total.hexdigest()


def compare(name, words, ways, repeats, folder, suffix=""):
    """Runs a command in every way, in turn, and prints times and whether the bytes are the same; the last result."""
    times, digests = {}, {}
    for repeat in range(repeats):
        for way, options in ways.items():
            out = folder / f"{name}-{way.replace(' ', '-')}-{repeat}{suffix}"
            times.setdefault(way, []).append(command(*words(out), *options))
            digests.setdefault(digest(out), []).append(way)
    for way, taken in times.items():
        wall, cpu = (min(part) for part in zip(*taken, strict=True))
        print(f"{name:9} {way:12} {wall:7.1f} s wall, {cpu:7.1f} s CPU (least of {repeats})", flush=True)
    print(f"{name:9} {'the same bytes' if len(digests) == 1 else f'DIFFERENT BYTES: {digests}'}", flush=True)
    return out


def deal(n_tasks, n_workers):
    """How many shards that take no time one scheduler and one command deal out in a second."""
    from pipelines.cluster.shards import ShardJob, likeness_of
    from pipelines.corpus import Corpus
    from pipelines.engine.cluster import open_cluster
    from pipelines.generation.drawn import drawn_order
    from pipelines.generation.writing import write_shown
    from synth.scene import SceneConfig

    with tempfile.TemporaryDirectory() as folder:
        order = drawn_order(SceneConfig(camera="custom", intrinsics=(160, 120, 142.0, 142.0, 79.5, 59.5)), 1, 64)
        write_shown(Path(folder) / "c", order)
        corpus = Corpus.open(Path(folder) / "c")
        job = ShardJob(corpus.path, corpus.header, order, likeness_of(corpus.header, order.make_source()))
        line = corpus.lines[0]
    task = functools.partial(nothing, job, line)
    with open_cluster(f"local:{n_workers}") as cluster:
        next(iter(cluster.run(task, range(1), "warm")))
        begun, used = time.perf_counter(), os.times()
        n_done = sum(1 for _ in cluster.run(task, range(n_tasks), "nothing"))
        wall, spent = time.perf_counter() - begun, os.times()
    cpu = spent.user + spent.system - used.user - used.system
    print(f"{n_done} tasks to {n_workers} workers: {wall:.1f} s, {n_done / wall:.0f} a second", flush=True)
    print(f"command and scheduler, one process here: {1000 * cpu / n_done:.2f} ms CPU a task", flush=True)
    print(f"manifest line {len(json.dumps(line.to_json()))} bytes; peak memory of the command "
          f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")  # fmt: skip


def nothing(job, line, number):
    """A shard that takes no time."""
    return line


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--deal", type=int, default=0, help="only deal so many tasks that do nothing")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=None)
    arguments = parser.parse_args()
    if arguments.deal:
        deal(arguments.deal, arguments.workers)
        return
    with tempfile.TemporaryDirectory(dir=arguments.folder) as name:
        folder = Path(name)
        ways = {f"{n} workers": ("--scheduler", f"local:{n}") for n in (1, 2, 4)}
        corpus = compare(
            "generate", lambda out: ("generate", out, "--frames", arguments.frames, "--seed", 1),
            {"2 processes": ("--workers", 2), "1 process": ()} | ways, arguments.repeats, folder,
        )  # fmt: skip
        forest = ("--n-trees", 3, "--no-learn-skeleton")
        compare(
            "train", lambda out: ("train", "oarf", corpus, "--out", out, *forest),
            {"2 threads": ("--threads", 2), "1 thread": ()} | ways, arguments.repeats, folder, ".safetensors",
        )  # fmt: skip


if __name__ == "__main__":
    main()
