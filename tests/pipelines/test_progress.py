"""A bar on a terminal, plain lines elsewhere."""

import io
from types import SimpleNamespace

import pytest

from pipelines import progress as module
from pipelines.progress import DELAY_S, LINE_S, Progress, progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


class Clock:
    def __init__(self):
        self.now = 100.0

    def monotonic(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(module, "time", clock)
    return clock


@pytest.fixture
def pipe(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(module, "sys", SimpleNamespace(stderr=stream))
    return stream


@pytest.fixture
def terminal(monkeypatch):
    stream = Terminal()
    monkeypatch.setattr(module, "sys", SimpleNamespace(stderr=stream))
    monkeypatch.setattr(module, "DELAY_S", 0.0)
    return stream


def test_short_work_is_silent_on_a_pipe(pipe, clock):
    for _ in progress(range(10), "frame", "generate"):
        clock.now += LINE_S / 11
    assert pipe.getvalue() == ""


def test_a_pipe_gets_a_plain_line_now_and_then(pipe, clock):
    with Progress(1000, "frame", "generate") as bar:
        for _ in range(100):
            clock.now += 1.0
            bar.update(10)
    lines = pipe.getvalue().splitlines()
    assert lines == [
        "generate: 300 of 1000 frames, 30 s, 70 s left",
        "generate: 600 of 1000 frames, 60 s, 40 s left",
        "generate: 900 of 1000 frames, 90 s, 10 s left",
    ]
    assert "".join(lines).isprintable()


def test_what_an_earlier_run_has_done_does_not_shorten_the_time_left(pipe, clock):
    with Progress(1000, "frame", "generate") as bar:
        bar.set_done(500, 500)
        clock.now += LINE_S
        bar.set_done(600, 500)
    assert pipe.getvalue() == "generate: 600 of 1000 frames, 30 s, 2 min left\n"


def test_nothing_is_said_about_the_time_left_before_anything_is_done(pipe, clock):
    with Progress(10, "frame") as bar:
        clock.now += LINE_S
        bar.update(0)
    assert pipe.getvalue() == "0 of 10 frames, 30 s\n"


def test_work_without_units_is_told_in_percent(pipe, clock):
    with Progress(name="train") as bar:
        clock.now += 100 * LINE_S
        bar.set_done(0.25)
        bar.set_done(0.1)
        bar.rename("score")
        clock.now += 300 * LINE_S
        bar.update(0.25)
    assert pipe.getvalue() == "train: 25 %, 50 min, 2.5 h left\nscore: 50 %, 3.3 h, 3.3 h left\n"


def test_the_end_is_left_to_the_command_to_tell(pipe, clock):
    with Progress(2, "file", "import") as bar:
        clock.now += LINE_S
        bar.update(2)
    assert pipe.getvalue() == ""


def test_a_terminal_gets_a_bar(terminal):
    assert list(progress([3, 1, 2], "image", "predict")) == [3, 1, 2]
    assert "predict: " in terminal.getvalue()
    assert "3/3" in terminal.getvalue()
    assert "image/s" in terminal.getvalue()


def test_a_terminal_gets_a_bar_of_shares(terminal):
    with Progress(name="train") as bar:
        bar.set_done(0.5)
        bar.rename("score")
        bar.set_done(1.0)
    assert "train:   0%|" in terminal.getvalue()
    assert "score: 100%|" in terminal.getvalue()
    assert " left" in terminal.getvalue()


def test_short_work_shows_no_bar(terminal, monkeypatch):
    monkeypatch.setattr(module, "DELAY_S", DELAY_S)
    list(progress(range(3), "image", "predict"))
    assert terminal.getvalue().strip() == ""


def test_the_bar_ends_with_an_exception_too(terminal):
    def interrupted():
        with Progress(3, "frame", "generate") as bar:
            bar.update()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert terminal.getvalue().endswith("\n")


def test_without_standard_error_nothing_is_told(monkeypatch, clock):
    monkeypatch.setattr(module, "sys", SimpleNamespace(stderr=None))
    with Progress(3, "frame", "generate") as bar:
        clock.now += LINE_S
        bar.update()
