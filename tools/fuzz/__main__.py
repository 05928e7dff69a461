"""Runs `python -m tools.fuzz [-n 3000] [--seed 0] [--only FORMAT ...] [--jobs 2]` from the root of the repository."""

import argparse
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

OUTCOMES = ("refused", "read", "same", "wrong", "unclear", "raised", "crashed", "timeout", "memory")


def main() -> int:
    """Damages and reads all formats, prints what came of it; 1 if a reader broke its promise."""
    from tools.fuzz.formats import MAKERS

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", type=int, default=3000, help="mutations of each format")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="*", default=list(MAKERS), choices=list(MAKERS), metavar="FORMAT")
    parser.add_argument("--jobs", type=int, default=2, help="formats at a time")
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz"), help="folder for files that show a fault")
    given = parser.parse_args()
    given.keep.mkdir(parents=True, exist_ok=True)
    print(f"{'format':<22}{'n':>7}" + "".join(f"{word:>9}" for word in OUTCOMES) + f"{'s':>7}", flush=True)
    if len(given.only) == 1:
        return _one(given.only[0], given)
    with ThreadPoolExecutor(given.jobs) as pool:
        codes = list(pool.map(lambda name: _in_process(name, given), given.only))
    return int(any(codes))


def _in_process(name: str, given: argparse.Namespace) -> int:
    words = [sys.executable, "-m", "tools.fuzz", "-n", str(given.n), "--seed", str(given.seed)]
    words += ["--keep", str(given.keep), "--only", name]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    sys.stdout.write("\n".join(done.stdout.splitlines()[1:]) + "\n")
    sys.stdout.flush()
    return done.returncode


def _one(name: str, given: argparse.Namespace) -> int:
    from tools.fuzz import samples

    samples.quiet()
    from tools.fuzz.formats import MAKERS
    from tools.fuzz.workers import fuzz

    begun = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        form = MAKERS[name](Path(folder))
        counts = fuzz(form, -(-given.n // form.n_divisor), given.seed, given.keep)
    n = sum(counts.of.values())
    cells = "".join(f"{counts.of[word]:>9}" for word in OUTCOMES)
    print(f"{name:<22}{n:>7}{cells}{time.monotonic() - begun:>7.0f}")
    kinds: dict[str, list[int]] = {}
    for number, words in counts.faults.items():
        kinds.setdefault(words[:160], []).append(number)
    for words, numbers in sorted(kinds.items(), key=lambda item: -len(item[1]))[:12]:
        print(f"    {len(numbers)} x (mutation {numbers[0]}) {words}")
    return int(bool(counts.faults))


if __name__ == "__main__":
    sys.exit(main())
