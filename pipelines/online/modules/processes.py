"""Modules in processes of their own, each with a queue of length one; who raises, hangs or is killed is restarted."""

import contextlib
import multiprocessing
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from pipelines.online.messages import CameraFrame, Notice, Result
from pipelines.online.modules import worker
from pipelines.online.modules.jobs import Job, ModuleSettings, Told
from pipelines.online.modules.ring import FrameRing
from pipelines.online.modules.worker import Answered, Failed, Ready, Work

HANG_S = 3.0
"""A job that takes longer than this, and 20 times as long as it should, hangs [s]."""
HANG_FACTOR = 20
OPEN_S = 120.0
"""Opening a model may take so long, since kernels may be compiled [s]."""
N_TRIES = 3
"""A module that could not be opened so often in a row stays down."""
FIRST_WAIT_S, LONGEST_WAIT_S = 0.25, 8.0
"""The second restart in a row waits, and each further one twice as long [s]."""
POLL_S = 0.05
"""How often clocks are looked at while waiting [s]."""


@dataclass
class _Worker:
    """A process and the connection to it; `since` is when it was told something last, of `time.monotonic` [s]."""

    process: BaseProcess
    connection: Connection
    since: float
    is_ready: bool = False

    def end(self) -> None:
        """Ends the process, at once if need be."""
        self.connection.close()
        if self.process.is_alive():
            self.process.kill()
        self.process.join(1.0)
        with contextlib.suppress(ValueError):  # on a busy machine it may not have ended yet
            self.process.close()


@dataclass
class _Module:
    """A module: the process that works, one that stands by with its model open, and what they are asked."""

    settings: ModuleSettings
    active: _Worker | None = None
    spare: _Worker | None = None
    was_ready: bool = False
    n_failed: int = 0
    restart_at: float = 0.0
    in_hand: Work | None = None
    pending: Work | None = None

    @property
    def is_ready(self) -> bool:
        """Whether it can be asked."""
        return self.active is not None and self.active.is_ready

    @property
    def is_down(self) -> bool:
        """Whether it stays down."""
        return self.n_failed >= N_TRIES and not self.was_ready

    @property
    def workers(self) -> list[_Worker]:
        """Its processes."""
        return [worker for worker in (self.active, self.spare) if worker is not None]


