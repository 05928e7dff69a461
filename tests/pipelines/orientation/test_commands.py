"""Orientation nets as a user makes, scores, asks and exports them."""

import json
import re
import sys

import numpy as np
import pytest

from pipelines.cli import main
from pipelines.commands.train_orientation import TrainOrientationSettings
from pipelines.errors import UserError

OPTIONS = ("--n-epochs", "2", "--batch-size", "16", "--max-frames", "40", "--seed", "5")


def error_line(capsys):
    err = capsys.readouterr().err
    assert err.startswith("undergrowth: error: ")
    assert err.count("\n") == 1
    return err


def train(corpus, out, *more):
    return main(["train", "orientation", str(corpus.path), "--out", str(out), *OPTIONS, *more])


@pytest.fixture(scope="module")
def trained(toy_corpus, tmp_path_factory):
    pytest.importorskip("torch", reason="torch is not installed")
    out = tmp_path_factory.mktemp("models") / "toy.safetensors"
    assert train(toy_corpus, out) == 0
    return out


def test_without_torch_one_sentence_says_how_to_get_it(toy_corpus, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    settings = TrainOrientationSettings((toy_corpus.path,), tmp_path / "m")
    with pytest.raises(UserError, match=re.escape("install it with: pip install 'undergrowth[nets]'")):
        settings.run()
    assert list(tmp_path.iterdir()) == []


def test_a_model_says_what_it_was_made_of(trained, toy_corpus):
    from forests.modelfile import read_model

    contents = read_model(trained, "orientation")
    assert contents.metadata["corpus"] == toy_corpus.digest
    assert contents.metadata["config"]["seed"] == 5
    assert contents.metadata["n_frames"]["train"] == 40
    assert 0.0 <= contents.metadata["scores"]["mean_error_deg"] <= 180.0
    assert "torch" in contents.metadata["software"]
    assert not trained.with_name(trained.name + ".partial").exists()


def test_a_card_has_the_scores_of_evaluate(trained, toy_corpus, tmp_path, capsys):
    out = tmp_path / "card.md"
    assert main(["card", str(trained), str(toy_corpus.path), "--sensor", "ideal", "--out", str(out)]) == 0
    capsys.readouterr()
    assert main(["evaluate", str(trained), str(toy_corpus.path), "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)
    card = out.read_text()
    low, high = scores["mean_error_deg_ci"]
    shown = (
        f"| all | {scores['n_frames']} | {scores['mean_error_deg']:.1f} [{low:.1f},\N{NO-BREAK SPACE}{high:.1f}] |"
    )
    assert shown in card
    assert "which way a body in a depth image faces" in card
    assert "tilt off" not in card, "bodies tell no tilt"
    assert toy_corpus.digest[:12] in card
    assert "\n\n|" not in card.split("### ")[1].split("## Limits")[0].split("|---|")[1], (
        "rows follow their heading"
    )


def test_an_interrupted_training_goes_on_to_the_same_bytes(trained, toy_corpus, tmp_path, monkeypatch, capsys):
    from pipelines.models.checkpoints import TreeFolder

    save = TreeFolder.save

    def save_and_stop(self, tree, grown):
        save(self, tree, grown)
        raise KeyboardInterrupt

    out = tmp_path / "m"
    with monkeypatch.context() as patch:
        patch.setattr(TreeFolder, "save", save_and_stop)
        assert train(toy_corpus, out) == 130
    assert "the last finished epoch is kept" in capsys.readouterr().out
    assert train(toy_corpus, out, "--kappa", "2") == 1
    assert "holds epochs trained with other settings: config.kappa is 1.0 there and 2.0 here" in error_line(capsys)
    assert train(toy_corpus, out) == 0
    assert "continuing after 1 finished epochs" in capsys.readouterr().out
    assert out.read_bytes() == trained.read_bytes()
    assert list(tmp_path.iterdir()) == [out]


def test_scores_have_intervals_and_groups_that_add_up(trained, toy_corpus, capsys):
    words = ["evaluate", str(trained), str(toy_corpus.path), "--split", "val", "--resamples", "50"]
    assert main([*words, "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)
    assert scores["schema"] == "undergrowth orientation evaluation"
    low, high = scores["mean_error_deg_ci"]
    assert low <= scores["mean_error_deg"] <= high
    assert sum(group["n_frames"] for group in scores["by_hidden_joints"].values()) == scores["n_frames"]
    assert scores["n_frames"] + scores["n_left_out"] == len(toy_corpus.split("val"))
    assert sum(group["n_frames"] for group in scores["reliability"]) == scores["n_frames"]
    assert scores["posture_accuracy"] is None, "the toys' skeleton tells no posture"
    assert main(words) == 0
    assert "joints hidden: a fifth or more" in capsys.readouterr().out


@pytest.mark.parametrize("option", [("--joint-offsets", "3"), ("--rows", "rows.npz")])
def test_what_is_for_joints_is_refused(trained, toy_corpus, option, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["evaluate", str(trained), str(toy_corpus.path), *option]) == 1
    assert "is an orientation net; --rows, --joint-offsets and --found are for joints" in error_line(capsys)


def test_predictions_are_files_and_arrows(trained, toy_corpus, tmp_path, capsys):
    out = tmp_path / "p"
    words = ["predict", str(trained), "--corpus", str(toy_corpus.path), "--frame", "3", "4", "--out", str(out)]
    assert main(words) == 0
    document = json.loads((out / "frame_000003.json").read_text())
    assert document["schema"] == "undergrowth orientation"
    assert -np.pi <= document["angle"] <= np.pi
    assert sum(document["postures"].values()) == pytest.approx(1.0, abs=1e-4)
    assert document["tilt"] is None
    lines = (out / "orientations.jsonl").read_text().splitlines()
    assert [json.loads(line)["name"] for line in lines] == ["frame_000003", "frame_000004"]
    assert (out / "sheet.png").exists()
    assert (out / "frame_000003.overlay.png").exists()


def test_a_sequence_of_headings_is_not_smoothed(trained, toy_corpus, tmp_path, capsys):
    np.save(tmp_path / "depth.npy", toy_corpus.arrays("depth", [3])[0])
    words = ["predict", str(trained), str(tmp_path / "depth.npy"), "--intrinsics", "60", "60", "31.5", "23.5"]
    assert main([*words, "--smooth", "--out", str(tmp_path / "p")]) == 1
    assert "is an orientation net; --smooth is for joints" in error_line(capsys)


def test_a_head_needs_frames_that_tell_its_pan(trained, toy_corpus, tmp_path, capsys):
    assert train(toy_corpus, tmp_path / "m", "--region", "head") == 1
    assert "0 training frames tell the pan of a head that is seen" in error_line(capsys)


def test_a_net_is_exported_once(trained, tmp_path, capsys):
    pytest.importorskip("onnx", reason="onnx is not installed")
    out = tmp_path / "net.onnx"
    assert main(["export-model", str(trained), "--out", str(out)]) == 0
    content = out.read_bytes()
    assert main(["export-model", str(trained), "--out", str(out)]) == 1
    assert "exists already; add --overwrite" in error_line(capsys)
    assert main(["export-model", str(trained), "--out", str(out), "--overwrite"]) == 0
    assert out.read_bytes() == content


def test_a_truncated_net_is_refused(trained, toy_corpus, tmp_path, capsys):
    (tmp_path / "m").write_bytes(trained.read_bytes()[:-7])
    assert main(["evaluate", str(tmp_path / "m"), str(toy_corpus.path)]) == 1
    assert "damaged or truncated" in error_line(capsys)
