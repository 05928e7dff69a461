"""Reads damaged files in forked processes that have a limit on memory and time, and judges what comes of it."""

import hashlib
import logging
import multiprocessing
import multiprocessing.connection
import os
import resource
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

SECONDS = 20.0
"""Longest time for one file; a machine that does other work is slow."""
MORE_BYTES = 4 * 2**30
"""Address space beyond what the process has when it begins."""
MORE_RESIDENT_KIB = 2.5 * 2**20
"""Memory that a file of a few kB may take; readers allow themselves 2 GiB."""


def digest(*arrays: object) -> str:
    """SHA-256 over arrays and values."""
    total = hashlib.sha256()
    for values in arrays:
        total.update(
            np.ascontiguousarray(values).tobytes() if isinstance(values, np.ndarray) else repr(values).encode()
        )
    return total.hexdigest()


@dataclass(frozen=True)
class Format:
    """A format that the program reads.

    Attributes:
        name: What it is called.
        sample: The file that is damaged.
        damage: Damages the bytes of it.
        read: Reads the file as the program does; its answer as text or bytes.
        errors: What it may raise about a damaged file, each a sentence that names it.
        is_checked: Whether a damaged file that is read must give the answer of the whole one.
        n_divisor: Only one of so many mutations is made, where reading takes long.
    """

    name: str
    sample: Path
    damage: Callable[[bytes, np.random.Generator], bytes] = field(repr=False)
    read: Callable[[Path], object] = field(repr=False)
    errors: tuple[type[Exception], ...]
    is_checked: bool = False
    n_divisor: int = 1


@dataclass
class Counts:
    """What came of a format's mutations.

    Attributes:
        of: Number of each outcome: refused, read, same (as undamaged), and the faults.
        faults: What went wrong, by mutation.
    """

    of: Counter = field(default_factory=Counter)
    faults: dict[int, str] = field(default_factory=dict)

    def add(self, number: int, outcome: str, words: str) -> None:
        """Counts an outcome; other than refused, read and same are faults."""
        self.of[outcome] += 1
        if outcome not in ("refused", "read", "same"):
            self.faults[number] = f"{outcome}: {words}"


def fuzz(form: Format, n: int, seed: int, keep: Path) -> Counts:
    """Reads so many damaged files of a format.

    Args:
        form: The format.
        n: How many.
        seed: Of the damage: mutation k of a seed is the same file each time.
        keep: Folder for the damaged files that showed a fault.
    """
    whole = form.sample.read_bytes()
    answer = _answer(form)  # also loads what is compiled, before processes fork
    counts = Counts()
    first = 0
    while first < n:
        first = _one_process(form, whole, answer, range(first, n), seed, counts)
        form.sample.write_bytes(whole)
    for number in counts.faults:
        (keep / f"{form.name.replace(' ', '_')}-{number}{form.sample.suffix}").write_bytes(
            _mutation(form, whole, seed, number)
        )
    return counts


def _mutation(form: Format, whole: bytes, seed: int, number: int) -> bytes:
    name = int.from_bytes(hashlib.sha256(form.name.encode()).digest()[:4], "big")
    return form.damage(whole, np.random.default_rng([seed, name, number]))


def _one_process(form: Format, whole: bytes, answer: bytes, numbers: range, seed: int, counts: Counts) -> int:
    """Goes through mutations in one process until all are done or it ends; gives the next number."""
    context = multiprocessing.get_context("fork")
    told, tell = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(form, whole, answer, numbers, seed, tell))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of forking beside idle threads of libraries
        process.start()
    tell.close()
    number = numbers.start
    while number < numbers.stop:
        if not told.poll(SECONDS):
            process.kill()
            counts.add(number, "timeout", f"over {SECONDS:g} s")
            number += 1
            break
        try:
            done, outcome, words, is_last = told.recv()
        except EOFError:
            process.join()
            counts.add(number, "crashed", f"the process ended with code {process.exitcode}")
            number += 1
            break
        counts.add(done, outcome, words)
        number = done + 1
        if is_last:
            break
    process.join()
    return number


def _work(
    form: Format,
    whole: bytes,
    answer: bytes,
    numbers: range,
    seed: int,
    tell: multiprocessing.connection.Connection,
) -> None:
    """What a process does: writes, reads and judges one mutation after another."""
    for stream in (1, 2):  # libraries of C print there
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MORE_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    begun = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in numbers:
        try:
            data = _mutation(form, whole, seed, number)
            form.sample.write_bytes(data)
            outcome, words = ("same", "") if data == whole else _judged(form, answer)
        except BaseException:
            outcome, words = "broken", f"the tool itself: {traceback.format_exc()[-300:]}"
        taken = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - begun
        is_greedy = taken > MORE_RESIDENT_KIB
        if is_greedy and outcome in ("refused", "read"):
            outcome, words = "memory", f"{taken / 2**20:.1f} GiB"
        tell.send((number, outcome, words, is_greedy))
        if is_greedy:
            break
    tell.close()
    os._exit(0)


def _judged(form: Format, answer: bytes) -> tuple[str, str]:
    """Outcome and words of one file."""
    try:
        read = _answer(form)
    except form.errors as error:
        sentence = str(error)
        is_named = form.sample.name in sentence or form.sample.parent.name in sentence
        if "\n" in sentence or not sentence or not is_named:
            return "unclear", sentence[:300]
        return "refused", sentence
    except MemoryError:
        return "memory", "MemoryError"
    except BaseException as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        own = [item for item in traceback.extract_tb(error.__traceback__) if "site-packages" not in item.filename]
        where = f"{Path(own[-1].filename).name}:{own[-1].lineno}" if own else f"{place.filename}:{place.lineno}"
        return "raised", f"{type(error).__name__} at {where}: {str(error)[:200]}"
    if form.is_checked and read != answer:
        return "wrong", "it was read as something else"
    return "read", ""


def _answer(form: Format) -> bytes:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        logging.disable(logging.WARNING)
        return repr(form.read(form.sample)).encode()
