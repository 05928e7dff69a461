"""verify finds every flipped byte and every frame that breaks a law."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from toy_source import ToySource

from pipelines.cli import main
from pipelines.corpus import Corpus, write_corpus
from pipelines.corpus.faults import faults
from pipelines.corpus.laws import broken_laws
from pipelines.errors import CorpusError


def test_a_sound_corpus_has_no_faults(toy_corpus, capsys):
    assert list(faults(toy_corpus)) == []
    assert main(["verify", str(toy_corpus.path)]) == 0
    assert "is valid: 200 frames" in capsys.readouterr().out


def test_flipped_bytes_are_found_wherever_they_are(toy_corpus, tmp_path):
    rng = np.random.default_rng(5)
    root = tmp_path / "c"
    shutil.copytree(toy_corpus.path, root)
    files = sorted(path for path in root.rglob("*") if path.is_file())
    for path in files:
        whole = path.read_bytes()
        torn = bytearray(whole)
        torn[int(rng.integers(len(torn)))] ^= 1 << int(rng.integers(8))
        path.write_bytes(torn)
        try:
            found = list(faults(Corpus.open(root), with_laws=False))
        except CorpusError as error:
            found = [str(error)]
        assert found, f"no fault found in {path}"
        parts = path.relative_to(root).parts
        if "c" in parts:
            shard = parts[3]
            assert any(f"shard {shard}" in fault for fault in found)
        path.write_bytes(whole)


def test_the_damaged_frame_is_named(toy_corpus, tmp_path, capsys):
    root = tmp_path / "c"
    shutil.copytree(toy_corpus.path, root)
    path = root / "arrays.zarr/depth/c/1/0/0"
    data = bytearray(path.read_bytes())
    index = np.frombuffer(bytes(data[-1028:-4]), "<u8").reshape(64, 2)
    data[int(index[6, 0]) + 20] ^= 1
    path.write_bytes(data)
    assert main(["verify", str(root)]) == 1
    out, err = capsys.readouterr()
    assert "shard 1 (frame 70)" in out
    assert err.startswith("undergrowth: error:")
    assert err.count("\n") == 1
    with pytest.raises(CorpusError, match=r"depth of frame 70 .* damaged"):
        Corpus.open(root)[70]
    assert Corpus.open(root)[71].info.index == 71


def test_a_missing_shard_is_told(toy_corpus, tmp_path):
    root = tmp_path / "c"
    shutil.copytree(toy_corpus.path, root)
    (root / "arrays.zarr/part/c/3/0/0").unlink()
    assert any("shard 3 (frames 192..199)" in fault for fault in faults(Corpus.open(root), with_laws=False))
    with pytest.raises(CorpusError, match="is missing"):
        Corpus.open(root).arrays("part")


def broken(frame, **images):
    return replace(frame, **{name: change(getattr(frame, name).copy()) for name, change in images.items()})


def put(value, where=(0, 0)):
    def change(array):
        array[where] = value
        return array

    return change


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"depth": put(500)}, "depth without a label"),
        ({"instance": put(1)}, "object class without an instance"),
        ({"occluder": put(9), "depth": put(100), "instance": put(1)}, "occluder has code 9"),
        ({"body_part": put(3)}, "depth of the body without a part"),
        ({"body_depth": put(100, np.s_[:]), "body_part": put(1, np.s_[:])}, "composite behind the body"),
        ({"body_part": put(5, np.s_[:]), "body_depth": put(9999, np.s_[:])}, "differs from the body layer"),
        ({"joint_state": put(7, 0)}, "joint_state has code 7"),
        ({"joints": put(np.nan)}, "joints is not finite"),
        ({"angles": put(9.0, 0)}, "joint angle knee=9.0000 rad is outside its limits"),
        ({"part_visible_fraction": put(1.5, 3)}, "part_visible_fraction is not in 0..1"),
        ({"T_world_camera": put(2.0)}, "T_world_camera is no rigid transform"),
    ],
)
def test_each_broken_law_is_named(toy_corpus, changes, sentence):
    labels = toy_corpus.header.labels | {"angles": [("knee", -8.0, 8.0)]}
    header = replace(toy_corpus.header, labels=labels)
    assert list(broken_laws(toy_corpus[1], header)) == []
    assert any(sentence in found for found in broken_laws(broken(toy_corpus[1], **changes), header))


class Wrong(ToySource):
    def frame(self, index):
        frame = super().frame(index)
        return broken(frame, depth=put(77)) if index == 3 else frame


def test_verify_names_the_frame_that_breaks_a_law(tmp_path, order):
    write_corpus(tmp_path / "c", replace(order(5), make_source=lambda: Wrong(3, 5)))
    found = list(faults(Corpus.open(tmp_path / "c")))
    assert found == ["frame 3: depth without a label, or a label without depth in 1 pixels"]
