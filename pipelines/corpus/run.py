"""Runs an order to its end: the missing shards one after another, in this process or in several."""

import concurrent.futures
import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event
from pathlib import Path

import numpy as np

from pipelines.compiling import CompileWatch, announce
from pipelines.corpus.folder import Order, finished_shards, locked_folder, prepare_folder
from pipelines.corpus.header import Header
from pipelines.corpus.manifest import ShardLine, append_line, rewrite_manifest
from pipelines.corpus.write import FrameSource, write_shard
from pipelines.errors import UserError, in_words

Progress = Callable[[int, int], object]
"""Called with the frames finished so far, those of earlier runs included, and those finished by earlier runs."""

_IN_FLIGHT = 2
"""Shards that a worker has at a time: one at work, one waiting."""


def write_corpus(root: Path, order: Order, workers: int = 1, progress: Progress | None = None) -> Header:
    """Makes the corpus ordered, going on where an earlier run of the same order stopped.

    Args:
        root: The folder; made if it is not there.
        order: What to make.
        workers: Processes; 1 works in this one. The files' bytes do not depend on it.
        progress: Told of every frame (one process) or shard (several).

    Returns:
        The finished corpus' header.

    Raises:
        UserError: The folder is another's or in use, the disk is full, or a worker died.
    """
    if workers < 1:
        raise UserError(f"workers={workers} must be at least 1")
    if root.exists() and not root.is_dir():
        raise UserError(f"{root} is a file, not a folder")
    try:
        root.mkdir(parents=True, exist_ok=True)
        with locked_folder(root):
            header = prepare_folder(root, order)
            lines = finished_shards(root, header)
            missing = [shard for shard in range(header.n_shards) if shard not in lines]
            count = _Counter(sum(line.n_frames for line in lines.values()), progress)
            if workers == 1 or len(missing) < 2:
                running = _in_this_process(root, header, order, missing, count)
            else:
                running = _in_processes(root, header, order, missing, min(workers, len(missing)), count)
            for line in running:
                append_line(root, line)
                lines[line.shard] = line
            rewrite_manifest(root, lines)
    except OSError as error:
        raise UserError(in_words(error, root)) from None
    return header


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
    """Hands shards to processes, two a worker in flight; only this process writes the manifest.

    Each worker goes through a run of neighbouring shards, because neighbours share subjects and objects; one that
    is through takes from the end of the longest run left.
    """
    context = multiprocessing.get_context("spawn")
    stop_seen, stop = context.Pipe(duplex=False)
    is_compiling = context.Event()
    start = (root, header, order, stop_seen, is_compiling)
    executors = [ProcessPoolExecutor(1, context, _start_worker, start) for _ in range(workers)]
    runs = [deque(run.tolist()) for run in np.array_split(np.array(missing, dtype=np.int64), workers)]
    running: dict[Future[ShardLine], int] = {}
    try:
        while True:
            _hand_out(executors, runs, running)
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


def _hand_out(
    executors: list[ProcessPoolExecutor], runs: list[deque[int]], running: dict[Future[ShardLine], int]
) -> None:
    """Gives every worker shards until two are in flight, or none is left."""
    with _interrupts_ignored():
        for worker, executor in enumerate(executors):
            for _ in range(2 - list(running.values()).count(worker)):
                if (shard := _next_shard(runs, worker)) is not None:
                    running[executor.submit(_work, shard)] = worker


def _next_shard(runs: list[deque[int]], worker: int) -> int | None:
    """The next shard of a worker's own run, else the last of the longest run."""
    if runs[worker]:
        return runs[worker].popleft()
    longest = max(runs, key=len)
    return longest.pop() if longest else None


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
