"""Compiling is told to the user, warm caches are not."""

import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
from numba import njit

from pipelines import compiling
from pipelines.compiling import CompileWatch, compiling_announced


def fresh_kernel():
    @njit
    def twice(values):
        return values * 2.0

    @njit
    def kernel(values):
        total = 0.0
        for value in twice(values):
            total += value
        return total

    return kernel


@pytest.fixture
def lines(capsys):
    def told():
        captured = capsys.readouterr()
        assert captured.out == ""
        return captured.err.splitlines()

    return told


def test_long_compiling_is_told_once_and_its_time_at_the_end(monkeypatch, lines):
    monkeypatch.setattr(compiling, "PATIENCE_S", 0.0)
    with compiling_announced():
        assert fresh_kernel()(np.ones(3)) == 6.0
        assert fresh_kernel()(np.ones(2)) == 4.0
    first, last = lines()
    assert first.startswith("compiling kernels, once per installation")
    assert last.startswith("compiling kernels took")


def test_short_compiling_is_not_told(monkeypatch, lines):
    monkeypatch.setattr(compiling, "PATIENCE_S", 3600.0)
    with compiling_announced():
        fresh_kernel()(np.ones(3))
    assert lines() == []


def test_compiled_kernels_are_not_told(monkeypatch, lines):
    monkeypatch.setattr(compiling, "PATIENCE_S", 0.0)
    kernel = fresh_kernel()
    kernel(np.ones(3))
    with compiling_announced():
        kernel(np.ones(3))
    assert lines() == []


def test_a_kernel_inside_a_kernel_is_counted_once():
    watch = CompileWatch(lambda: None)
    watch.start()
    begun = time.monotonic()
    fresh_kernel()(np.ones(3))
    elapsed = time.monotonic() - begun
    watch.stop()
    assert 0.0 < watch.seconds <= elapsed
    seconds = watch.seconds
    fresh_kernel()(np.ones(3))
    assert watch.seconds == seconds


SCRIPT = """
    import sys
    from pipelines import compiling
    compiling.PATIENCE_S = 0.0
    with compiling.compiling_announced():
        assert "numba" not in sys.modules
        {body}
    assert len([f for f in sys.meta_path if f.__class__.__module__ == "pipelines.compiling"]) == 0
"""


def run(body):
    script = textwrap.dedent(SCRIPT.format(body=body))
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stderr


def test_numba_is_watched_when_it_is_imported_later():
    out = run("import numba; numba.njit(lambda x: x + 1)(1); assert numba.__spec__.loader is numba.__loader__")
    assert [line.split(" ")[:2] for line in out.splitlines()] == [
        ["compiling", "kernels,"],
        ["compiling", "kernels"],
    ]


def test_numba_is_not_imported_for_this():
    assert run("pass; import numpy; assert 'numba' not in sys.modules") == ""


def test_what_workers_compile_is_announced_once(monkeypatch, lines):
    monkeypatch.setattr(compiling, "PATIENCE_S", 0.0)
    with compiling_announced():
        fresh_kernel()(np.ones(3))
        compiling.announce()
    assert len([line for line in lines() if "once per installation" in line]) == 1
