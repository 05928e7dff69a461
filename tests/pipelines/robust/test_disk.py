"""What the disk says reaches the user in plain words, with the name of the file."""

import errno
import fcntl
import os
import resource
import subprocess
import sys
import threading

import pytest

from pipelines.cli import main
from pipelines.errors import UserError, in_words
from pipelines.export import write as export_write
from pipelines.export.write import EXPORTERS, export
from pipelines.models.checkpoints import drop_trees
from storage.atomic import append, write_atomically


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (errno.ENOSPC, "the disk that holds /a/b is full (No space left on device)"),
        (errno.EACCES, "/a/b cannot be used: permission denied"),
        (errno.ENOENT, "there is no file or folder /a/b"),
        (errno.EROFS, "/a/b cannot be written: the disk is read-only"),
        (errno.EIO, "/a/b cannot be used: Input/output error"),
    ],
)
def test_errors_of_the_system_are_sentences(code, words, monkeypatch, toy_corpus, capsys):
    def fail(self):
        raise OSError(code, os.strerror(code), "/a/b")

    assert in_words(OSError(code, os.strerror(code)), "/a/b").startswith(words)
    monkeypatch.setattr("pipelines.commands.verify.VerifySettings.run", fail)
    assert main(["verify", str(toy_corpus.path)]) == 1
    err = capsys.readouterr().err
    assert err.startswith(f"undergrowth: error: {words}")
    assert err.count("\n") == 1


def test_memory_that_runs_out_is_one_line(monkeypatch, toy_corpus, capsys):
    def fail(self):
        raise MemoryError

    monkeypatch.setattr("pipelines.commands.verify.VerifySettings.run", fail)
    assert main(["verify", str(toy_corpus.path)]) == 1
    assert "not enough memory" in capsys.readouterr().err


def limited(n_bytes):
    """Files may not grow beyond a size, in the process to be started, and the signal for it is an error."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, n_bytes))

    return limit


@pytest.mark.parametrize("to", list(EXPORTERS))
def test_an_export_that_does_not_fit_is_one_line_and_leaves_nothing(to, toy_corpus, tmp_path):
    words = ["export", str(toy_corpus.path), "--to", to, "--out", str(tmp_path / "out")]
    code = "import sys, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); from pipelines.cli import main; "
    code += f"sys.exit(main({words!r}))"
    done = subprocess.run(
        [sys.executable, "-c", code], preexec_fn=limited(1000), capture_output=True, text=True, check=False
    )
    assert done.returncode == 1, done.stderr
    assert done.stderr.startswith("undergrowth: error: ")
    assert done.stderr.count("\n") == 1
    assert str(tmp_path / "out") in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_rows_that_do_not_fit_name_their_file(tmp_path):
    code = f"""
import signal
from pathlib import Path
from storage.atomic import replacing
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
import numpy as np
try:
    with replacing(Path({str(tmp_path / "rows.npz")!r})) as file:
        np.savez(file, a=np.arange(1000))
except OSError as error:
    print(error.filename)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], preexec_fn=limited(1000), capture_output=True, text=True, check=False
    )
    assert (done.stdout.strip(), done.stderr) == (str(tmp_path / "rows.npz"), "")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OSError, match=r"Is a directory") as caught:
        append(tmp_path, "x")
    assert caught.value.filename == str(tmp_path)


def test_two_exports_into_one_folder_are_one(toy_corpus, tmp_path, monkeypatch):
    is_begun, may_end = threading.Event(), threading.Event()

    def waiting(job):
        is_begun.set()
        assert may_end.wait(20)
        (job.folder / "whole").write_text("x")

    monkeypatch.setitem(export_write.EXPORTERS, "coco", waiting)
    first = threading.Thread(target=export, args=(toy_corpus, "coco", tmp_path / "out", ("val",)))
    first.start()
    assert is_begun.wait(20)
    with pytest.raises(UserError, match="is being written by another command"):
        export(toy_corpus, "coco", tmp_path / "out", ("val",))
    may_end.set()
    first.join()
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["whole"]
    with pytest.raises(UserError, match="is not empty; choose a new or empty folder"):
        export(toy_corpus, "coco", tmp_path / "out", ("val",))
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_export_that_was_killed_is_made_again(toy_corpus, tmp_path):
    beside = tmp_path / "out.undergrowth-export.tmp"
    (beside / "depth").mkdir(parents=True)
    (beside / "half").write_text("x")
    (tmp_path / "out.part").mkdir()
    assert export(toy_corpus, "webdataset", tmp_path / "out", ("val",)) == 30
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "out.part"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["val-000000.tar"]


def test_trees_beside_a_finished_model_are_dropped(tmp_path):
    folder = tmp_path / "m.partial"
    drop_trees(folder)
    folder.mkdir()
    (folder / "tree_000.safetensors").write_text("x")
    drop_trees(folder)
    assert list(tmp_path.iterdir()) == []
    folder.mkdir()
    (folder / "mine").write_text("x")
    drop_trees(folder)
    assert [path.name for path in folder.iterdir()] == ["mine"]


def test_a_folder_that_was_renamed_meanwhile_is_not_written(tmp_path, monkeypatch):
    from pipelines.corpus.folder import locked_folder

    def renamed(handle, how):
        (tmp_path / "a").rename(tmp_path / "b")

    (tmp_path / "a").mkdir()
    monkeypatch.setattr(fcntl, "flock", renamed)
    with pytest.raises(UserError, match="has just been written by another command"), locked_folder(tmp_path / "a"):
        pass


def test_a_library_that_may_not_be_read_is_not_missing(tmp_path, monkeypatch, capsys):
    path = tmp_path / "lib"
    write_atomically(path, b"x" * 100)

    def refuse(self, *words, **more):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))

    monkeypatch.setattr(type(path), "open", refuse)
    assert main(["generate", str(tmp_path / "c"), "--frames", "2", "--poses", str(path)]) == 1
    assert f"{path} cannot be used: permission denied" in capsys.readouterr().err
    monkeypatch.undo()
    assert main(["generate", str(tmp_path / "c"), "--frames", "2", "--poses", str(tmp_path)]) == 1
    assert "is a folder, not a pose library" in capsys.readouterr().err
