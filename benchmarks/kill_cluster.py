"""Kills workers and schedulers during generate and train, runs the command again, and compares the bytes.

    python benchmarks/kill_cluster.py --workers-killed 50 --schedulers-killed 10

Needs undergrowth[cluster]. Scheduler and workers are processes of this machine; killed workers are started again.
"""

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from bench_cluster import ROOT, digest


class Workers:
    """A scheduler with two workers; a context manager."""

    def __enter__(self):
        self.scheduler = start("scheduler", "--host", "127.0.0.1", "--port", "0")
        self.address = next(line.split()[-1] for line in self.scheduler.stderr if "Scheduler at:" in line)
        self.workers = [start("worker", self.address, "--nthreads", "1", "--no-nanny") for _ in range(2)]
        return self

    def __exit__(self, *_):
        for process in (self.scheduler, *self.workers):
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            process.wait()
            process.stderr.close()

    def kill_worker(self, which):
        """Kills a worker and starts another."""
        self.workers[which].kill()
        self.workers[which].wait()
        self.workers[which].stderr.close()
        self.workers[which] = start("worker", self.address, "--nthreads", "1", "--no-nanny")


def start(*words):
    """A process of Dask."""
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *words, "--no-dashboard"], stderr=subprocess.PIPE, text=True, cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def run_killed(words, left, every_s, rng):
    """Runs a command until it ends well, killing meanwhile; `left` counts down, by "workers" and "schedulers"."""
    n_runs = 0
    while True:
        n_runs += 1
        with Workers() as cluster:
            command = subprocess.Popen(
                [sys.executable, "-m", "pipelines.cli", *map(str, words), "--scheduler", cluster.address],
                cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            )  # fmt: skip
            while command.poll() is None:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    command.wait(every_s * rng.uniform(0.5, 1.5))
                    break
                kinds = [kind for kind, n in left.items() for _ in range(n)]
                if kinds:
                    kind = kinds[rng.integers(len(kinds))]
                    left[kind] -= 1
                    if kind == "workers":
                        cluster.kill_worker(rng.integers(2))
                    else:
                        cluster.scheduler.send_signal(signal.SIGKILL)
            error = command.stderr.read()
            if command.returncode == 0:
                return n_runs
            if command.returncode != 1 or "undergrowth: error:" not in error:
                raise SystemExit(f"the command ended with {command.returncode}: {error}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--workers-killed", type=int, default=50)
    parser.add_argument("--schedulers-killed", type=int, default=10)
    parser.add_argument("--frames", type=int, default=640)
    parser.add_argument("--only", choices=("generate", "train"), default=None)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every-s", type=float, default=4.0, help="mean time between kills")
    parser.add_argument("--limit-s", type=float, default=1e9, help="begin no further round after so long")
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    begun = time.monotonic()
    left = {"workers": arguments.workers_killed, "schedulers": arguments.schedulers_killed}
    small = ("--scene.camera", "custom", "--scene.intrinsics", 160, 120, 142.0, 142.0, 79.5, 59.5)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        cases = {
            "generate": ("generate", "OUT", "--frames", arguments.frames, *small),
            "train": (
                "train", "oarf", folder / "generate-plain", "--no-learn-skeleton", "--n-pixels", 400, "--out", "OUT",
            ),
        }  # fmt: skip
        expected, n_rounds = {}, 0
        for case, words in cases.items():
            if arguments.only == "generate" != case:
                continue
            out = folder / f"{case}-plain"
            plain = [str(out if word == "OUT" else word) for word in words]
            subprocess.run(
                [sys.executable, "-m", "pipelines.cli", *plain], check=True, cwd=ROOT, stdout=subprocess.DEVNULL
            )
            expected[case] = digest(out)
        while any(left.values()) and time.monotonic() - begun < arguments.limit_s:
            for case, words in [(case, cases[case]) for case in expected if arguments.only in (None, case)]:
                before = dict(left)
                out = folder / f"{case}-{n_rounds}"
                n_runs = run_killed(
                    [out if word == "OUT" else word for word in words], left, arguments.every_s, rng
                )
                is_same = digest(out) == expected[case]
                killed = ", ".join(f"{before[kind] - left[kind]} {kind}" for kind in left)
                rest = sorted(item.name for item in folder.iterdir() if item.name.startswith(out.name + "."))
                print(
                    f"{case}: killed {killed}; {n_runs} runs; {'same bytes' if is_same else 'OTHER BYTES'} {rest}",
                    flush=True,
                )
            n_rounds += 1


if __name__ == "__main__":
    main()
