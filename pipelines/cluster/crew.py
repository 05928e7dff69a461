"""The workers of a cluster as a crew of `forests.growing`: arrays go to files that all map, functions to workers."""

import contextlib
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np

from forests.growing import Call
from forests.samples import Layer, TrainingSet, refuse_nothing
from pipelines.cluster.gathering import GatherJob, digest_of_frame, gather_piece, joined_pieces
from pipelines.cluster.likeness import Likeness, likeness_of_growing, refuse_unlike
from pipelines.corpus.joined import FrameChoice
from pipelines.engine.cluster import Cluster, this_worker

_CALLS_A_WORKER = 2


class ArrayFile(NamedTuple):
    """An array in a file: raw values, row-major."""

    path: Path
    dtype: str
    shape: tuple[int, ...]

    def map(self) -> np.ndarray:
        """The array; it can be written to, which does not change the file."""
        if 0 in self.shape:
            return np.empty(self.shape, self.dtype)
        return np.memmap(self.path, self.dtype, "c", shape=self.shape).view(np.ndarray)


@dataclass(frozen=True)
class SharedRecords:
    """Records whose arrays lie in files.

    Attributes:
        records: Each as its type and the files of its arrays, or its other values.
        likeness: What a worker must agree with.
    """

    records: tuple[tuple[type, tuple[Any, ...]], ...]
    likeness: Likeness


class ClusterCrew:
    """Workers that map one folder; a context manager that removes the folder.

    Args:
        cluster: The workers.
        folder: Made when it is needed; what an interrupted run left there is removed. All workers must see it.
        choice: The training frames.
    """

    def __init__(self, cluster: Cluster, folder: Path, choice: FrameChoice) -> None:
        self._cluster, self._folder, self._choice = cluster, folder, choice
        self._kept: dict[int, tuple[np.ndarray, ArrayFile]] = {}
        self._n_files = 0
        self._likeness: Likeness | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)

    @property
    def n_calls(self) -> int:
        """Calls that keep all workers busy."""
        return _CALLS_A_WORKER * max(len(self._cluster.workers), 1)

    def gather(
        self,
        layer: Layer,
        n_body_pixels: int,
        n_occluder_pixels: int,
        seed: int,
        on_frames: Callable[[int], object],
    ) -> TrainingSet:
        """As `forests.growing.Crew` has it."""
        self._begin()
        frames = self._choice.frames()
        job = GatherJob(
            self._folder,
            self._choice,
            len(frames),
            digest_of_frame(frames),
            layer,
            n_body_pixels,
            n_occluder_pixels,
            seed,
        )
        for _, n in self._cluster.run(partial(gather_piece, job), range(job.n_pieces), "gather"):
            on_frames(n)
        training = joined_pieces(job)
        refuse_nothing(training.samples, len(frames), layer)
        pixels = training.crops.pixels
        self._keep(pixels, ArrayFile(self._folder / "pixels.raw", pixels.dtype.str, pixels.shape))
        for record in (training.crops, training.samples):
            for array in record:
                self._file_of(array, is_kept=True)
        return training

    @contextlib.contextmanager
    def sharing(self, *records: NamedTuple) -> Iterator[Call]:
        """As `forests.growing.Crew` has it."""
        self._begin()
        written: list[Path] = []
        shared = SharedRecords(
            tuple((type(record), tuple(self._shared(value, written) for value in record)) for record in records),
            self._likeness or likeness_of_growing(),
        )
        self._likeness = shared.likeness
        try:
            yield partial(self._call, shared)
        finally:
            for path in written:
                path.unlink(missing_ok=True)

    def _call(self, shared: SharedRecords, function: Callable[..., Any], *arguments: object) -> Any:
        return self._cluster.call(call_on_records, shared, function, *arguments, name=function.__name__.strip("_"))

    def _begin(self) -> None:
        if not self._n_files and not self._kept:
            shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True, exist_ok=True)

    def _shared(self, value: Any, written: list[Path]) -> Any:
        if not isinstance(value, np.ndarray):
            return value
        is_known = id(value) in self._kept
        file = self._file_of(value)
        if not is_known:
            written.append(file.path)
        return file

    def _file_of(self, array: np.ndarray, is_kept: bool = False) -> ArrayFile:
        """The file of an array, written now unless it was kept."""
        if id(array) in self._kept:
            return self._kept[id(array)][1]
        self._n_files += 1
        file = ArrayFile(self._folder / f"array-{self._n_files:06d}.raw", array.dtype.str, array.shape)
        np.ascontiguousarray(array).tofile(file.path)
        if is_kept:
            self._keep(array, file)
        return file

    def _keep(self, array: np.ndarray, file: ArrayFile) -> None:
        """Remembers the file of an array, which is held so that no other takes its identity."""
        self._kept[id(array)] = array, file


def call_on_records(shared: SharedRecords, function: Callable[..., Any], *arguments: object) -> Any:
    """Runs a function on a worker, its first arguments mapped from files.

    Raises:
        UserError: The worker differs from the command's process.
    """
    _refuse_unlike_worker(shared.likeness.frames, shared)
    return function(*_mapped(shared.records), *arguments)


@lru_cache(maxsize=2)
def _mapped(records: tuple[tuple[type, tuple[Any, ...]], ...]) -> tuple[Any, ...]:
    return tuple(
        kind(*(value.map() if isinstance(value, ArrayFile) else value for value in values))
        for kind, values in records
    )


_alike: set[str] = set()
"""Digests of trees that this worker process was found to grow."""


def _refuse_unlike_worker(name: str, shared: SharedRecords) -> None:
    if name not in _alike:
        refuse_unlike(likeness_of_growing(), shared.likeness, this_worker())
        _alike.add(name)
