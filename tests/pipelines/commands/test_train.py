"""undergrowth train: a model as a user makes it, gone on with after a stop, the same to the byte."""

import json
import os
import signal

import pytest

from forests.modelfile import read_model, write_model
from forests.oarf.storage import load_model
from pipelines.cli import main
from pipelines.models.checkpoints import TreeFolder

OPTIONS = (
    "--n-trees", "3", "--seed", "5", "--n-pixels", "60", "--n-occluder-pixels", "60", "--max-frames", "40",
    "--growth.max-depth", "6", "--growth.n-candidates", "20", "--n-voting-pixels", "100",
)  # fmt: skip


def train(corpus, out, *more):
    return main(["train", "oarf", str(corpus.path), "--out", str(out), *OPTIONS, *more])


@pytest.fixture(scope="module")
def trained(toy_corpus, tmp_path_factory):
    out = tmp_path_factory.mktemp("models") / "toy.safetensors"
    assert train(toy_corpus, out) == 0
    return out


def error_line(capsys):
    err = capsys.readouterr().err
    assert err.startswith("undergrowth: error: ")
    assert err.count("\n") == 1
    return err


def test_a_model_says_what_it_was_made_of(trained, toy_corpus):
    model = load_model(trained)
    assert (model.config.n_trees, model.config.seed, model.config.growth.max_depth) == (3, 5, 6)
    metadata = read_model(trained).metadata
    assert metadata["corpus"] == toy_corpus.digest
    assert metadata["n_frames"] == {"train": 40, "val": 30}
    assert 0.0 <= metadata["scores"]["accuracy_10cm"] <= 1.0
    assert not trained.with_name(trained.name + ".partial").exists()


def test_two_threads_train_the_bytes_of_one(trained, toy_corpus, tmp_path):
    assert train(toy_corpus, tmp_path / "two", "--threads", "2") == 0
    assert (tmp_path / "two").read_bytes() == trained.read_bytes()


def stop_after_second_tree(monkeypatch, how):
    save = TreeFolder.save

    def save_and_stop(self, tree, grown):
        save(self, tree, grown)
        if tree == 1:
            how()

    monkeypatch.setattr(TreeFolder, "save", save_and_stop)


def interrupt():
    raise KeyboardInterrupt


def test_an_interrupted_training_goes_on_to_the_same_bytes(trained, toy_corpus, tmp_path, monkeypatch, capsys):
    out = tmp_path / "m"
    with monkeypatch.context() as patch:
        stop_after_second_tree(patch, interrupt)
        assert train(toy_corpus, out) == 130
    assert "2 finished trees are kept; run the same command" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.partial"]
    assert train(toy_corpus, out) == 0
    assert "continuing after 2 finished trees" in capsys.readouterr().out
    assert out.read_bytes() == trained.read_bytes()
    assert list(tmp_path.iterdir()) == [out]


def test_a_killed_training_goes_on_to_the_same_bytes(trained, toy_corpus, tmp_path, monkeypatch):
    out = tmp_path / "m"
    child = os.fork()
    if child == 0:
        stop_after_second_tree(monkeypatch, lambda: os.kill(os.getpid(), signal.SIGKILL))
        train(toy_corpus, out)
        os._exit(0)
    assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGKILL
    assert len(list((tmp_path / "m.partial").iterdir())) == 2
    grown = (tmp_path / "m.partial" / "tree_001.safetensors").read_bytes()
    (tmp_path / "m.partial" / "tree_001.safetensors").write_bytes(grown[:-9])
    assert train(toy_corpus, out) == 0
    assert out.read_bytes() == trained.read_bytes()
    assert list(tmp_path.iterdir()) == [out]


def test_trees_of_other_settings_are_refused_or_dropped(trained, toy_corpus, tmp_path, monkeypatch, capsys):
    out = tmp_path / "m"
    with monkeypatch.context() as patch:
        stop_after_second_tree(patch, interrupt)
        assert train(toy_corpus, out, "--seed", "6", "--mode", "occluders") == 130
    capsys.readouterr()
    assert train(toy_corpus, out) == 1
    assert "config.mode is 'occluders' there and 'semantic' here; finish that training, or give" in error_line(
        capsys
    )
    assert len(list((tmp_path / "m.partial").iterdir())) == 2
    assert train(toy_corpus, out, "--overwrite") == 0
    assert out.read_bytes() == trained.read_bytes()


