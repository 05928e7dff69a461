"""Exports read back: unknown joints, frames that cannot be used, damage in one file, names that are no text."""

import json
import os
import re

import numpy as np
import pytest
from toy_recording import LAYOUT, NAMES, imported, write_layout, write_recording

from pipelines.cli import main
from pipelines.commands.importing.depth import DepthSettings
from pipelines.corpus import Corpus
from pipelines.corpus.faults import faults
from synth.vocabulary import JointState


@pytest.fixture
def folder(tmp_path):
    return write_recording(tmp_path / "recording")


def test_itop_reads_back_what_is_exported(folder):
    corpus = imported(folder, write_layout(folder))
    assert (
        main(["export", str(corpus.path), "--to", "itop", "--out", str(folder / "itop"), "--split", "test"]) == 0
    )
    again = imported(folder / "itop", None, folder.parent / "again")
    assert list(faults(again)) == []
    np.testing.assert_allclose(again.arrays("joints"), corpus.arrays("joints"), atol=1e-6)
    assert np.abs(again.arrays("depth").astype(int) - corpus.arrays("depth")).max() <= 1


def exported(folder, to="itop", **settings):
    corpus = imported(folder, write_layout(folder, **settings))
    words = ["export", str(corpus.path), "--to", to, "--out", str(folder / to), "--split", "test"]
    assert main(words) == 0
    return corpus, folder / to


def test_joints_that_nobody_knows_are_exported_as_invalid_and_read_back_as_unknown(folder):
    import h5py

    known = [name for name in NAMES if not name.endswith(("_hip", "_elbow"))]
    corpus, itop = exported(folder, joints=known)
    with h5py.File(itop / "test_labels.h5") as file:
        assert not file["is_valid"][:].any()
        assert (np.isnan(file["real_world_coordinates"][:]).all(axis=(0, 2)).sum()) == 4
    again = imported(itop, None, folder.parent / "again")
    assert list(faults(again)) == []
    np.testing.assert_allclose(again.arrays("joints"), corpus.arrays("joints"), atol=1e-6)
    assert (again.arrays("joint_state") == JointState.UNKNOWN).sum() == 4 * len(corpus)


def test_recordings_without_joints_are_no_itop_and_honest_coco(folder, capsys):
    corpus, coco = exported(folder, "coco", joints=[])
    document = json.loads((coco / "annotations" / "test.json").read_text())
    for number, entry in enumerate(document["annotations"]):
        seen = corpus[number].depth > 0
        assert entry["area"] == seen.sum() > 0
        assert entry["bbox"][2] == np.ptp(np.flatnonzero(seen.any(axis=0))) + 1
        assert (entry["num_keypoints"], set(entry["keypoints"])) == (0, {0})
    capsys.readouterr()
    assert main(["export", str(corpus.path), "--to", "itop", "--out", str(folder / "i"), "--split", "test"]) == 1
    assert "no joint is known in" in capsys.readouterr().err
    assert not (folder / "i").exists()


def test_the_depth_of_every_export_of_images_is_read_back(folder):
    corpus, coco = exported(folder, "coco")
    _, exr = exported(folder, "exr")
    for depth, format in ((coco / "depth" / "test", "png"), (exr / "test", "exr")):
        text = LAYOUT.format(format=format).replace('"d_*', '"*')
        (folder / f"{format}.toml").write_text(text)
        again = imported(depth, str(folder / f"{format}.toml"), folder.parent / f"again {format}")
        np.testing.assert_array_equal(again.arrays("depth"), corpus.arrays("depth"))


def _no_segment(depth, labels):
    labels["segmentation"][3] = -1


def _no_depth(depth, labels):
    depth["data"][3] = 0


def _zero_joint(depth, labels):
    labels["real_world_coordinates"][3, 2] = 0


def _nan_joint(depth, labels):
    labels["real_world_coordinates"][3, 2] = np.nan


def _millimetres(depth, labels):
    depth["data"][3] *= 1000


@pytest.mark.parametrize("spoil", [_no_segment, _no_depth, _zero_joint, _nan_joint, _millimetres])
def test_one_bad_frame_of_itop_is_left_out(folder, spoil, capsys):
    import h5py

    corpus, itop = exported(folder)
    with h5py.File(itop / "test_depth_map.h5", "a") as depth, h5py.File(itop / "test_labels.h5", "a") as labels:
        del labels.attrs["unknown_joints"]  # as others write it
        spoil(depth, labels)
    capsys.readouterr()
    out = folder.parent / "again"
    assert main(["import", "depth", str(itop), "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert told.count("left out: ") == 1
    assert "9 frames in" in told
    again = Corpus.open(out)
    np.testing.assert_allclose(again.arrays("joints"), np.delete(corpus.arrays("joints"), 3, axis=0), atol=1e-6)


def test_one_damaged_file_of_itop_loses_no_other(folder, capsys):
    _, itop = exported(folder)
    for name in ("other", "third"):
        for kind in ("depth_map", "labels"):
            data = (itop / f"test_{kind}.h5").read_bytes()
            (itop / f"{name}_{kind}.h5").write_bytes(data[: len(data) // 2] if name == "other" else data)
    assert main(["import", "depth", str(itop), "--out", str(folder.parent / "again")]) == 0
    told = capsys.readouterr().out
    assert re.search(r"left out: .*other_depth_map.h5", told)
    assert "20 frames in" in told


def test_exports_of_many_frames_and_of_any_camera_are_read_back(folder):
    """Attributes beyond 64 KiB, and a size and a camera that are not ITOP's."""
    import h5py

    from pipelines.export.itop import LIBVER

    with h5py.File(folder / "a.h5", "w", libver=LIBVER) as file:
        file.attrs["intrinsics"] = np.zeros((5000, 4))
    corpus, itop = exported(folder)
    layout = DepthSettings(itop, folder.parent / "x").order()[1].config["import"]["layout"]
    assert (layout["width"], layout["height"], layout["camera"]["fx"]) == (64, 48, 60.0)
    assert corpus.camera(0).fx == 60.0


def test_names_that_are_no_text_are_imported(folder):
    strange = folder.parent / os.fsdecode(b"\xff folder")
    folder.rename(strange)
    (strange / "d_5.png").rename(strange / os.fsdecode(b"d_\xfe5.png"))
    (strange / "j_5.txt").rename(strange / os.fsdecode(b"j_\xfe5.txt"))
    corpus = imported(strange, write_layout(strange), folder.parent / "corpus")
    assert len(corpus) == 10
    assert corpus.info(0).pose_id == r"layout/d_\xfe5"
    assert list(faults(corpus)) == []
