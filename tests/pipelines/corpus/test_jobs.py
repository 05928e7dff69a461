"""Jobs of an array that make some shards each, and the joining of their work, give the bytes of one run."""

import concurrent.futures
import multiprocessing

import pytest

from pipelines.cli import main
from pipelines.corpus import write_corpus
from pipelines.corpus.folder import locked_folder, locked_part
from pipelines.corpus.manifest import part_path
from pipelines.corpus.run import join_shards, write_shards
from pipelines.errors import UserError


def test_jobs_in_any_order_and_joined_give_the_bytes_of_one_run(order, toy_corpus, tmp_path, bytes_of):
    root = tmp_path / "c"
    for shards in (range(2, 9), range(0, 1), range(1, 2)):
        write_shards(root, order(), shards)
    join_shards(root)
    assert bytes_of(root) == bytes_of(toy_corpus.path)
    join_shards(root)
    assert bytes_of(root) == bytes_of(toy_corpus.path)


def test_jobs_at_the_same_time_do_not_disturb_one_another(order, toy_corpus, tmp_path, bytes_of):
    spawn = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(2, spawn) as pool:
        jobs = [pool.submit(write_shards, tmp_path / "c", order(pause=0.002), range(k, k + 2)) for k in (0, 2)]
        for job in jobs:
            job.result()
    join_shards(tmp_path / "c")
    assert bytes_of(tmp_path / "c") == bytes_of(toy_corpus.path)


def test_missing_shards_are_named_and_can_be_made(order, toy_corpus, tmp_path, bytes_of):
    root = tmp_path / "c"
    write_shards(root, order(), range(1, 2))
    with pytest.raises(UserError, match="lacks the shards 0:1, 2:4; make them"):
        join_shards(root)
    write_corpus(root, order())
    assert bytes_of(root) == bytes_of(toy_corpus.path)


def test_a_job_goes_on_after_its_last_whole_shard(order, toy_corpus, tmp_path, bytes_of):
    root = tmp_path / "c"
    write_shards(root, order(), range(0, 3))
    part = part_path(root, range(0, 3))
    text = part.read_bytes()
    part.write_bytes(text[: len(text) - 30])
    told = []
    write_shards(root, order(), range(0, 3), progress=lambda *n: told.append(n))
    assert told[0] == (128, 128)
    assert told[-1] == (192, 128)
    write_shards(root, order(), range(3, 4))
    join_shards(root)
    assert bytes_of(root) == bytes_of(toy_corpus.path)


def test_what_would_write_twice_is_refused(order, tmp_path):
    root = tmp_path / "c"
    write_shards(root, order(), range(0, 1))
    with locked_folder(root, is_shared=True), pytest.raises(UserError, match="being written by another"):
        join_shards(root)
    with locked_part(root, range(0, 1)), pytest.raises(UserError, match=r"shards 0:1 of .* are being made"):
        write_shards(root, order(), range(0, 1))
    with pytest.raises(UserError, match=r"only_shards=4:9 must be FIRST:END within 0:4"):
        write_shards(root, order(), range(4, 9))


def test_the_commands_make_and_join(tmp_path, capsys, bytes_of):
    words = [
        "--frames",
        "70",
        "--scene.camera",
        "custom",
        "--scene.intrinsics",
        "80",
        "60",
        "71",
        "71",
        "39.5",
        "29.5",
    ]
    assert main(["generate", str(tmp_path / "one"), *words]) == 0
    for shards in ("1:5", "0:1"):
        assert main(["generate", str(tmp_path / "c"), *words, "--only-shards", shards]) == 0
    assert main(["join", str(tmp_path / "c")]) == 0
    assert bytes_of(tmp_path / "c") == bytes_of(tmp_path / "one")
    assert main(["generate", str(tmp_path / "c"), *words, "--only-shards", "one"]) == 1
    assert "only_shards='one' must be FIRST:END, such as 0:100" in capsys.readouterr().err
