"""Runs an order to its end: the missing shards one after another, in this process or in several."""

import concurrent.futures
import contextlib
import itertools
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event
from pathlib import Path

from pipelines.compiling import CompileWatch, announce
from pipelines.corpus.folder import Order, finished_shards, locked_folder, locked_part, prepare_folder, whole
from pipelines.corpus.header import Header, read_header
from pipelines.corpus.manifest import (
    MANIFEST_NAME,
    ShardLine,
    append_line,
    read_lines_of,
    read_manifest,
    rewrite_manifest,
)
from pipelines.corpus.write import FrameSource, write_shard
from pipelines.engine.dealing import IN_FLIGHT, Dealer
from pipelines.errors import UserError, in_words

Progress = Callable[[int, int], object]
"""Called with the frames finished so far, those of earlier runs included, and those finished by earlier runs."""

Runner = Callable[[Path, Header, Order, list[int], Callable[[int], object]], Iterator[ShardLine]]
"""Makes shards of an order, in any order, and yields the manifest's lines of those whose files are in their place.

Takes the folder, its header, the order, the shards' numbers, and what to tell of further finished frames."""


def write_corpus(
    root: Path, order: Order, workers: int = 1, progress: Progress | None = None, runner: Runner | None = None
) -> Header:
    """Makes the corpus ordered, going on where an earlier run of the same order stopped.

    Args:
        root: The folder; made if it is not there.
        order: What to make.
        workers: Processes; 1 works in this one. The files' bytes do not depend on it.
        progress: Told of every frame (one process) or shard (several).
        runner: Makes the shards in place of processes of this machine; only this process writes the manifest.

    Returns:
        The finished corpus' header.

    Raises:
        UserError: The folder is another's or in use, the disk is full, or a worker died.
    """
    with _writing(root, workers), locked_folder(root):
        header = prepare_folder(root, order)
        lines = finished_shards(root, header)
        path = root / MANIFEST_NAME
        for line in _made(root, header, order, lines, range(header.n_shards), workers, progress, runner):
            append_line(path, line)
            lines[line.shard] = line
        rewrite_manifest(path, lines)
    return header


def write_shards(
    root: Path,
    order: Order,
    shards: range,
    workers: int = 1,
    progress: Progress | None = None,
    runner: Runner | None = None,
) -> Header:
    """Makes some shards of a corpus, as one job of an array; `join_shards` completes it when all jobs are through.

    Args:
        root: The folder, of all jobs.
        order: The whole corpus.
        shards: Which shards; what lies beyond the last does not count.
        workers: As of `write_corpus`; so are the rest.
        progress: Told of the frames of these shards.
        runner: Makes them in place of processes of this machine.

    Raises:
        UserError: As of `write_corpus`, or there are no such shards.
    """
    with _writing(root, workers), locked_folder(root, is_shared=True):
        header = prepare_folder(root, order)
        if not 0 <= shards.start < min(shards.stop, header.n_shards):
            raise UserError(
                f"only_shards={shards.start}:{shards.stop} must be FIRST:END within 0:{header.n_shards}, the shards "
                f"of {root}"
            )
        shards = range(shards.start, min(shards.stop, header.n_shards))
        with locked_part(root, shards) as path:
            lines = whole(root, header, read_manifest(root, header) | read_lines_of(path, header))
            for line in _made(root, header, order, lines, shards, workers, progress, runner):
                append_line(path, line)
    return header


def join_shards(root: Path) -> Header:
    """Completes a corpus whose shards were made by the jobs of an array.

    Raises:
        UserError: Jobs are at work, or shards are missing; those that are there are kept.
    """
    header = read_header(root)
    with _writing(root, 1), locked_folder(root):
        lines = finished_shards(root, header)
    if missing := [shard for shard in range(header.n_shards) if shard not in lines]:
        raise UserError(f"{root} lacks the shards {_in_runs(missing)}; make them with generate --only-shards")
    return header


def _in_runs(numbers: list[int]) -> str:
    """Such as "3:7, 9:10", the first few runs."""
    breaks = [k for k in range(1, len(numbers)) if numbers[k] != numbers[k - 1] + 1]
    runs = [numbers[a:b] for a, b in itertools.pairwise([0, *breaks, len(numbers)])]
    told = [f"{run[0]}:{run[-1] + 1}" for run in runs]
    return ", ".join(told[:8]) + (f" and {len(told) - 8} further runs" if len(told) > 8 else "")


