"""Damaged files of ours: one clear error of ours whatever is in them, before memory is taken."""

import io
import json
import shutil
import zipfile

import numpy as np
import pytest
from toy_results import results_of, truths_of

from pipelines.corpus import Corpus
from pipelines.corpus.faults import faults
from pipelines.corpus.header import digest_of
from pipelines.errors import CorpusError, UserError
from pipelines.metrics.arrayfile import read_arrays
from pipelines.metrics.results import is_results, read_results, write_results
from pipelines.report.source import read_document, read_source
from pipelines.settings import read_toml


@pytest.fixture
def corpus(toy_corpus, tmp_path):
    return shutil.copytree(toy_corpus.path, tmp_path / "c")


def changed(line, path, value):
    """A line of JSON in which a value is another."""
    document = json.loads(line)
    above = document
    for key in path[:-1]:
        above = above[key]
    above[path[-1]] = value
    return json.dumps(document)


ODD = [None, [], {}, "x", -1, 1e300, True, [None], [[[]]]]


@pytest.mark.parametrize(
    "path",
    [["shard"], ["first"], ["n_frames"], ["n_bytes"], ["n_bytes", "depth"], ["sha256"], ["sha256", "info"],
     ["splits"], ["splits", "train"], ["splits", "train", "subjects"], ["splits", "train", "n_frames"]],
)  # fmt: skip
def test_a_manifest_of_other_values_is_one_error(corpus, path):
    first, *rest = (corpus / "manifest.jsonl").read_text().splitlines(keepends=True)
    for value in ODD:
        if path[-1] == "n_bytes" and value == {}:
            continue
        (corpus / "manifest.jsonl").write_text(changed(first, path, value) + "\n" + "".join(rest))
        try:
            found = list(faults(Corpus.open(corpus, allow_incomplete=True), with_laws=False))
        except CorpusError as error:
            found = [str(error)]
        assert found, value
        assert all("\n" not in words for words in found)


@pytest.mark.parametrize("line", ["null", "[]", "7", "{}", "[" * 100_000, '{"shard": 0}', "1" * 5000, "\ufffd"])
def test_a_line_that_is_no_record_is_one_error(corpus, line):
    (corpus / "manifest.jsonl").write_text(line + "\n")
    with pytest.raises(CorpusError, match=r"line 1 of .*manifest.jsonl is damaged"):
        Corpus.open(corpus)
    (corpus / "corpus.json").write_text(line)
    with pytest.raises(CorpusError, match=r"corpus.json"):
        Corpus.open(corpus)


@pytest.mark.parametrize(
    ("name", "value"),
    [("n_frames", 10**12), ("height", 10**6), ("width", 0), ("n_dof", None), ("seed", -1), ("config", []),
     ("software", None), ("shard_frames", 65), ("n_frames", True), ("height", 48.0)],
)  # fmt: skip
def test_a_header_that_promises_too_much_is_refused(corpus, name, value):
    document = json.loads((corpus / "corpus.json").read_text()) | {name: value}
    document["digest"] = digest_of(document)
    (corpus / "corpus.json").write_text(json.dumps(document))
    with pytest.raises(CorpusError, match=f"corpus.json is damaged: {name}"):
        Corpus.open(corpus, allow_incomplete=True)


@pytest.mark.parametrize(
    "path", [["index"], ["objects"], ["subject"], ["camera"], ["split"], ["visible_fraction"]]
)
def test_a_record_of_other_values_is_one_error(corpus, path):
    records = corpus / "frames" / "000000.jsonl"
    first, second, *rest = records.read_text().splitlines(keepends=True)
    for value in ODD:
        if (
            (path, value) == (["objects"], [])
            or (path, value) == (["subject"], {})
            or (path[0] in ("camera", "split") and value == "x")
            or (path == ["visible_fraction"] and isinstance(value, float | int))
        ):
            continue
        records.write_text(first + changed(second, path, value) + "\n" + "".join(rest))
        with pytest.raises(CorpusError, match=r"the record of frame 1 .* is damaged"):
            Corpus.open(corpus).info(1)


@pytest.mark.parametrize("angles", [None, [3], [[]], [["knee", 0.0]], [["knee", None, 1.0]], [["a", 0, 1]] * 8])
def test_joint_angles_without_limits_are_refused(corpus, angles):
    document = json.loads((corpus / "corpus.json").read_text())
    document["labels"]["angles"] = angles
    document["digest"] = digest_of(document)
    (corpus / "corpus.json").write_text(json.dumps(document))
    with pytest.raises(CorpusError, match=r"corpus.json is damaged"):
        Corpus.open(corpus)


