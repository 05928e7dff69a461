"""Corpora at URLs, on a server of S3: the bytes of folders, whatever the requests suffer."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from s3_server import s3_server

from forests.modelfile import ModelFileError, read_model, write_model
from pipelines.cli import main
from pipelines.corpus import Corpus
from pipelines.corpus.remote import writing
from pipelines.corpus.remote.mirror import cache_folder
from pipelines.corpus.remote.writing import write_remote_corpus
from pipelines.errors import CorpusError, UserError
from storage import remote

pytestmark = pytest.mark.filterwarnings("ignore")  # of botocore


@pytest.fixture(scope="module")
def bucket(tmp_path_factory):
    with s3_server(tmp_path_factory.mktemp("cache")) as url:
        yield url


@pytest.fixture(autouse=True)
def no_waiting(monkeypatch):
    monkeypatch.setattr(remote, "WAIT_S", 0.0)


class Unsteady:
    """A store whose every other request fails: unheard, heard without an answer, or heard twice."""

    def __init__(self, store, count):
        self._store, self._count = store, count

    def _do(self, act, *arguments):
        self._count[0] += 1
        if self._count[0] % 6 == 1:
            raise ConnectionResetError("reset")
        if self._count[0] % 6 == 3:
            act(*arguments)
            raise TimeoutError("no answer")
        if self._count[0] % 6 == 5:
            act(*arguments)
        return act(*arguments)

    def pipe_file(self, path, content):
        return self._do(self._store.pipe_file, path, content)

    def cat_file(self, path):
        return self._do(self._store.cat_file, path)


def stored(bucket, name, tmp_path):
    """Every file below a name, as a folder."""
    import s3fs

    s3fs.S3FileSystem(skip_instance_cache=True).get(f"{bucket}/{name}", str(tmp_path / name), recursive=True)
    return tmp_path / name


def test_urls_are_told_from_paths():
    assert remote.url_of("s3://bucket/a/b") == "s3://bucket/a/b"
    assert remote.url_of("s3:/bucket/a") == "s3://bucket/a"
    assert remote.url_of("out/corpus") is None
    assert remote.url_of("/a:b/c") is None
    assert remote.url_of("C:/data") is None


def test_a_corpus_is_put_and_read_as_if_it_were_a_folder(bucket, order, toy_corpus, tmp_path, bytes_of):
    url = f"{bucket}/whole"
    write_remote_corpus(url, order())
    assert bytes_of(stored(bucket, "whole", tmp_path)) == bytes_of(toy_corpus.path)
    corpus = Corpus.open(url)
    assert not list(corpus.path.glob("arrays.zarr/*/c"))
    assert (corpus.arrays("joints", [3, 199]) == toy_corpus.arrays("joints", [3, 199])).all()
    assert (corpus.frame(70).depth == toy_corpus.frame(70).depth).all()
    assert corpus.record(70) == toy_corpus.record(70)
    assert main(["verify", url]) == 0


def test_requests_that_fail_or_come_twice_change_nothing(
    bucket, order, toy_corpus, tmp_path, bytes_of, monkeypatch
):
    count, plain = [0], remote._store

    def unsteady(url):
        store, path = plain(url)
        return Unsteady(store, count), path

    monkeypatch.setattr(remote, "_store", unsteady)
    write_remote_corpus(f"{bucket}/unsteady", order())
    assert (Corpus.open(f"{bucket}/unsteady").frame(9).depth == toy_corpus.frame(9).depth).all()
    assert count[0] > 100
    assert bytes_of(stored(bucket, "unsteady", tmp_path)) == bytes_of(toy_corpus.path)


def test_the_manifest_comes_last_and_a_run_goes_on(bucket, order, toy_corpus, tmp_path, bytes_of, monkeypatch):
    url, put_shard = f"{bucket}/halted", writing.put_shard

    def broken(url, header, source, shard):
        if shard == 2:
            raise OSError(28, "No space left on device", "somewhere")
        return put_shard(url, header, source, shard)

    monkeypatch.setattr(writing, "put_shard", broken)
    with pytest.raises(UserError, match="the disk that holds somewhere is full"):
        write_remote_corpus(url, order())
    with pytest.raises(
        CorpusError, match=r"s3://undergrowth-\d+/halted is not a finished corpus: .*manifest\.jsonl"
    ):
        Corpus.open(url)
    monkeypatch.setattr(writing, "put_shard", put_shard)
    told = []
    write_remote_corpus(url, order(), lambda *n: told.append(n))
    assert told[0] == (128, 128)
    shutil.rmtree(cache_folder("staging", url))  # as on another machine
    write_remote_corpus(url, order())
    assert bytes_of(stored(bucket, "halted", tmp_path)) == bytes_of(toy_corpus.path)


def test_other_settings_and_damaged_files_are_refused(bucket, order):
    url = f"{bucket}/refused"
    write_remote_corpus(url, order())
    shutil.rmtree(cache_folder("staging", url))
    with pytest.raises(UserError, match=r"s3://undergrowth-\d+/refused holds a corpus with other settings"):
        write_remote_corpus(url, order(100))
    remote.put(f"{url}/frames/000001.jsonl", b"other")
    with pytest.raises(CorpusError, match=r"frames/000001\.jsonl is damaged"):
        Corpus.open(url).record(70)


def test_buckets_that_are_missing_or_deny_are_one_sentence(order, bucket, monkeypatch, capsys):
    assert main(["verify", "s3://nowhere/c"]) == 1
    assert "s3://nowhere/c is not a finished corpus" in capsys.readouterr().err

    class Denying:
        def pipe_file(self, *_):
            raise PermissionError(13, "Access Denied")

        cat_file = pipe_file

    monkeypatch.setattr(remote, "_store", lambda url: (Denying(), url))
    with pytest.raises(UserError, match=r"s3://undergrowth-\d+/d\S* cannot be used: permission denied"):
        write_remote_corpus(f"{bucket}/d", order())


def test_models_are_read_from_urls(bucket, tmp_path):
    write_model(tmp_path / "m", "tree", {"a": np.arange(5)}, {"name": "x"})
    remote.put(f"{bucket}/m.safetensors", (tmp_path / "m").read_bytes())
    model = read_model(Path(f"{bucket}/m.safetensors"), "tree")
    assert (model.arrays["a"] == np.arange(5)).all()
    with pytest.raises(ModelFileError, match=r"the model file s3://undergrowth-\d+/none cannot be read"):
        read_model(Path(f"{bucket}/none"), "tree")
