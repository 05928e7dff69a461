"""Tells the user when numba compiles kernels, which takes long once per installation."""

import contextlib
import functools
import importlib.abc
import importlib.machinery
import importlib.util
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from types import ModuleType
from typing import Any

PATIENCE_S = 1.0
"""Compiling that takes less is not worth a line."""


@contextlib.contextmanager
def compiling_announced() -> Iterator[None]:
    """Says when numba has compiled for a while, and at the end how long it did.

    numba is watched as soon as something imports it; it is not imported for that. Kernels that it reads from its
    cache are not compiled.
    """
    announce.cache_clear()
    watch = CompileWatch(announce)
    with _after_import("numba", watch.start):
        try:
            yield
        finally:
            watch.stop()
            if watch.is_told:
                _say(f"compiling kernels took {watch.seconds:.0f} s; the next run does not need it")


@functools.cache
def announce() -> None:
    """Says that kernels are being compiled, here or in a worker process: once in a command."""
    _say("compiling kernels, once per installation ...")


def _say(words: str) -> None:
    """Writes a line to standard error: standard output is for results, which other programs read."""
    if sys.stderr:
        sys.stderr.write(words + "\n")
        sys.stderr.flush()


class CompileWatch:
    """Adds up how long numba compiles.

    Args:
        tell: Called once, from any thread, when it has compiled for longer than `PATIENCE_S`.

    Attributes:
        seconds: Time spent on compiling, in any thread.
        is_told: Whether `tell` was called.
    """

    def __init__(self, tell: Callable[[], object]) -> None:
        self.seconds = 0.0
        self.is_told = False
        self._tell = tell
        self._lock = threading.RLock()
        self._n_open = 0
        self._begun = 0.0
        self._timer: threading.Timer | None = None
        self._listener: Any = None

    def start(self) -> None:
        """Begins to listen; imports numba."""
        from numba.core import event

        watch = self

        class Listener(event.Listener):
            def on_start(self, event: object) -> None:
                watch._compile_begun()

            def on_end(self, event: object) -> None:
                watch._compile_ended()

        self._listener = Listener()
        event.register("numba:compile", self._listener)

    def stop(self) -> None:
        """Listens no more."""
        if self._listener is not None:
            from numba.core import event

            event.unregister("numba:compile", self._listener)
            self._listener = None
        with self._lock:
            self._cancel_timer()

    def _compile_begun(self) -> None:
        with self._lock:
            self._n_open += 1
            if self._n_open > 1:  # a kernel that another one calls is compiled inside of it
                return
            self._begun = time.monotonic()
            if not self.is_told:
                self._timer = threading.Timer(max(0.0, PATIENCE_S - self.seconds), self._tell_once)
                self._timer.daemon = True
                self._timer.start()

    def _compile_ended(self) -> None:
        with self._lock:
            self._n_open -= 1
            if self._n_open == 0:
                self.seconds += time.monotonic() - self._begun
                if self.seconds >= PATIENCE_S:
                    self._tell_once()
                self._cancel_timer()

    def _cancel_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _tell_once(self) -> None:
        with self._lock:
            if self._timer is not None and not self.is_told:
                self.is_told = True
                self._tell()


@contextlib.contextmanager
def _after_import(name: str, then: Callable[[], object]) -> Iterator[None]:
    """Calls a function as soon as a module is imported, or at once if it is already."""
    if name in sys.modules:
        then()
        yield
        return
    finder = _Finder(name, then)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        finder.remove()


class _Finder(importlib.abc.MetaPathFinder):
    """Leaves finding one module to the finders after it, and learns when the module has been executed."""

    def __init__(self, name: str, then: Callable[[], object]) -> None:
        self._name = name
        self._then = then

    def remove(self) -> None:
        """Watches no more."""
        if self in sys.meta_path:
            sys.meta_path.remove(self)

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """The module's own spec, its loader wrapped."""
        if fullname != self._name:
            return None
        self.remove()
        spec = importlib.util.find_spec(fullname)
        if spec is not None and spec.loader is not None:
            spec.loader = _Loader(spec.loader, self._then)
        return spec


class _Loader(importlib.abc.Loader):
    """Loads a module with its own loader, gives it that loader back, and calls a function."""

    def __init__(self, own: importlib.abc.Loader, then: Callable[[], object]) -> None:
        self._own = own
        self._then = then

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> ModuleType | None:
        """As its own loader does."""
        return self._own.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        """As its own loader does, then the call."""
        assert module.__spec__ is not None
        module.__spec__.loader = module.__loader__ = self._own
        self._own.exec_module(module)
        self._then()
