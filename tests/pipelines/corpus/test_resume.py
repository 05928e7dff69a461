"""A run that was killed, cut or starved goes on and ends with the bytes of an undisturbed one."""

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pipelines.corpus import Corpus, write_corpus
from pipelines.corpus.folder import locked_folder
from pipelines.errors import UserError

SCRIPT = """
import sys
from pathlib import Path
sys.path[:0] = [{root!r}, {here!r}]
from conftest import toy_order
from pipelines.corpus import write_corpus
from pipelines.errors import UserError
if __name__ == "__main__":
    try:
        write_corpus(Path({out!r}), toy_order({n}, pause={pause}), workers={workers})
    except UserError as error:
        sys.exit(str(error))
"""


def start(out, n=200, pause=0.002, workers=1):
    here = Path(__file__).parents[1]
    root = str(here.parents[1])
    script = out.with_suffix(f".{workers}.py")
    script.write_text(SCRIPT.format(root=root, here=str(here), out=str(out), n=n, pause=pause, workers=workers))
    return subprocess.Popen([sys.executable, str(script)], stderr=subprocess.PIPE, text=True)


def wait_for_lines(out, n_lines, limit=30.0):
    end = time.monotonic() + limit
    manifest = out / "manifest.jsonl"
    while time.monotonic() < end:
        if manifest.exists() and manifest.read_bytes().count(b"\n") >= n_lines:
            return
        time.sleep(0.01)
    raise TimeoutError(f"{out} has no {n_lines} finished shards after {limit} s")


def children_of(pid):
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def command_of(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().decode()
    except OSError:
        return ""


def wait_for_end(pids, limit=10.0):
    """Workers end by themselves when their parent was killed; nothing of theirs is left to write."""
    end = time.monotonic() + limit
    while any(command_of(pid) for pid in pids):
        assert time.monotonic() < end, f"processes {pids} outlive their parent"
        time.sleep(0.01)


def test_the_bytes_do_not_depend_on_the_number_of_workers(tmp_path, order, toy_corpus, bytes_of):
    write_corpus(tmp_path / "two", order(), workers=2)
    assert bytes_of(tmp_path / "two") == bytes_of(toy_corpus.path)


@pytest.mark.parametrize(("workers", "kills"), [(1, (0, 2)), pytest.param(2, (1,), marks=pytest.mark.slow)])
def test_a_killed_run_goes_on_to_the_same_bytes(tmp_path, order, toy_corpus, bytes_of, workers, kills):
    out = tmp_path / "c"
    rng = random.Random(workers)
    for n_lines in kills:
        process = start(out, workers=workers, pause=0.005)
        if n_lines:
            wait_for_lines(out, n_lines)
        time.sleep(rng.uniform(0.0, 0.3) if n_lines else 1.0)
        children = children_of(process.pid)
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stderr.close()
        wait_for_end(children)
    write_corpus(out, order())
    assert bytes_of(out) == bytes_of(toy_corpus.path)


def test_cut_files_and_a_torn_manifest_are_made_again(tmp_path, order, toy_corpus, bytes_of):
    out = tmp_path / "c"
    write_corpus(out, order())
    manifest = out / "manifest.jsonl"
    lines = manifest.read_text().splitlines(keepends=True)
    manifest.write_text(lines[2] + lines[0] + lines[1][:70])
    shard = out / "arrays.zarr/depth/c/2/0/0"
    shard.write_bytes(shard.read_bytes()[:-9])
    (out / "arrays.zarr/depth/c/3/0/0.77.tmp").write_bytes(b"half")
    write_corpus(out, order())
    assert bytes_of(out) == bytes_of(toy_corpus.path)


def test_a_finished_corpus_is_left_as_it_is(tmp_path, order, bytes_of):
    out = tmp_path / "c"
    write_corpus(out, order(70))
    before = bytes_of(out)
    written = {path: path.stat().st_mtime_ns for path in out.rglob("depth/c/*/0/0")}
    seen = []
    write_corpus(out, order(70), progress=lambda done, earlier: seen.append((done, earlier)))
    assert seen == [(70, 70)]
    assert bytes_of(out) == before
    assert written == {path: path.stat().st_mtime_ns for path in out.rglob("depth/c/*/0/0")}


def test_another_corpus_or_foreign_files_are_not_touched(tmp_path, order, bytes_of):
    out = tmp_path / "c"
    write_corpus(out, order(5))
    before = bytes_of(out)
    with pytest.raises(UserError, match="other settings: n_frames is 5 there and 6 here"):
        write_corpus(out, order(6))
    changed = order(5)
    changed.config["toy"] = False
    with pytest.raises(UserError, match=r"config\.toy is True there and False here"):
        write_corpus(out, changed)
    assert bytes_of(out) == before
    foreign = tmp_path / "thesis"
    foreign.mkdir()
    (foreign / "thesis.tex").write_text("years")
    with pytest.raises(UserError, match=r"holds other files \(thesis.tex\)"):
        write_corpus(foreign, order(5))
    assert bytes_of(foreign) == {"thesis.tex": b"years"}


def test_other_software_does_not_go_on(tmp_path, order, monkeypatch):
    write_corpus(tmp_path / "c", order(5))
    monkeypatch.setattr("pipelines.corpus.header.platform.python_version", lambda: "3.99.0")
    with pytest.raises(UserError, match=r"software\.python is .* there and '3.99.0' here"):
        write_corpus(tmp_path / "c", order(5))


def test_two_runs_in_one_folder_are_refused(tmp_path, order):
    (tmp_path / "c").mkdir()
    with locked_folder(tmp_path / "c"), pytest.raises(UserError, match="being written by another command"):
        write_corpus(tmp_path / "c", order(5))


def test_a_killed_worker_is_told_and_the_run_goes_on(tmp_path, order, toy_corpus, bytes_of):
    out = tmp_path / "c"
    process = start(out, pause=0.02, workers=2)
    end = time.monotonic() + 30
    workers = []
    while len(workers) < 2 and time.monotonic() < end:
        workers = [pid for pid in children_of(process.pid) if "spawn_main" in command_of(pid)]
        time.sleep(0.02)
    time.sleep(0.5)
    os.kill(workers[0], signal.SIGKILL)
    _, message = process.communicate(timeout=30)
    assert process.returncode == 1
    assert message.strip().splitlines()[-1].startswith("a worker process died")
    write_corpus(out, order())
    assert bytes_of(out) == bytes_of(toy_corpus.path)


def test_a_full_disk_is_told_and_the_run_goes_on(tmp_path, order, toy_corpus, bytes_of):
    out = tmp_path / "c"
    write_corpus(out, order(200, pause=0))
    sizes = [len(path) for path in bytes_of(out).values()]
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    small = tmp_path / "small"
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (max(sizes) - 1, limit[1]))
        with pytest.raises(UserError, match="is full"):
            write_corpus(small, order())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, handler)
    assert not list(small.rglob("*.tmp"))
    with pytest.raises(UserError, match="unfinished"):
        Corpus.open(small)
    write_corpus(small, order())
    assert bytes_of(small) == bytes_of(toy_corpus.path)


def test_the_manifest_is_in_order_of_shards(toy_corpus):
    lines = (toy_corpus.path / "manifest.jsonl").read_text().splitlines()
    assert [json.loads(line)["shard"] for line in lines] == [0, 1, 2, 3]
