"""Shards of a corpus as tasks: each a function of the order and its number, which may run anywhere, and twice."""

import hashlib
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from pipelines.cluster.likeness import Likeness, likeness_of, refuse_unlike
from pipelines.corpus.folder import Order
from pipelines.corpus.header import HEADER_NAME, Header, read_header
from pipelines.corpus.manifest import ShardLine
from pipelines.corpus.remote.writing import RemoteRunner, put_shard
from pipelines.corpus.run import Runner
from pipelines.corpus.write import FrameSource, write_shard
from pipelines.engine.cluster import Cluster, this_worker
from pipelines.errors import CorpusError, UserError


@dataclass(frozen=True)
class ShardJob:
    """What the shards of one corpus have in common.

    Attributes:
        root: The corpus' folder, which all workers must see, or its URL.
        header: Of the corpus.
        order: Makes the frames.
        likeness: What a worker must agree with.
    """

    root: Path | str
    header: Header
    order: Order
    likeness: Likeness

    @property
    def name(self) -> str:
        """Differs for corpora of other settings, and for other folders."""
        return hashlib.sha256(f"{self.root}\0{self.header.digest}".encode()).hexdigest()[:16]


def shards_on(cluster: Cluster) -> Runner:
    """Makes the shards of `pipelines.corpus.write_corpus` on a cluster's workers."""

    def run(
        root: Path, header: Header, order: Order, missing: list[int], on_frames: Callable[[int], object]
    ) -> Iterator[ShardLine]:
        if not missing:
            return
        here = likeness_of(header, order.make_source())
        job = ShardJob(root.resolve(), header, order, here)
        for _, line in cluster.run(partial(make_shard, job), missing, f"shard-{job.name}"):
            on_frames(line.n_frames)
            yield line

    return run


def puts_on(cluster: Cluster) -> RemoteRunner:
    """Makes the shards of `pipelines.corpus.remote.writing` on a cluster's workers, which need no common folder."""

    def run(url: str, header: Header, order: Order, missing: list[int]) -> Iterator[ShardLine]:
        if not missing:
            return
        job = ShardJob(url, header, order, likeness_of(header, order.make_source()))
        for _, line in cluster.run(partial(make_shard, job), missing, f"shard-{job.name}"):
            yield line

    return run


_lock = threading.Lock()
_sources: dict[str, FrameSource] = {}
"""What a worker process keeps between its shards: the source of the last job."""


def make_shard(job: ShardJob, number: int) -> ShardLine:
    """Makes one shard on a worker that was found to be like the command's process.

    Raises:
        UserError: The worker differs, or does not see the folder.
    """
    with _lock:
        if isinstance(job.root, str):
            return put_shard(job.root, job.header, _source_of(job), number)
        return write_shard(job.root, job.header, _source_of(job), number)


def _source_of(job: ShardJob) -> FrameSource:
    if job.name not in _sources:
        if isinstance(job.root, Path):
            _refuse_other_folder(job.root, job.header)
        source = job.order.make_source()
        refuse_unlike(likeness_of(job.header, source), job.likeness, this_worker())
        _sources.clear()
        _sources[job.name] = source
    return _sources[job.name]


def _refuse_other_folder(root: Path, header: Header) -> None:
    try:
        is_same = read_header(root).digest == header.digest
    except CorpusError:
        is_same = False
    if not is_same:
        raise UserError(
            f"the worker {this_worker()} does not find {root / HEADER_NAME} as it was written; all workers must "
            "see the same folder, or give a URL"
        )