def test_a_model_is_replaced_only_if_asked(trained, toy_corpus, tmp_path, capsys):
    out = tmp_path / "m"
    write_model(out, "oarf", {}, {})
    assert train(toy_corpus, out) == 1
    assert "exists already; add --overwrite to replace it" in error_line(capsys)
    assert train(toy_corpus, out, "--overwrite") == 0
    assert out.read_bytes() == trained.read_bytes()


def test_a_file_that_is_no_model_is_never_replaced(toy_corpus, tmp_path, capsys):
    out = tmp_path / "thesis.txt"
    out.write_text("chapter one\n" * 100)
    assert train(toy_corpus, out, "--overwrite") == 1
    assert "will not be overwritten, so choose another file" in error_line(capsys)
    assert out.read_text().startswith("chapter one")
    assert train(toy_corpus, tmp_path / "nowhere" / "m") == 1
    assert "nowhere is not a folder" in error_line(capsys)


def test_settings_come_from_a_file_too(trained, toy_corpus, tmp_path):
    path, out = tmp_path / "forest.toml", tmp_path / "m"
    path.write_text(
        "max_frames = 40\n[forest]\nn_trees = 3\nseed = 1\nn_pixels = 60\nn_occluder_pixels = 60\n"
        "n_voting_pixels = 100\n[forest.growth]\nmax_depth = 6\nn_candidates = 20\n"
    )
    words = ["train", "oarf", str(toy_corpus.path), "--out", str(out), "--config", str(path), "--seed", "5"]
    assert main(words) == 0
    assert out.read_bytes() == trained.read_bytes()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--sensor", "kinect_v9"], "sensor 'kinect_v9' is unknown; known are"),
        (["--n-trees", "0"], "n_trees=0 must be in"),
        (["--config", "missing.toml"], "cannot read missing.toml"),
    ],
)
def test_wrong_settings_are_one_line_and_leave_nothing(toy_corpus, tmp_path, capsys, words, message):
    assert train(toy_corpus, tmp_path / "m", *words) == 1
    assert message in error_line(capsys)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--threads", "0"], "threads=0 must be in"),
        (["--max-frames", "-1"], "max_frames=-1 must be in"),
        (["--growth.max-depth", "99"], "max_depth=99 must be in"),
        (["--mode", "clever"], "Invalid choice"),
    ],
)
def test_values_out_of_range_end_with_code_2(toy_corpus, tmp_path, capsys, words, message):
    with pytest.raises(SystemExit) as caught:
        train(toy_corpus, tmp_path / "m", *words)
    assert caught.value.code == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "frames = 3",
            "unknown key 'frames'; known are sensor, max_frames, threads, scheduler, overwrite, forest",
        ),
        ("[forest]\nn_tree = 3", ".forest has an unknown key 'n_tree'; known are mode, n_trees"),
        ("forest = 3", ".forest=3 must be a table, not int"),
        ("[forest.growth]\nmax_depth = 99", "max_depth=99"),
    ],
)
def test_wrong_files_are_one_line(toy_corpus, tmp_path, capsys, text, message):
    (tmp_path / "f.toml").write_text(text)
    assert train(toy_corpus, tmp_path / "m", "--config", str(tmp_path / "f.toml")) == 1
    assert message in error_line(capsys)


def test_a_folder_that_is_no_corpus_is_told(tmp_path, capsys):
    assert main(["train", "oarf", str(tmp_path), "--out", str(tmp_path / "m")]) == 1
    assert "is not a corpus" in error_line(capsys)


def test_a_random_walk_forest_is_trained_stopped_and_asked(toy_corpus, tmp_path, monkeypatch, capsys):
    words = ["train", "rwf", str(toy_corpus.path), "--max-frames", "20", "--n-points", "20", "--joints", "neck",
             "head", "--growth.max-depth", "4", "--growth.n-candidates", "20", "--n-trees", "2"]  # fmt: skip
    whole, out = tmp_path / "whole", tmp_path / "stopped"
    assert main([*words, "--out", str(whole)]) == 0
    with monkeypatch.context() as patch:
        stop_after_second_tree(patch, interrupt)
        assert main([*words, "--out", str(out)]) == 130
    assert main([*words, "--out", str(out), "--threads", "2"]) == 0
    assert "continuing after 2 finished trees" in capsys.readouterr().out
    assert out.read_bytes() == whole.read_bytes()
    asked = ["predict", str(out), "--corpus", str(toy_corpus.path), "--frame", "190", "--out", str(tmp_path)]
    assert main(asked) == 0
    assert list(json.loads((tmp_path / "frame_000190.json").read_text())["joints"]) == ["head", "neck"]
