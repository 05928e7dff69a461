"""Heat map nets as a user makes and scores them: by the same commands as forests."""

import json

import pytest

from pipelines.cli import main

OPTIONS = (
    "--n-epochs", "1", "--batch-size", "16", "--channels", "4", "4", "8", "--max-frames", "30", "--seed", "5",
)  # fmt: skip


@pytest.fixture(scope="module")
def trained(toy_corpus, tmp_path_factory):
    pytest.importorskip("torch", reason="torch is not installed")
    out = tmp_path_factory.mktemp("models") / "toy.safetensors"
    assert main(["train", "heatmap", str(toy_corpus.path), "--out", str(out), *OPTIONS]) == 0
    return out


def test_the_same_settings_give_the_same_bytes(trained, toy_corpus, tmp_path):
    out = tmp_path / "m"
    assert main(["train", "heatmap", str(toy_corpus.path), "--out", str(out), *OPTIONS]) == 0
    assert out.read_bytes() == trained.read_bytes()


def test_a_net_is_scored_and_asked_as_a_forest_is(trained, toy_corpus, tmp_path, capsys):
    words = ["evaluate", str(trained), str(toy_corpus.path), "--split", "val", "--resamples", "20", "--json"]
    assert main(words) == 0
    scores = json.loads(capsys.readouterr().out)
    assert 0.0 <= scores["accuracy_10cm"] <= 1.0
    assert scores["pixels"] is None
    out = tmp_path / "p"
    assert (
        main(["predict", str(trained), "--corpus", str(toy_corpus.path), "--frame", "3", "--out", str(out)]) == 0
    )
    joints = json.loads((out / "frame_000003.json").read_text())["joints"]
    assert len(joints) == 15
    assert len(joints["head"]["proposals"]) > 0


def test_a_net_has_a_card_as_a_forest_has(trained, toy_corpus, tmp_path):
    out = tmp_path / "card.md"
    assert main(["card", str(trained), str(toy_corpus.path), "--limit", "5", "--out", str(out)]) == 0
    assert "No recorded frame was learned from." in out.read_text()
    assert "| trees |" not in out.read_text()
