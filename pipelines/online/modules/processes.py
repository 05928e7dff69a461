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

HANG_S = 1.0
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
class _Module:
    """A module and its process; times are of `time.monotonic` [s]."""

    settings: ModuleSettings
    process: BaseProcess | None = None
    connection: Connection | None = None
    since: float = 0.0
    is_ready: bool = False
    was_ready: bool = False
    n_failed: int = 0
    restart_at: float = 0.0
    in_hand: Work | None = None
    pending: Work | None = None

    @property
    def is_down(self) -> bool:
        """Whether it stays down."""
        return self.n_failed >= N_TRIES and not self.was_ready


class ProcessModules:
    """Runs each module in a process of its own.

    Attributes:
        settings: The modules.
    """

    def __init__(self, settings: tuple[ModuleSettings, ...]) -> None:
        """Starts all processes; `wait_ready` waits until their models are open."""
        self.settings = settings
        self._context = multiprocessing.get_context("spawn")
        self._modules = {one.name: _Module(one) for one in settings}
        # Each module reads one image and has one in its queue; one more is being written.
        self._ring = FrameRing(2 * len(settings) + 1)
        self._results: list[Result] = []
        self._notices: list[Notice] = []
        for module in self._modules.values():
            self._start(module)

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
        process = self._modules[name].process
        return None if process is None else process.pid

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
        """Whether answers are still to come."""
        return any(
            module.in_hand is not None or (module.pending is not None and not module.is_down)
            for module in self._modules.values()
        )

    def close(self) -> None:
        """Ends all processes and frees the memory."""
        for module in self._modules.values():
            if module.connection is not None and module.is_ready:
                with contextlib.suppress(OSError):
                    module.connection.send(None)
        for module in self._modules.values():
            if module.process is not None:
                module.process.join(0.5 if module.is_ready else 0.0)
            self._end_process(module)
        self._ring.close()

    def _start(self, module: _Module) -> None:
        connection, other = self._context.Pipe()
        module.process = self._context.Process(
            target=worker.run,
            args=(module.settings, other),
            name=f"undergrowth {module.settings.name}",
            daemon=True,
        )
        module.process.start()
        other.close()
        module.connection, module.since = connection, time.monotonic()

    def _hand_over(self, module: _Module) -> None:
        """Sends what waits, if the process is idle."""
        if not module.is_ready or module.in_hand is not None or module.pending is None:
            return
        assert module.connection is not None
        module.in_hand, module.pending, module.since = module.pending, None, time.monotonic()
        try:
            module.connection.send(module.in_hand)
        except OSError:
            self._fail(module, "ended unexpectedly")

    def _drop(self, module: _Module) -> None:
        if module.pending is not None:
            self._ring.release(module.pending.place)
            module.pending = None

    def _look(self, timeout_s: float) -> None:
        """Waits until a process says something, and takes it; restarts those whose time has come."""
        now = time.monotonic()
        for module in self._modules.values():
            if module.process is None and not module.is_down and now >= module.restart_at:
                self._start(module)
        by_connection = {m.connection: m for m in self._modules.values() if m.connection is not None}
        for connection in wait(list(by_connection), timeout_s):
            assert isinstance(connection, Connection)
            self._hear(by_connection[connection], connection)
        now = time.monotonic()
        for module in self._modules.values():
            if module.process is not None and now - module.since > self._allowed_s(module):
                self._fail(module, f"gave no answer for {now - module.since:.1f} s")

    def _allowed_s(self, module: _Module) -> float:
        """How long it may say nothing [s]."""
        if not module.is_ready:
            return OPEN_S
        if module.in_hand is None:
            return float("inf")
        return max(HANG_S, HANG_FACTOR * module.settings.cost_s * len(module.in_hand.job.requests))

    def _hear(self, module: _Module, connection: Connection) -> None:
        try:
            said = connection.recv()
        except (EOFError, OSError):
            self._fail(module, "ended unexpectedly")
            return
        if isinstance(said, Failed):
            self._fail(module, f"failed: {said.sentence}")
            return
        if isinstance(said, Ready):
            module.is_ready = module.was_ready = True
        elif isinstance(said, Answered):
            assert module.in_hand is not None
            self._ring.release(module.in_hand.place)
            module.in_hand, module.n_failed = None, 0
            self._results += said.results
        self._hand_over(module)

    def _fail(self, module: _Module, what: str) -> None:
        """Ends a process, loses the image in hand, and sees to it that the module comes back."""
        name = module.settings.name
        self._end_process(module)
        if module.in_hand is not None:
            self._ring.release(module.in_hand.place)
            module.in_hand = None
        module.n_failed += 1
        pause = min(FIRST_WAIT_S * 2 ** (module.n_failed - 2), LONGEST_WAIT_S) if module.n_failed > 1 else 0.0
        module.restart_at = time.monotonic() + pause
        if module.is_down:
            self._drop(module)
            sentence = f"module {name} {what}; it failed {N_TRIES} times before it was ready, and stays down"
            self._notices.append(Notice(f"module {name} is down", sentence))
        else:
            self._notices.append(Notice(f"module {name} failed", f"module {name} {what}; it is restarted"))

    def _end_process(self, module: _Module) -> None:
        if module.connection is not None:
            module.connection.close()
        if module.process is not None:
            if module.process.is_alive():
                module.process.kill()
            module.process.join(1.0)
            module.process.close()
        module.process, module.connection, module.is_ready = None, None, False
