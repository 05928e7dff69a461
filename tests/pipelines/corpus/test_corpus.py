"""A corpus gives back what was written, to zarr as to us, and refuses what is not whole."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
import zarr
from toy_source import ToySource

from pipelines.corpus import Corpus, header, write_corpus
from pipelines.corpus.joined import JoinedFrames
from pipelines.corpus.layers import body_layer, hidden_layer
from pipelines.corpus.sequence import LABELS, CorpusFrames
from pipelines.errors import CorpusError, UserError


def assert_same_frame(left, right):
    for item in fields(left):
        a, b = getattr(left, item.name), getattr(right, item.name)
        if isinstance(a, np.ndarray):
            assert a.dtype == b.dtype, item.name
            assert a.tobytes() == b.tobytes(), item.name
        else:
            assert a == b, item.name


def test_frames_come_back_as_they_were_made(toy_corpus):
    source = ToySource(3, 200)
    for index in (0, 1, 63, 64, 130, 199):
        assert_same_frame(toy_corpus[index], source.frame(index))


def test_zarr_reads_the_same_arrays(toy_corpus):
    group = zarr.open_group(toy_corpus.path / "arrays.zarr", mode="r")
    assert sorted(group.array_keys()) == sorted(toy_corpus.header.fields)
    for name in toy_corpus.header.fields:
        theirs = group[name][:]
        assert theirs.shape[0] == 200
        np.testing.assert_array_equal(theirs, toy_corpus.arrays(name))


def test_arrays_come_in_the_order_asked(toy_corpus):
    asked = [150, 3, 70, 3]
    for name in ("depth", "joints", "body_depth", "body_part"):
        got = toy_corpus.arrays(name, asked)
        for row, index in enumerate(asked):
            expected = getattr(toy_corpus[index], name)
            np.testing.assert_array_equal(got[row], expected)


def test_splits_cover_the_corpus_and_do_not_meet(toy_corpus):
    parts = [toy_corpus.split(name) for name in ("train", "val", "test")]
    assert sorted(np.concatenate(parts).tolist()) == list(range(200))
    assert [frame.info.index for frame in toy_corpus.frames("test")] == parts[2].tolist()
    with pytest.raises(CorpusError, match="known are train, val, test"):
        toy_corpus.split("dev")


def test_a_body_that_differs_under_the_composite_is_kept(toy_corpus):
    frame = toy_corpus[1]
    odd = frame.body_depth.copy()
    odd[frame.part > 0] += 5
    hidden = hidden_layer(frame.depth, frame.part, odd, frame.body_part)
    assert (hidden[0] == odd).all()
    with pytest.raises(ValueError, match="body layer has none"):
        hidden_layer(frame.depth, frame.part, frame.body_depth, frame.body_part * 0)


def test_the_body_layer_is_taken_apart_without_loss():
    rng = np.random.default_rng(2)
    body_part = rng.integers(0, 4, (30, 40)).astype(np.uint8)
    body_depth = np.where(body_part > 0, rng.integers(1, 5, (30, 40)), 0).astype(np.uint16)
    covered = rng.random((30, 40)) < 0.4
    depth = np.where(covered, 1, body_depth).astype(np.uint16)
    part = np.where(covered, 0, body_part).astype(np.uint8)
    hidden_depth, hidden_part = hidden_layer(depth, part, body_depth, body_part)
    same = (part > 0) & (part == body_part) & (depth == body_depth)
    np.testing.assert_array_equal(hidden_depth, np.where(same, 0, body_depth))
    np.testing.assert_array_equal(hidden_part, np.where(same, 0, body_part))
    again = body_layer(depth, part, hidden_depth, hidden_part)
    np.testing.assert_array_equal(again[0], body_depth)
    np.testing.assert_array_equal(again[1], body_part)


def test_unknown_names_and_frames_are_named(toy_corpus):
    with pytest.raises(CorpusError, match="'deep' is unknown; known are depth, part"):
        toy_corpus.arrays("deep")
    with pytest.raises(IndexError, match=r"0\.\.199"):
        toy_corpus[200]
    with pytest.raises(CorpusError, match="only depth"):
        toy_corpus.arrays("part", [0], sensor="kinect_v2")
    with pytest.raises(CorpusError, match="sensor 'radar' is unknown; known are ideal"):
        toy_corpus.frame(0, sensor="radar")


class Impossible(ToySource):
    def frame(self, index):
        raise RuntimeError("no scene meets distance=(19, 20)")


def test_settings_that_allow_no_frame_are_told(tmp_path, order):
    with pytest.raises(UserError, match="no scene meets distance"):
        write_corpus(tmp_path / "c", replace(order(5), make_source=Impossible))


def edit_header(root, **values):
    path = root / "corpus.json"
    document = json.loads(path.read_text()) | values
    path.write_text(json.dumps(document))


def test_another_schema_or_a_damaged_header_is_refused(tmp_path, order):
    write_corpus(tmp_path / "c", order(5))
    edit_header(tmp_path / "c", schema_version=99)
    with pytest.raises(CorpusError, match="schema version 99; this program reads versions 1 and 2"):
        Corpus.open(tmp_path / "c")
    edit_header(tmp_path / "c", schema_version=1, n_frames=4)
    with pytest.raises(CorpusError, match="digest"):
        Corpus.open(tmp_path / "c")
    (tmp_path / "c" / "corpus.json").write_text("{")
    with pytest.raises(CorpusError, match="damaged"):
        Corpus.open(tmp_path / "c")
    with pytest.raises(CorpusError, match="not a corpus"):
        Corpus.open(tmp_path)


def relabelled(root, order, name, change):
    """A corpus whose header has another table, with the digest of such a header."""
    write_corpus(root, order(20))
    document = json.loads((root / "corpus.json").read_text())
    document["labels"][name] = change(document["labels"][name])
    (root / "corpus.json").write_text(json.dumps(document | {"digest": header.digest_of(document)}))
    return root


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("joints", lambda table: table[::-1], "has other joints: code 0 is 'l_foot', this program reads 'head'"),
        ("parts", lambda table: table[:-1], "has other parts: code 31 is None, this program reads 'r_foot'"),
        ("splits", lambda table: ["train", "dev", "test"], "has other splits: code 1 is 'dev'"),
        ("joint_states", lambda table: None, "is damaged: it has no table of joint_states"),
        ("occluders", lambda table: [*table, "lamp"], "code 8 is 'lamp', this program reads None"),
        ("occluders", lambda table: ["none", "laptop", "table"], "code 1 is 'laptop', this program reads 'table'"),
        ("occluders", lambda table: [], "has other occluders: code 0 is None, this program reads 'none'"),
    ],
)
def test_codes_that_read_otherwise_are_refused(tmp_path, order, name, change, message):
    with pytest.raises(CorpusError, match=message):
        Corpus.open(relabelled(tmp_path / "c", order, name, change))


def test_a_corpus_from_before_the_last_classes_is_trained_on_by_its_own_table(tmp_path, order, toy_corpus):
    corpus = Corpus.open(relabelled(tmp_path / "c", order, "occluders", lambda table: table[:3]))
    frames = CorpusFrames(corpus, corpus.indices)
    assert frames.labels.occluders == ("table", "laptop")
    assert (frames.labels.parts, frames.labels.joints) == (LABELS.parts, LABELS.joints)
    everyone = CorpusFrames(toy_corpus, toy_corpus.indices)
    assert everyone.labels == LABELS
    assert JoinedFrames((frames, everyone)).labels == JoinedFrames((everyone, frames)).labels == LABELS
    label, names = frames[1].label, ("nothing", *frames.labels.parts, *frames.labels.occluders)
    assert {names[code] for code in np.unique(label[corpus[1].occluder > 0])} == {"table"}


def test_an_unfinished_corpus_needs_leave(tmp_path, order):
    write_corpus(tmp_path / "c", order(130))
    manifest = tmp_path / "c" / "manifest.jsonl"
    lines = manifest.read_text().splitlines(keepends=True)
    manifest.write_text(lines[0] + lines[2] + lines[1][:50])
    with pytest.raises(CorpusError, match="unfinished: 66 of 130"):
        Corpus.open(tmp_path / "c")
    corpus = Corpus.open(tmp_path / "c", allow_incomplete=True)
    assert len(corpus) == 66
    assert corpus.arrays("joints").shape == (66, 15, 3)
    assert corpus[129].info.index == 129
    with pytest.raises(CorpusError, match="not finished"):
        corpus[70]


class Leaky(ToySource):
    def frame(self, index):
        frame = super().frame(index)
        return replace(frame, info=replace(frame.info, subject_id="subject/0001"))


def test_splits_that_share_a_subject_are_refused(tmp_path, order):
    write_corpus(tmp_path / "c", replace(order(40), make_source=lambda: Leaky(3, 40)))
    with pytest.raises(CorpusError, match="shares subject subject/0001 between the splits"):
        Corpus.open(tmp_path / "c")


def test_orders_out_of_range_are_refused(tmp_path, order):
    with pytest.raises(UserError, match="n_frames=0 must be in"):
        order(0)
    with pytest.raises(UserError, match="workers=0"):
        write_corpus(tmp_path / "c", order(5), workers=0)
    (tmp_path / "file").write_text("x")
    with pytest.raises(UserError, match="is a file"):
        write_corpus(tmp_path / "file", order(5))
