"""Nothing of others is replaced, and a wrong place is told before any work."""

import json

import numpy as np
import pytest
from toy_libraries import objects_of, poses_of
from toy_results import results_of, truths_of

from pipelines.cli import main
from pipelines.drawing.files import write_picture
from pipelines.errors import UserError
from pipelines.metrics.results import is_results, write_results
from pipelines.targets import check_file, check_folder, check_ours
from synth.bodies.poses import library as poses
from synth.occluders import meshlib


def error_line(capsys):
    err = capsys.readouterr().err
    assert err.startswith("undergrowth: error: ")
    assert err.count("\n") == 1
    return err


@pytest.fixture
def thesis(tmp_path):
    path = tmp_path / "thesis.txt"
    path.write_text("three years of work")
    return path


@pytest.mark.parametrize("command", [["import", "mocap"], ["import", "meshes"]])
def test_an_import_replaces_nothing_of_others(command, thesis, tmp_path, capsys):
    (tmp_path / "in").mkdir()
    for out, message in (
        (thesis, "it will not be overwritten, so choose another file"),
        (tmp_path / "none" / "lib", "none is not a folder; create it first"),
        (tmp_path / "in", "in is a folder; give the name of a file"),
    ):
        assert main([*command, str(tmp_path / "in"), "--out", str(out)]) == 1
        assert message in error_line(capsys)
    assert thesis.read_text() == "three years of work"


@pytest.mark.parametrize(
    ("library", "made", "command"), [(poses, poses_of("test"), "mocap"), (meshlib, objects_of("test"), "meshes")]
)
def test_a_library_is_replaced_only_when_told(library, made, command, tmp_path, capsys):
    (tmp_path / "in").mkdir()
    library.write_library(tmp_path / "lib", made)
    words = ["import", command, str(tmp_path / "in"), "--out", str(tmp_path / "lib")]
    assert main(words) == 1
    assert "lib exists already; add --overwrite to replace it" in error_line(capsys)
    assert main([*words, "--overwrite"]) == 1
    assert "has no" in error_line(capsys)  # files to import: the place is right


def test_rows_replace_results_alone(toy_corpus, thesis, tmp_path, capsys):
    np.savez(tmp_path / "notes.npz", a=np.zeros(3))
    before = (tmp_path / "notes.npz").read_bytes()
    for rows in (thesis, tmp_path / "notes.npz", tmp_path / "none" / "rows.npz"):
        assert main(["evaluate", str(tmp_path / "m"), str(toy_corpus.path), "--rows", str(rows)]) == 1
        assert rows.name in error_line(capsys) or not rows.parent.exists()
    assert thesis.read_text() == "three years of work"
    assert (tmp_path / "notes.npz").read_bytes() == before
    write_results(tmp_path / "rows.npz", [results_of(truths_of(4))], {})
    check_file(tmp_path / "rows.npz", is_results)


def test_pictures_pages_and_documents_of_others_stay(toy_corpus, tmp_path, capsys):
    for name in ("index.html", "sheet_00.png", "statistics.json"):
        (tmp_path / name).write_text("mine")
        assert main(["inspect", str(toy_corpus.path), "--out", str(tmp_path), "--frames", "2"]) == 1
        assert f"{name} was not written by this command" in error_line(capsys)
        assert [path.name for path in tmp_path.iterdir()] == [name]
        (tmp_path / name).unlink()
    for _ in range(2):
        assert main(["inspect", str(toy_corpus.path), "--out", str(tmp_path), "--frames", "2"]) == 0
    capsys.readouterr()
    assert json.loads((tmp_path / "statistics.json").read_text())["schema"] == "undergrowth statistics"
    (tmp_path / "ablation.json").write_text("{}")
    for command in ("ablate", "demo"):
        out = tmp_path if command == "ablate" else tmp_path / "index.html"
        assert main([command, "--out", str(out)]) == 1
        assert "was not written by this command" in (said := error_line(capsys)) or "is a file" in said
    assert main(["report", str(tmp_path), "--out", str(tmp_path / "ablation.json")]) == 1
    assert "was not written by this command" in error_line(capsys)


def test_pictures_of_ours_are_known(tmp_path):
    write_picture(tmp_path / "a.png", np.zeros((4, 4), np.uint8))
    check_ours(tmp_path / "a.png", ".png")
    (tmp_path / "file").write_text("x")
    (tmp_path / "folder").mkdir()
    check_folder(tmp_path / "new" / "deeper", ["a.png"])
    with pytest.raises(UserError, match="file is a file, not a folder"):
        check_folder(tmp_path / "file" / "below")
    with pytest.raises(UserError, match="folder is a folder"):
        check_ours(tmp_path / "folder", ".png")
