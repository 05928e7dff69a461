"""A corpus made by the workers of a Dask scheduler has the bytes of one made without, whatever happens to them."""

import dataclasses
import errno
import functools
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from toy_source import ToySource

from pipelines.cli import main
from pipelines.cluster.likeness import Likeness, refuse_unlike
from pipelines.cluster.shards import puts_on, shards_on
from pipelines.corpus import Corpus, Order, write_corpus
from pipelines.corpus.faults import faults
from pipelines.corpus.remote.writing import write_remote_corpus
from pipelines.engine import cluster as engine
from pipelines.errors import UserError

pytestmark = pytest.mark.filterwarnings("ignore")  # of Dask itself
FULL = "full"


class FillingSource(ToySource):
    """A disk is full on the worker that draws a late frame, as long as a file says so."""

    def __init__(self, flag):
        super().__init__(3, 200)
        self.flag = flag

    def frame(self, index):
        if index == 190 and self.flag.exists():
            raise OSError(errno.ENOSPC, "No space left on device", "somewhere")
        return super().frame(index)


class OtherSource(ToySource):
    """Draws something else on every process but one."""

    def __init__(self, pid):
        super().__init__(3 if os.getpid() == pid else 4, 200)
        self.pid = pid

    def frame(self, index):
        frame = super().frame(index)
        return dataclasses.replace(frame, info=dataclasses.replace(frame.info, seed=3))


def test_two_workers_give_the_bytes_of_none(cluster, order, toy_corpus, tmp_path, bytes_of):
    told = []
    write_corpus(tmp_path / "c", order(), progress=lambda *n: told.append(n), runner=shards_on(cluster))
    assert bytes_of(tmp_path / "c") == bytes_of(toy_corpus.path)
    assert told[0] == (0, 0)
    assert told[-1] == (200, 0)


def test_workers_put_a_corpus_to_a_url_without_a_common_folder(cluster, bucket, order, toy_corpus):
    if bucket is None:
        pytest.skip("moto or s3fs is not installed")
    write_remote_corpus(f"{bucket}/c", order(), runner=puts_on(cluster))
    corpus = Corpus.open(f"{bucket}/c")
    assert corpus.digest == toy_corpus.digest
    assert list(faults(corpus)) == []


def test_a_run_goes_on_with_the_shards_that_are_missing(cluster, order, toy_corpus, tmp_path, bytes_of):
    root = tmp_path / "c"
    write_corpus(root, order())
    (root / "frames" / "000001.jsonl").unlink()
    told = []
    write_corpus(root, order(), progress=lambda *n: told.append(n), runner=shards_on(cluster))
    assert told == [(136, 136), (200, 136)]
    assert bytes_of(root) == bytes_of(toy_corpus.path)


def test_a_killed_worker_costs_the_work_in_hand_alone(cluster, tmp_path, order, bytes_of):
    plain, root = tmp_path / "plain", tmp_path / "c"
    write_corpus(plain, order(320))
    pids = cluster._client.run(os.getpid)
    left = list(pids.values())[:1]

    def kill_one(n_done, _):
        if n_done and left:
            os.kill(left.pop(), signal.SIGKILL)

    write_corpus(root, order(320, pause=0.004), progress=kill_one, runner=shards_on(cluster))
    assert not left
    assert bytes_of(root) == bytes_of(plain)
    cluster._client.wait_for_workers(2, timeout=30)


def test_a_full_disk_on_a_worker_is_one_sentence_and_the_run_can_go_on(cluster, toy_corpus, tmp_path, bytes_of):
    flag, root = tmp_path / FULL, tmp_path / "c"
    flag.touch()
    order = Order(3, 200, {"toy": True, "pause": 0}, functools.partial(FillingSource, flag))
    with pytest.raises(UserError, match=r"on the worker tcp://.*, the disk that holds somewhere is full"):
        write_corpus(root, order, runner=shards_on(cluster))
    flag.unlink()
    write_corpus(root, order, runner=shards_on(cluster))
    assert bytes_of(root) == bytes_of(toy_corpus.path)


def test_workers_that_draw_other_bytes_are_refused(cluster, tmp_path):
    order = Order(3, 200, {"toy": True}, functools.partial(OtherSource, os.getpid()))
    with pytest.raises(UserError, match=r"the worker tcp://\S+ \(processor .*\) gives other bytes"):
        write_corpus(tmp_path / "c", order, runner=shards_on(cluster))


def test_workers_of_another_version_are_refused():
    here = Likeness({"numpy": "2.4.6", "source": "abc"}, "f0", "znver4")
    refuse_unlike(here, here, "tcp://a:1")
    other = dataclasses.replace(here, software={"numpy": "2.0.0", "source": "abc"})
    with pytest.raises(UserError, match=r"the worker tcp://a:1 has numpy 2\.0\.0, the command has 2\.4\.6"):
        refuse_unlike(other, here, "tcp://a:1")


def test_no_scheduler_there_is_told_at_once(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(engine, "CONNECT_S", 0.5)
    words = ["generate", str(tmp_path / "c"), "--frames", "1"]
    assert main([*words, "--scheduler", "tcp://127.0.0.1:9"]) == 1
    assert "--scheduler tcp://127.0.0.1:9: no scheduler answers there" in capsys.readouterr().err
    assert main([*words, "--scheduler", "local:0"]) == 1
    assert "the number of workers must be in 1..256" in capsys.readouterr().err
    assert main([*words, "--scheduler", "local:2", "--workers", "2"]) == 1
    assert "--workers counts processes of this machine" in capsys.readouterr().err
    assert not (tmp_path / "c").exists()


PATH = os.pathsep.join([str(Path(__file__).parents[3]), str(Path(__file__).parents[1])])


def start(*words):
    """A process of Dask that can run this program and the toys of the tests."""
    environment = {**os.environ, "PYTHONPATH": PATH}
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *words, "--no-dashboard"],
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )


def end(*processes):
    for process in processes:
        process.kill()
        process.wait()
        process.stderr.close()


@pytest.fixture
def scheduler():
    """A scheduler in a process of its own, and its address."""
    process = start("scheduler", "--host", "127.0.0.1", "--port", "0")
    address = next(line.split()[-1] for line in process.stderr if "Scheduler at:" in line)
    yield process, address
    end(process)


def test_a_scheduler_without_workers_is_told_of(scheduler, monkeypatch):
    monkeypatch.setattr(engine, "WAIT_S", 0.5)
    with pytest.raises(UserError, match="has had no worker for"), engine.open_cluster(scheduler[1]):
        raise AssertionError("opened")


def test_workers_of_several_threads_are_refused(scheduler):
    worker = start("worker", scheduler[1], "--nthreads", "2", "--no-nanny")
    with pytest.raises(UserError, match="has 2 threads; start workers with --nthreads 1"):
        engine.open_cluster(scheduler[1]).__enter__()
    end(worker)


def test_a_scheduler_that_dies_is_told_of_and_the_run_can_go_on(scheduler, tmp_path, order, toy_corpus, bytes_of):
    process, address = scheduler
    worker = start("worker", address, "--nthreads", "1", "--no-nanny")

    def kill(n_done, _):
        if n_done:
            process.kill()

    with engine.open_cluster(address) as opened, pytest.raises(UserError, match="scheduler"):
        write_corpus(tmp_path / "c", order(pause=0.01), progress=kill, runner=shards_on(opened))
    end(worker)
    write_corpus(tmp_path / "c", order())
    assert bytes_of(tmp_path / "c") == bytes_of(toy_corpus.path)
