"""undergrowth card: what a model learned from and its scores, beside the model, and never over a file of others."""

import json

import pytest

from forests.modelfile import read_model, write_model
from pipelines.cli import main

OPTIONS = (
    "--n-trees", "1", "--n-pixels", "60", "--n-occluder-pixels", "60", "--max-frames", "40", "--no-learn-skeleton",
    "--growth.max-depth", "6", "--growth.n-candidates", "20", "--n-voting-pixels", "100", "--sensor", "ideal",
)  # fmt: skip


@pytest.fixture(scope="module")
def model(toy_corpus, tmp_path_factory):
    out = tmp_path_factory.mktemp("models") / "toy.safetensors"
    assert main(["train", "oarf", str(toy_corpus.path), "--out", str(out), *OPTIONS]) == 0
    return out


def test_a_card_has_the_scores_of_evaluate(model, toy_corpus, capsys):
    assert main(["card", str(model), str(toy_corpus.path), "--sensor", "ideal", "--limit", "20"]) == 0
    card = model.with_suffix(".md").read_text()
    capsys.readouterr()
    assert main(["evaluate", str(model), str(toy_corpus.path), "--limit", "20", "--no-pixels", "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)
    low, high = scores["accuracy_10cm_ci"]
    shown = f"| all joints | {100 * scores['accuracy_10cm']:.1f} [{100 * low:.1f},\N{NO-BREAK SPACE}{100 * high:.1f}] |"
    assert shown in card
    assert f"20 frames, {scores['n_joints']} joints." in card
    assert toy_corpus.digest[:12] in card
    assert "40, and 30 that it was tuned on" in card
    assert "No recorded frame was learned from." in card


def test_a_card_replaces_cards_and_nothing_else(model, toy_corpus, tmp_path, capsys):
    out = tmp_path / "card.md"
    command = ["card", str(model), str(toy_corpus.path), "--out", str(out), "--limit", "2"]
    assert main(command) == 0
    first = out.read_bytes()
    assert main(command) == 0
    assert out.read_bytes() == first
    out.write_text("# My notes\n")
    capsys.readouterr()
    assert main(command) == 1
    assert "was not written by this command" in capsys.readouterr().err
    assert out.read_text() == "# My notes\n"


def test_a_model_that_does_not_say_what_it_learned_from_has_no_card(model, toy_corpus, tmp_path, capsys):
    found = read_model(model)
    told = {key: found.metadata[key] for key in ("config", "labels")}
    bare = tmp_path / "bare.safetensors"
    write_model(bare, found.kind, found.arrays, told)
    assert main(["card", str(bare), str(toy_corpus.path)]) == 1
    assert "does not say what it was trained on" in capsys.readouterr().err
    assert not bare.with_suffix(".md").exists()


def test_a_card_of_walks_tells_that_they_are_given_a_box(model, toy_corpus, tmp_path):
    out = tmp_path / "walks.safetensors"
    small = ("--n-trees", "1", "--n-points", "10", "--growth.max-depth", "4", "--growth.n-candidates", "10")
    command = ["train", "rwf", str(toy_corpus.path), "--out", str(out), "--max-frames", "20", "--sensor", "ideal"]
    assert main([*command, "--no-learn-skeleton", *small]) == 0
    cards = []
    for path in (out, model):
        written = tmp_path / "card.md"
        assert main(["card", str(path), str(toy_corpus.path), "--limit", "3", "--out", str(written)]) == 0
        cards.append(written.read_text())
    assert "A random walk forest that finds" in cards[0]
    told = "told where the person is: a box around the true places of head, neck, torso, r shoulder, l shoulder, as by"
    assert told in cards[0]
    assert "told where the person is" not in cards[1]


def test_a_model_of_another_kind_has_no_card(toy_corpus, tmp_path, capsys):
    write_model(tmp_path / "m", "people-finder", {}, {})
    assert main(["card", str(tmp_path / "m"), str(toy_corpus.path)]) == 1
    [line] = capsys.readouterr().err.strip().splitlines()
    assert "holds a model of kind 'people-finder'; known are oarf, rwf, heatmap" in line
