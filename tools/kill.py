"""make kill: kills commands at random times, runs them again to their end, and compares every byte they leave.

Run as `python -m tools.kill [-n 100] [--seed 0] [--only COMMAND ...]` from the root of the repository.
"""

import argparse
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MAX_SECONDS = 600.0
"""Longest time for a command that is let to end."""


@dataclass(frozen=True)
class Case:
    """A command that is killed.

    Attributes:
        name: What it is called.
        words: The command line; OUT stands for the folder or file that it writes.
        kept: Of a finished run: the bytes that must be the same, by name.
    """

    name: str
    words: tuple[object, ...]
    kept: Callable[[Path], dict[str, str]]


def files_of(out: Path) -> dict[str, str]:
    """SHA-256 of a file, or of every file in a folder, and the names of unfinished files beside it."""
    beside = [path for path in out.parent.iterdir() if path != out and path.name.startswith(out.name)]
    paths = sorted(path for path in out.rglob("*") if path.is_file()) if out.is_dir() else [out]
    digests = {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}
    return digests | {path.name: "left over" for path in beside}


def scores_of(out: Path) -> dict[str, str]:
    """What an ablation keeps: models and corpora by their bytes, scores without the times that were taken."""
    kept = {name: digest for name, digest in files_of(out).items() if name.startswith(("corpus-", "models/"))}
    document = json.loads((out / "ablation.json").read_text())
    kept["ablation.json"] = json.dumps(_without_seconds(document), sort_keys=True)
    names = sorted(path.name for path in out.rglob("*") if path.is_file())
    return kept | {"names": " ".join(names)}


def _without_seconds(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_seconds(item) for key, item in value.items() if "seconds" not in key}
    return [_without_seconds(item) for item in value] if isinstance(value, list) else value


def cases(folder: Path) -> list[Case]:
    """The commands, each small; makes what they read."""
    from tests.pipelines.toy_recording import write_layout, write_recording
    from tools.fuzz import samples

    corpus = samples.corpus(folder)
    recording = write_recording(folder / "recording", 140)
    layout = write_layout(folder)
    growth = ("--growth.max-depth", 5, "--growth.n-candidates", 40, "--growth.n-finalists", 5)
    settings = folder / "small.toml"
    settings.write_text("[scene]\ncamera = 'custom'\nintrinsics = [160, 120, 142.0, 142.0, 79.5, 59.5]\n")
    ablation = folder / "ablate.toml"
    ablation.write_text(samples.ablation_settings())
    oarf = ("--n-trees", 4, "--n-pixels", 60, "--n-occluder-pixels", 60, "--n-voting-pixels", 50)
    rwf = ("--n-trees", 2, "--n-points", 20, "--joints", "neck", "head", "torso")
    return [
        Case("generate", ("generate", "OUT", "--frames", 140, "--config", settings), files_of),
        Case("generate by two", ("generate", "OUT", "--frames", 140, "--config", settings, "--workers", 2), files_of),
        Case("train oarf", ("train", "oarf", corpus, "--out", "OUT", *oarf, *growth), files_of),
        Case("train rwf", ("train", "rwf", corpus, "--out", "OUT", *rwf, *growth), files_of),
        Case("import depth", ("import", "depth", recording, "--out", "OUT", "--layout", layout), files_of),
        Case("export", ("export", corpus, "--to", "webdataset", "--out", "OUT"), files_of),
        Case("ablate", ("ablate", "--size", "demo", "--config", ablation, "--out", "OUT", "--threads", 1), scores_of),
    ]  # fmt: skip


def main() -> int:
    """Kills each command so many times and prints what came of it; 1 if anything was lost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=100, help="kills, all commands together")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="*", help="names of commands")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="kill-") as name:
        folder = Path(name)
        chosen = [case for case in cases(folder) if not given.only or case.name in given.only]
        print(f"{'command':<22}{'s':>7}{'kills':>7}{'before':>8}{'resumed':>8}{'lost':>6}", flush=True)
        share = -(-given.n // len(chosen))
        n_lost = sum(
            _kill(case, folder, share, np.random.default_rng([given.seed, k])) for k, case in enumerate(chosen)
        )
    return int(bool(n_lost))


def _kill(case: Case, folder: Path, n: int, rng: np.random.Generator) -> int:
    """Kills one command so many times, in rounds of up to four kills before it is let to end; gives what was lost."""
    whole = folder / "whole" / case.name.replace(" ", "-")
    whole.parent.mkdir(exist_ok=True)
    _run(case, whole)  # compiles
    shutil.rmtree(whole) if whole.is_dir() else whole.unlink()
    begun = time.monotonic()
    assert _run(case, whole) == 0, case.name
    seconds = time.monotonic() - begun
    expected = case.kept(whole)
    n_kills = n_late = n_resumed = n_lost = 0
    while n_kills + n_late < n:
        out = folder / "killed" / case.name.replace(" ", "-")
        out.parent.mkdir()
        for _ in range(int(rng.integers(1, 5))):
            is_killed = _run(case, out, float(rng.uniform(0.2, 1.05)) * seconds) is None
            n_kills, n_late = n_kills + is_killed, n_late + (not is_killed)
            if not is_killed:
                break
        code = _run(case, out) if is_killed else 0
        got = case.kept(out) if out.exists() else {}  # killed after its last write, a command may refuse to go on
        n_resumed += 1
        if got != expected:
            n_lost += 1
            differing = sorted(name for name in {*expected, *got} if expected.get(name) != got.get(name))
            print(f"    {case.name}: exit code {code}, other or missing: {', '.join(differing[:8])}")
        shutil.rmtree(out.parent)
    print(f"{case.name:<22}{seconds:>7.1f}{n_kills:>7}{n_late:>8}{n_resumed:>8}{n_lost:>6}", flush=True)
    return n_lost


def _run(case: Case, out: Path, seconds: float | None = None) -> int | None:
    """Runs a command; its exit code, or None if it was killed after the given time."""
    words = [str(out if word == "OUT" else word) for word in case.words]
    process = subprocess.Popen(
        [sys.executable, "-m", "pipelines.cli", *words],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    try:
        _, said = process.communicate(timeout=MAX_SECONDS if seconds is None else seconds)
    except subprocess.TimeoutExpired:
        os.kill(process.pid, signal.SIGKILL)  # of the command alone: its workers must notice and end
        process.communicate()
        return None
    if process.returncode:
        print(f"    {case.name}: {said.decode(errors='replace').strip()[-300:]}")
    return process.returncode


if __name__ == "__main__":
    sys.exit(main())
