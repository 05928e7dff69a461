"""The workers of a Dask scheduler. The only module that imports Dask."""

import contextlib
import logging
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Generic, TypeVar, cast

from pipelines.engine.dealing import IN_FLIGHT, Dealer
from pipelines.errors import UserError, in_words

T = TypeVar("T")

DROP_S = 15.0
"""How long tasks at work are waited for when a run has failed [s]."""
CONNECT_S = 10.0
"""How long a scheduler has to answer [s]."""
_RESULT_S = 300.0
"""How long what a finished task gave may be on its way [s]; a scheduler that is gone is known before."""
WAIT_S = 60.0
"""How long a scheduler may be without any worker [s]: at the start, and while work is left."""
_LOCAL = "local:"
MAX_LOCAL = 256
_AGAIN = "run the same command again to continue"

log = logging.getLogger(__name__)


@contextlib.contextmanager
def open_cluster(scheduler: str) -> Iterator["Cluster"]:
    """The workers of a scheduler; at least one is there.

    Args:
        scheduler: tcp://HOST:PORT (or tls://) of a scheduler that runs, or local:N for one with N workers that lives as
            long as this block.

    Raises:
        UserError: Dask is not installed, no scheduler answers, it has no workers, or they have several threads.
    """
    distributed = _dask()
    with contextlib.ExitStack() as stack:
        try:
            target = stack.enter_context(_local(scheduler)) if scheduler.startswith(_LOCAL) else scheduler
            client = stack.enter_context(distributed.Client(target, timeout=CONNECT_S))
        except (OSError, ValueError) as error:
            what = str(error) if isinstance(error, ValueError) else "no scheduler answers there"
            raise UserError(f"--scheduler {scheduler}: {what}") from None
        cluster = Cluster(client, scheduler)
        cluster.wait_for_workers()
        yield cluster