@contextlib.contextmanager
def _writing(root: Path, workers: int) -> Iterator[None]:
    """Makes the folder; what the system refuses becomes the user's error."""
    if workers < 1:
        raise UserError(f"workers={workers} must be at least 1")
    if root.exists() and not root.is_dir():
        raise UserError(f"{root} is a file, not a folder")
    try:
        root.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        raise UserError(in_words(error, root)) from None


def _made(
    root: Path,
    header: Header,
    order: Order,
    lines: dict[int, ShardLine],
    shards: range,
    workers: int,
    progress: Progress | None,
    runner: Runner | None,
) -> Iterator[ShardLine]:
    """Makes those of the shards that are not among the lines."""
    missing = [shard for shard in shards if shard not in lines]
    count = _Counter(sum(line.n_frames for line in lines.values() if line.shard in shards), progress)
    if runner is not None:
        return runner(root, header, order, missing, count.add)
    if workers == 1 or len(missing) < 2:
        return _in_this_process(root, header, order, missing, count)
    return _in_processes(root, header, order, missing, min(workers, len(missing)), count)


class _Counter:
    """Counts finished frames for the progress callback."""

    def __init__(self, n_done: int, progress: Progress | None) -> None:
        self.n_earlier = n_done
        self.n_done = n_done
        self.progress = progress
        self.add(0)

    def add(self, n_frames: int = 1) -> None:
        self.n_done += n_frames
        if self.progress is not None:
            self.progress(self.n_done, self.n_earlier)


def _in_this_process(
    root: Path, header: Header, order: Order, missing: list[int], count: _Counter
) -> Iterator[ShardLine]:
    source = order.make_source() if missing else None
    for shard in missing:
        assert source is not None
        yield write_shard(root, header, source, shard, on_frame=count.add)


def _in_processes(
    root: Path, header: Header, order: Order, missing: list[int], workers: int, count: _Counter
) -> Iterator[ShardLine]:
    """Hands shards to processes, two a worker in flight; only this process writes the manifest."""
    context = multiprocessing.get_context("spawn")
    stop_seen, stop = context.Pipe(duplex=False)
    is_compiling = context.Event()
    start = (root, header, order, stop_seen, is_compiling)
    executors = [ProcessPoolExecutor(1, context, _start_worker, start) for _ in range(workers)]
    dealer = Dealer(missing, range(workers))
    running: dict[Future[ShardLine], int] = {}
    try:
        while True:
            _hand_out(executors, dealer, running)
            if not running:
                break
            done, _ = concurrent.futures.wait(running, 1.0, concurrent.futures.FIRST_COMPLETED)
            if is_compiling.is_set():
                announce()
            for future in done:
                del running[future]
                line = future.result()
                count.add(line.n_frames)
                yield line
    except BrokenProcessPool:
        raise UserError(
            "a worker process died (it was killed, or memory ran out); run the same command to continue"
        ) from None
    finally:
        stop.send_bytes(b"stop")
        for executor in executors:
            executor.shutdown(wait=True, cancel_futures=True)


def _hand_out(executors: list[ProcessPoolExecutor], dealer: Dealer, running: dict[Future[ShardLine], int]) -> None:
    """Gives every worker shards until it has enough in flight, or none is left."""
    with _interrupts_ignored():
        for worker, executor in enumerate(executors):
            for _ in range(IN_FLIGHT - list(running.values()).count(worker)):
                if (shard := dealer.next_for(worker)) is not None:
                    running[executor.submit(_work, shard)] = worker


@contextlib.contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Processes started in here do not see Ctrl-C, which is this process's to handle."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


class _StoppedError(Exception):
    """The parent gave up; the shard at hand is not finished."""


_worker: tuple[Path, Header, FrameSource, Connection] | None = None


def _start_worker(root: Path, header: Header, order: Order, stop_seen: Connection, is_compiling: Event) -> None:
    global _worker  # noqa: PLW0603 - what a worker process keeps between its shards
    CompileWatch(is_compiling.set).start()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _worker = (root, header, order.make_source(), stop_seen)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    multiprocessing.connection.wait([parent.sentinel])
    os._exit(1)


def _work(shard: int) -> ShardLine:
    assert _worker is not None
    root, header, source, stop_seen = _worker

    def end_if_stopped() -> None:
        if stop_seen.poll():
            raise _StoppedError

    return write_shard(root, header, source, shard, on_frame=end_if_stopped)
