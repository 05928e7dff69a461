"""A file is whole or absent, whatever goes wrong while it is written, and nothing is left beside it."""

import errno
import os

import pytest

from storage import atomic
from storage.atomic import is_unfinished, replacing, write_all_atomically, write_atomically


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("content", [b"\x00\xff", "Ä\r\nb", ""])
def test_what_is_written_is_there(tmp_path, content):
    path = tmp_path / "file"
    path.write_text("old")
    write_atomically(path, content)
    assert path.read_bytes() == (content.encode() if isinstance(content, str) else content)
    assert names(tmp_path) == ["file"]


def test_several_files_make_their_folders(tmp_path):
    contents = {tmp_path / "a" / "0": b"1", tmp_path / "b" / "c" / "0": "two", tmp_path / "d": b""}
    write_all_atomically(contents)
    assert {path: path.read_bytes() for path in contents} == {
        path: content if isinstance(content, bytes) else content.encode() for path, content in contents.items()
    }
    assert len([path for path in tmp_path.rglob("*") if path.is_file()]) == 3


def test_the_old_file_is_there_until_the_new_one_is_whole(tmp_path):
    path = tmp_path / "file"
    path.write_text("old")
    with replacing(path) as file:
        file.write(b"new")
        file.flush()
        assert path.read_text() == "old"
        assert [is_unfinished(item, "file") for item in sorted(tmp_path.iterdir())] == [False, True]
    assert path.read_text() == "new"
    assert names(tmp_path) == ["file"]


@pytest.mark.parametrize("error", [ValueError("odd"), KeyboardInterrupt(), OSError(errno.ENOSPC, "full")])
def test_an_error_on_the_way_leaves_the_old_file_alone(tmp_path, error):
    path = tmp_path / "file"
    path.write_text("old")

    def broken():
        with replacing(path) as file:
            file.write(b"half")
            raise error

    with pytest.raises(type(error)) as caught:
        broken()
    assert path.read_text() == "old"
    assert names(tmp_path) == ["file"]
    if isinstance(error, OSError):
        assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, str(path))


@pytest.mark.parametrize("name", ["fsync", "write"])
@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_a_full_disk_is_an_error_that_names_the_file(tmp_path, monkeypatch, name, code):
    def fail(*_):
        raise OSError(code, os.strerror(code))

    paths = [tmp_path / "a", tmp_path / "b"]
    if name == "fsync":
        monkeypatch.setattr(atomic.os, "fsync", fail)
    else:
        monkeypatch.setattr(atomic, "_finish", fail)
    with pytest.raises(OSError, match=os.strerror(code)) as caught:
        write_all_atomically(dict.fromkeys(paths, b"x"))
    assert caught.value.errno == code
    assert name == "write" or caught.value.filename == str(paths[0])
    assert names(tmp_path) == []


def test_an_error_of_another_file_keeps_its_name(tmp_path):
    path = tmp_path / "file"

    def broken():
        with replacing(path):
            (tmp_path / "none").read_bytes()

    with pytest.raises(FileNotFoundError) as caught:
        broken()
    assert caught.value.filename == str(tmp_path / "none")
    assert names(tmp_path) == []


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("x")
    (tmp_path / "folder").mkdir()
    for path, kind in (
        (tmp_path / "none" / "x", FileNotFoundError),
        (tmp_path / "file" / "x", NotADirectoryError),
        (tmp_path / "folder", IsADirectoryError),
    ):
        with pytest.raises(kind) as caught:
            write_atomically(path, b"")
        assert caught.value.filename == str(path)
    assert names(tmp_path) == ["file", "folder"]


def test_two_processes_do_not_share_an_unfinished_file(tmp_path, monkeypatch):
    path = tmp_path / "file"
    with replacing(path) as file:
        file.write(b"first")
        monkeypatch.setattr(atomic.os, "getpid", lambda: 1)
        write_atomically(path, b"second")
        assert path.read_bytes() == b"second"
        monkeypatch.undo()
    assert path.read_bytes() == b"first"