def _dask() -> Any:
    try:
        import distributed
    except ImportError:
        raise UserError("--scheduler needs Dask: pip install 'undergrowth[cluster]'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    return distributed


def _local(scheduler: str) -> Any:
    """A scheduler with workers of its own, one process each."""
    import distributed

    words = scheduler.removeprefix(_LOCAL)
    if not words.isdecimal() or not 1 <= int(words) <= MAX_LOCAL:
        raise ValueError(f"the number of workers must be in 1..{MAX_LOCAL}, such as local:4")
    return distributed.LocalCluster(
        n_workers=int(words),
        threads_per_worker=1,
        memory_limit=0,
        dashboard_address="127.0.0.1:0",  # any free port
        silence_logs=logging.CRITICAL,
    )


class Cluster:
    """Workers that tasks are handed to.

    Args:
        client: Of the scheduler.
        name: What the user calls it.
    """

    def __init__(self, client: Any, name: str) -> None:
        self._client = client
        self._name = name

    @property
    def workers(self) -> list[str]:
        """Addresses of the workers that are there now, in order.

        Raises:
            UserError: The scheduler is gone, or a worker has several threads.
        """
        if self._client.status != "running":
            raise UserError(f"the scheduler {self._name} is gone; start it, and {_AGAIN}")
        listed = self._client.scheduler_info(n_workers=-1)["workers"]
        for address, worker in listed.items():
            if worker["nthreads"] != 1:
                raise UserError(
                    f"the worker {address} has {worker['nthreads']} threads; start workers with --nthreads 1, "
                    "one for each core (dask worker --nworkers N --nthreads 1)"
                )
        return sorted(listed)

    def wait_for_workers(self) -> list[str]:
        """Addresses of the workers, once there are any.

        Raises:
            UserError: None comes.
        """
        end = time.monotonic() + WAIT_S
        while not (workers := self.workers):
            if time.monotonic() > end:
                raise UserError(
                    f"the scheduler {self._name} has had no worker for {WAIT_S:.0f} s; start some, and {_AGAIN}"
                )
            time.sleep(0.2)
        return workers

    def run(self, task: Callable[[int], T], numbers: Sequence[int], name: str) -> Iterator[tuple[int, T]]:
        """Runs numbered tasks; one whose worker dies runs again on another.

        Args:
            task: What to do for a number; can be pickled, and may be run twice.
            numbers: Which, neighbours together where they share something.
            name: Of the work, as the dashboard shows it.

        Yields:
            (number, what the task gave), in any order.

        Raises:
            UserError: A task failed, or scheduler or workers are gone.
        """
        hand = _Hand(self, self._client, task, Dealer(numbers, self.wait_for_workers()), name)
        try:
            while hand.fill():
                for future, number in hand.finished():
                    yield number, _result(future)
        finally:
            hand.drop()

    def call(self, task: Callable[..., T], *arguments: object, name: str) -> T:
        """Runs a task on any worker and waits for what it gives; several threads may call at a time.

        Args:
            task: What to do; can be pickled, and may be run twice.
            arguments: Of the task.
            name: Of the work, as the dashboard shows it.

        Raises:
            UserError: The task failed, or scheduler or workers are gone.
        """
        import distributed

        future = self._client.submit(Called(task), *arguments, key=f"{name}-{uuid.uuid4().hex}")
        while not (future.done() or future.status == "lost"):
            with contextlib.suppress(TimeoutError):
                distributed.wait([future], timeout=1.0)
            self.wait_for_workers()
        return cast("T", _result(future))


class _Hand(Generic[T]):
    """What is in flight: so many tasks a worker, each meant for one and allowed to others."""

    def __init__(self, cluster: Cluster, client: Any, task: Callable[[int], T], dealer: Dealer, name: str) -> None:
        self._cluster, self._client, self._dealer = cluster, client, dealer
        self._name = f"{name}-{uuid.uuid4().hex[:8]}"  # what failed in an earlier run is not taken for this one's
        self._task = Called(task)
        self._running: dict[Any, tuple[str, int]] = {}

    def fill(self) -> bool:
        """Hands out tasks until every worker has enough; whether any is in flight."""
        counts = dict.fromkeys(self._cluster.wait_for_workers(), 0)
        for worker, _ in self._running.values():
            counts[worker] = counts.get(worker, 0) + 1
        for worker in self._cluster.workers:
            for _ in range(IN_FLIGHT - counts.get(worker, 0)):
                if (number := self._dealer.next_for(worker)) is None:
                    return bool(self._running)
                future = self._client.submit(
                    self._task, number, key=f"{self._name}-{number}", workers=[worker], allow_other_workers=True
                )
                self._running[future] = worker, number
        return bool(self._running)

    def finished(self) -> list[tuple[Any, int]]:
        """Tasks that have ended since, after waiting for a while at most."""
        import distributed

        with contextlib.suppress(TimeoutError):
            distributed.wait(list(self._running), timeout=1.0, return_when="FIRST_COMPLETED")
        ended = [future for future in self._running if future.done() or future.status == "lost"]
        return [(future, self._running.pop(future)[1]) for future in ended]

    def drop(self) -> None:
        """Forgets what is in flight; those that wait are not begun, and tasks at work end before this returns.

        Otherwise a next run in the same folder would meet the files that they are writing. A worker has one thread,
        so that it comes to the task that does nothing when it has ended the one at work.
        """
        import distributed

        if self._running and self._client.status == "running":
            with contextlib.suppress(Exception):
                self._client.cancel(list(self._running), force=True)
                ends = [
                    self._client.submit(_nothing, key=f"{self._name}-end-{k}", workers=[worker])
                    for k, worker in enumerate(self._cluster.workers)
                ]
                distributed.wait(ends, timeout=DROP_S)


def _nothing() -> None:
    pass


class Called(Generic[T]):
    """A task as a worker runs it: errors of the system become one sentence that names the worker.

    Args:
        task: What is called.
    """

    def __init__(self, task: Callable[..., T]) -> None:
        self._task = task

    def __call__(self, *arguments: object) -> T:
        """Runs it."""
        try:
            return self._task(*arguments)
        except OSError as error:
            raise UserError(f"on the worker {this_worker()}, {in_words(error)}") from None
        except MemoryError:
            raise UserError(f"on the worker {this_worker()}, there is not enough memory") from None


def this_worker() -> str:
    """Address of the worker that runs this; "here" if none does."""
    import distributed

    try:
        return str(distributed.get_worker().address)
    except ValueError:
        return "here"


def _result(future: Any) -> Any:
    """What a task gave.

    Raises:
        UserError: It failed.
    """
    import distributed

    try:
        return future.result(timeout=_RESULT_S)
    except UserError:
        raise
    except distributed.KilledWorker:
        raise UserError(
            f"workers died on the same task again and again (memory ran out?); give them more, and {_AGAIN}"
        ) from None
    except (ImportError, AttributeError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and "deserialization" not in str(error):
            raise
        cause = error.__cause__ or error
        raise UserError(
            f"the scheduler or a worker cannot run this program ({cause}); install the same version on all"
        ) from None
    except (distributed.CancelledError, TimeoutError, OSError):
        raise UserError(f"the connection to the scheduler was lost; start it, and {_AGAIN}") from None