class ProcessModules:
    """Runs each module in a process of its own.

    Attributes:
        settings: The modules.
    """

    def __init__(self, settings: tuple[ModuleSettings, ...], has_spares: bool = True) -> None:
        """Starts all processes; `wait_ready` waits until their models are open.

        Args:
            settings: The modules.
            has_spares: Whether a second process of each module stands by with its model open, and takes over at
                once when the first ends. Otherwise a module is away until its model is opened anew.
        """
        self.settings = settings
        self._has_spares = has_spares
        self._context = multiprocessing.get_context("spawn")
        self._modules = {one.name: _Module(one) for one in settings}
        # Each module reads one image and has one in its queue; one more is being written.
        self._ring = FrameRing(2 * len(settings) + 1)
        self._results: list[Result] = []
        self._notices: list[Notice] = []
        for module in self._modules.values():
            module.active = self._started(module)

    def wait_ready(self) -> None:
        """Waits until every model is open.

        Raises:
            ValueError: One cannot be opened; says why.
        """
        while not all(module.is_ready for module in self._modules.values()):
            self._look(POLL_S)
            for name, module in self._modules.items():
                if module.n_failed and not module.was_ready:
                    sentence = self._notices[-1].sentence if self._notices else f"module {name} cannot be started"
                    self.close()
                    raise ValueError(sentence)

    def is_up(self, name: str) -> bool:
        """Whether a module has its model open and runs."""
        return self._modules[name].is_ready

    def process_id(self, name: str) -> int | None:
        """Of the process of a module; None while there is none."""
        active = self._modules[name].active
        return None if active is None else active.process.pid

    def submit(self, frame: CameraFrame, jobs: dict[str, Job]) -> None:
        """Asks modules about an image; what still waits for a module is dropped for it."""
        asked = {name: job for name, job in jobs.items() if job.requests}
        if not asked:
            return
        for name in asked:
            self._drop(self._modules[name])
        place = self._ring.write(frame.depth, len(asked))
        for name, job in asked.items():
            self._modules[name].pending = Work(job, place)
            self._hand_over(self._modules[name])

    def collect(self, timeout_s: float = 0.0) -> Told:
        """What modules have said; waits for the first word, but not longer than told."""
        end = time.monotonic() + timeout_s
        self._look(0.0)
        while not self._results and self.is_busy() and (left := end - time.monotonic()) > 0:
            self._look(min(left, POLL_S))
        told = Told(tuple(self._results), tuple(self._notices))
        self._results, self._notices = [], []
        return told

    def is_busy(self) -> bool:
        """Whether answers, or modules that are restarted, are still to come."""
        return any(
            not module.is_down
            and (module.in_hand is not None or module.pending is not None or not module.is_ready)
            for module in self._modules.values()
        )

    def close(self) -> None:
        """Ends all processes and frees the memory."""
        workers = [worker for module in self._modules.values() for worker in module.workers]
        for one in workers:
            if one.is_ready:
                with contextlib.suppress(OSError):
                    one.connection.send(None)
        for one in workers:
            one.process.join(0.5 if one.is_ready else 0.0)
            one.end()
        for module in self._modules.values():
            module.active = module.spare = None
        self._ring.close()

    def _started(self, module: _Module) -> _Worker:
        connection, other = self._context.Pipe()
        process = self._context.Process(
            target=worker.run,
            args=(module.settings, other),
            name=f"undergrowth {module.settings.name}",
            daemon=True,
        )
        process.start()
        other.close()
        return _Worker(process, connection, time.monotonic())

    def _hand_over(self, module: _Module) -> None:
        """Sends what waits, if the process is idle."""
        active = module.active
        if active is None or not active.is_ready or module.in_hand is not None or module.pending is None:
            return
        module.in_hand, module.pending, active.since = module.pending, None, time.monotonic()
        try:
            active.connection.send(module.in_hand)
        except OSError:
            self._fail(module, active, "ended unexpectedly")

    def _drop(self, module: _Module) -> None:
        if module.pending is not None:
            self._ring.release(module.pending.place)
            module.pending = None

    def _look(self, timeout_s: float) -> None:
        """Waits until a process says something, and takes it; starts those whose time has come."""
        self._start_due()
        owners = {one.connection: (m, one) for m in self._modules.values() for one in m.workers}
        for connection in wait(list(owners), timeout_s):
            assert isinstance(connection, Connection)
            self._hear(*owners[connection])
        now = time.monotonic()
        for module in self._modules.values():
            for one in module.workers:
                if now - one.since > self._allowed_s(module, one):
                    self._fail(module, one, f"gave no answer for {now - one.since:.1f} s")

    def _start_due(self) -> None:
        now = time.monotonic()
        for module in self._modules.values():
            if module.is_down or now < module.restart_at:
                continue
            if module.active is None:
                module.active = self._started(module)
            elif self._has_spares and module.spare is None and module.was_ready:
                module.spare = self._started(module)

    def _allowed_s(self, module: _Module, one: _Worker) -> float:
        """How long a process may say nothing [s]."""
        if not one.is_ready:
            return OPEN_S
        if one is module.spare or module.in_hand is None:
            return float("inf")
        return max(HANG_S, HANG_FACTOR * module.settings.cost_s * len(module.in_hand.job.requests))

    def _hear(self, module: _Module, one: _Worker) -> None:
        if one not in module.workers:
            return
        try:
            said = one.connection.recv()
        except (EOFError, OSError):
            self._fail(module, one, "ended unexpectedly")
            return
        if isinstance(said, Failed):
            self._fail(module, one, f"failed: {said.sentence}")
            return
        if isinstance(said, Ready):
            one.is_ready = module.was_ready = True
        elif isinstance(said, Answered):
            assert module.in_hand is not None
            self._ring.release(module.in_hand.place)
            module.in_hand, module.n_failed = None, 0
            self._results += said.results
        self._hand_over(module)

    def _fail(self, module: _Module, one: _Worker, what: str) -> None:
        """Ends a process, loses the image in hand, and sees to it that the module comes back."""
        name = module.settings.name
        one.end()
        module.n_failed += 1
        pause = min(FIRST_WAIT_S * 2 ** (module.n_failed - 2), LONGEST_WAIT_S) if module.n_failed > 1 else 0.0
        module.restart_at = time.monotonic() + pause
        if one is module.spare:
            module.spare = None
        else:
            module.active, module.spare = module.spare, None
            if module.in_hand is not None:
                self._ring.release(module.in_hand.place)
                module.in_hand = None
        if module.is_down:
            self._drop(module)
            sentence = f"module {name} {what}; it failed {N_TRIES} times before it was ready, and stays down"
            self._notices.append(Notice(f"module {name} is down", sentence))
        else:
            self._notices.append(Notice(f"module {name} failed", f"module {name} {what}; it is restarted"))
        self._hand_over(module)