@pytest.mark.parametrize("data", [b"", b"\0\0\0\0", b"x"])
def test_a_shard_that_is_shorter_than_its_index_is_refused(corpus, data):
    (corpus / "arrays.zarr/depth/c/0/0/0").write_bytes(data)
    with pytest.raises(CorpusError, match=r"the index of .* is damaged"):
        Corpus.open(corpus).arrays("depth", [3])


def test_verify_checks_the_sizes_that_the_manifest_tells(corpus):
    first, *rest = (corpus / "manifest.jsonl").read_text().splitlines(keepends=True)
    (corpus / "manifest.jsonl").write_text(changed(first, ["n_bytes", "depth"], 17) + "\n" + "".join(rest))
    (found,) = faults(Corpus.open(corpus), with_laws=False)
    assert "the manifest says 17 bytes" in found


def test_a_chunk_that_promises_too_much_is_refused(toy_corpus):
    from pipelines.corpus import shards

    item = toy_corpus.header.fields["depth"]
    chunk = bytearray(shards.encode_maps(item, toy_corpus[1].depth)[0][:-4])
    chunk[4:8] = (2**31 - 1).to_bytes(4, "little")
    with pytest.raises(CorpusError, match="another number of pixels"):
        shards._decode_map(shards._with_crc(bytes(chunk)), item, "depth")


@pytest.fixture
def rows(tmp_path):
    path = tmp_path / "rows.npz"
    write_results(path, [results_of(truths_of(6))], {"key": "k"})
    return path


def with_arrays(path, **changes):
    with np.load(path) as stored:
        arrays = dict(stored) | changes
    np.savez(path, **{name: values for name, values in arrays.items() if values is not None})


@pytest.mark.parametrize(
    "changes",
    [{"xyz": np.zeros(3)}, {"state": np.full(18, 200, np.uint8)}, {"method": np.full(18, 7, np.uint8)},
     {"frame": None}, {"header": np.zeros(2)}, {"header": np.array("[]")}, {"header": np.array("[" * 99_999)},
     {"proposals": np.array([{}])}, {"family": np.zeros(18, np.int8)}, {"seconds": np.zeros((18, 2), np.float32)}],
)  # fmt: skip
def test_results_of_other_arrays_are_one_error(rows, changes):
    with_arrays(rows, **changes)
    with pytest.raises(UserError, match=r"rows.npz"):
        read_results(rows)


@pytest.mark.parametrize("value", [None, {}, "x", 3, [None], [[]]])
@pytest.mark.parametrize("name", ["methods", "joints", "occluders", "families", "context", "schema"])
def test_results_of_another_header_are_one_error(rows, name, value):
    if (name, value) == ("context", {}):
        return
    with np.load(rows) as stored:
        header = json.loads(str(stored["header"]))
    with_arrays(rows, header=np.array(json.dumps(header | {name: value})))
    with pytest.raises(UserError, match=r"rows.npz"):
        read_results(rows)


def test_archives_that_promise_too_much_are_refused_before_memory_is_taken(tmp_path):
    path = tmp_path / "bomb.npz"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**6, 10**6)})
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("header.npy", header.getvalue())
    with pytest.raises(
        UserError, match=r"bomb.npz is damaged, or not a file of results: an array has another size"
    ):
        is_results(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("header.npy", b"")
        archive.getinfo("header.npy").file_size = 2**40
    with pytest.raises(UserError, match=r"would take 1024\.0 GiB; at most 2 GiB are read"):
        read_arrays(path)


@pytest.mark.parametrize(
    "text", ["null", "[]", "{}", "[" * 99_999, "{", '{"schema": "undergrowth ablation"}', "\0"]
)
def test_a_document_that_is_none_is_one_error(tmp_path, text):
    (tmp_path / "ablation.json").write_text(text)
    with pytest.raises(UserError, match=r"ablation.json"):
        read_document(tmp_path / "ablation.json")
    for main in (
        None,
        [],
        {},
        {"rows": None},
        {"rows": {"baseline": {}}},
        {"rows": {"baseline": {"trainings": [3]}}},
    ):
        document = {"schema": "undergrowth ablation", "schema_version": 1, "main": main}
        (tmp_path / "ablation.json").write_text(json.dumps(document))
        with pytest.raises(UserError, match=r"ablation.json"):
            read_source(tmp_path)


@pytest.mark.parametrize("text", [b"a = " + b"[" * 5000, b"a = " + b"9" * 5000, b"a = \xff"])
def test_settings_that_no_parser_follows_are_one_error(tmp_path, text):
    path = tmp_path / "s.toml"
    path.write_bytes(text)
    with pytest.raises(UserError, match=r"s.toml is not valid TOML"):
        read_toml(path)
