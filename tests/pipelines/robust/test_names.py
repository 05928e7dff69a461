"""Names of files that are no text: printed as their codes, and no command ends because of them."""

import os
import shutil
import subprocess
import sys

import pytest

from pipelines.importing.splits import SplitRule

ODD = os.fsdecode(b"odd\xff")


@pytest.fixture
def odd_corpus(toy_corpus, tmp_path):
    return shutil.copytree(toy_corpus.path, tmp_path / ODD)


def run(*words):
    code = "import sys; from pipelines.cli import main; sys.exit(main(sys.argv[1:]))"
    given = [os.fsencode(str(word)) for word in words]
    done = subprocess.run([sys.executable, "-c", code, *given], capture_output=True, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


@pytest.mark.parametrize(
    "words",
    [["verify"], ["inspect", "--frames", "2"], ["export", "--to", "webdataset", "--split", "val"],
     ["export", "--to", "itop", "--split", "val"],
     ["export", "--to", "coco", "--split", "val"]],
    ids=" ".join,
)  # fmt: skip
def test_commands_end_well_in_folders_of_any_name(words, odd_corpus, tmp_path):
    command, *rest = words
    out = [] if command == "verify" else ["--out", tmp_path / (ODD + "-out")]
    code, said, error = run(command, odd_corpus, *rest, *out)
    assert (code, error) == (0, "")
    assert "odd\\udcff" in said


def test_openexr_says_that_it_needs_another_name(odd_corpus, tmp_path):
    code, _, error = run("export", odd_corpus, "--to", "exr", "--out", tmp_path / ODD / "out")
    assert (code, error.count("\n")) == (1, 1)
    assert "OpenEXR cannot write into" in error


def test_models_of_any_name_are_written_asked_and_scored(odd_corpus, tmp_path):
    model = tmp_path / (ODD + ".safetensors")
    small = ["--max-frames", "10", "--n-trees", "1", "--n-pixels", "20", "--growth.max-depth", "3",
             "--growth.n-candidates", "20", "--growth.n-finalists", "5"]  # fmt: skip
    assert run("train", "oarf", odd_corpus, "--out", model, *small)[0] == 0
    out = tmp_path / (ODD + "-out")
    assert run("predict", model, "--corpus", odd_corpus, "--frame", "3", "4", "--out", out)[0] == 0
    assert len(list(out.iterdir())) == 6
    code, said, error = run("evaluate", model, odd_corpus, "--rows", tmp_path / (ODD + ".npz"), "--limit", "3")
    assert code == 0, error
    assert "odd\\udcff" in said
    code, _, error = run("evaluate", tmp_path / "none\udcff", odd_corpus)
    assert (code, error.count("\n")) == (1, 1)
    assert "none\\udcff" in error


def test_any_name_belongs_to_a_split():
    assert SplitRule().split_of(ODD) in ("train", "val", "test")
