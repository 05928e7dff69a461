"""Modules in processes: newest image wins, faults of one do not touch the others, and all come back."""

import os
import signal
import time

import numpy as np
import pytest

from forests.frames import Intrinsics
from pipelines.online.messages import CameraFrame, Request
from pipelines.online.modules import processes
from pipelines.online.modules.jobs import Job, ModuleSettings
from pipelines.online.modules.processes import ProcessModules
from pipelines.online.modules.ring import FrameRing, Reader

KIND = "tests.pipelines.online.faulty:Obedient"
CAMERA = Intrinsics(100, 100, 32, 24)


def frame_of(stamp, shape=(48, 64)):
    return CameraFrame(stamp, "camera", np.full(shape, stamp, np.uint16), CAMERA)


def ask(modules, stamp, names, shape=(48, 64)):
    frame = frame_of(stamp, shape)
    box = (0.0, 0.0, 9.0, 9.0)
    jobs = {
        name: Job(
            stamp, "camera", CAMERA, np.eye(4), np.zeros((0, 3)), (Request(stamp, 7, name, box, box, np.zeros(3)),)
        )
        for name in names
    }
    modules.submit(frame, jobs)


def gather(modules, seconds):
    """All that is said until nobody is busy, or for so long."""
    results, notices, end = [], [], time.monotonic() + seconds
    while modules.is_busy() and time.monotonic() < end:
        told = modules.collect(0.05)
        results += told.results
        notices += told.notices
    return results, notices


@pytest.fixture
def started():
    running = []

    def start(has_spares=False, **models):
        modules = ProcessModules(
            tuple(ModuleSettings(name, KIND, model) for name, model in models.items()), has_spares
        )
        running.append(modules)
        modules.wait_ready()
        return modules

    yield start
    for modules in running:
        modules.close()


def test_every_module_reads_the_image_it_is_asked_about(started):
    modules = started(one="fine", two="fine")
    for stamp in range(1, 8):
        shape = (48, 64) if stamp < 4 else (60, 80)
        ask(modules, stamp, ["one", "two"], shape)
        results, notices = gather(modules, 5)
        assert {(r.module, r.stamp, r.angle) for r in results} == {
            (name, stamp, stamp * shape[0] * shape[1]) for name in ("one", "two")
        }
        assert not notices
    assert modules._ring.n_taken == 0


def test_the_newest_image_wins_and_no_queue_grows(started):
    modules = started(one="slow")
    for stamp in range(1, 20):
        ask(modules, stamp, ["one"])
    results, _ = gather(modules, 5)
    assert [r.stamp for r in results] == [1, 19]
    assert results[-1].angle == 19 * 48 * 64
    assert modules._ring.n_taken == 0


@pytest.mark.parametrize("fault", ["raise@3", "hang@3", "kill"])
def test_a_faulty_module_comes_back_while_the_others_go_on(started, fault, monkeypatch):
    monkeypatch.setattr(processes, "HANG_S", 0.3)
    modules = started(bad=fault if fault != "kill" else "fine", good="fine")
    answered = {"bad": [], "good": []}
    notices = []
    for stamp in range(1, 6):
        ask(modules, stamp, ["bad", "good"])
        if stamp == 3 and fault == "kill":
            os.kill(modules.process_id("bad"), signal.SIGKILL)
        end = time.monotonic() + 20
        while time.monotonic() < end:
            told = modules.collect(0.02)
            notices += told.notices
            for result in told.results:
                answered[result.module].append(result.stamp)
            # The newest image wins: one that comes before the last is answered may never be looked at.
            is_bad_done = stamp > 3 or bool(notices) or stamp in answered["bad"][-1:]
            if is_bad_done and stamp in answered["good"][-1:]:
                break
    assert answered["good"] == [1, 2, 3, 4, 5]
    ask(modules, 9, ["bad"])
    results, more = gather(modules, 30)
    assert [r.stamp for r in results][-1] == 9
    assert [n.kind for n in notices + more] == ["module bad failed"]
    assert modules._ring.n_taken == 0


def test_a_model_that_cannot_be_opened_is_said_at_the_start(started):
    with pytest.raises(ValueError, match="module one failed: ValueError: the model is broken"):
        started(one="unopenable")


def test_a_ring_never_writes_where_somebody_reads():
    ring, reader = FrameRing(3), Reader()
    try:
        first = ring.write(np.full((4, 5), 1, np.uint16), 1)
        second = ring.write(np.full((4, 5), 2, np.uint16), 1)
        for value in range(3, 9):
            ring.release(ring.write(np.full((4, 5), value, np.uint16), 1))
        assert (reader.read(first) == 1).all()
        assert (reader.read(second) == 2).all()
        larger = ring.write(np.full((40, 50), 9, np.uint16), 1)
        assert (reader.read(first) == 1).all()
        ring.release(first)
        ring.release(second)
        assert (reader.read(larger) == 9).all()
    finally:
        reader.close()
        ring.close()


def test_a_spare_takes_over_at_once(started):
    modules = started(has_spares=True, one="fine")
    end = time.monotonic() + 30
    while not (modules._modules["one"].spare and modules._modules["one"].spare.is_ready):
        modules.collect(0.05)
        assert time.monotonic() < end
        modules._look(0.05)
    first = modules.process_id("one")
    os.kill(first, signal.SIGKILL)
    for stamp in (1, 2):
        ask(modules, stamp, ["one"])
        results, _ = gather(modules, 30)
    assert [r.stamp for r in results] == [2]
    assert modules.process_id("one") not in (first, None)
