"""Heat map nets as a user makes and scores them: by the same commands as forests."""

import json

import pytest

from pipelines.cli import main
from pipelines.corpus import write_corpus
from pipelines.generation.drawn import drawn_order
from synth.scene.config import SceneConfig, SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights

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


def test_a_net_answers_everybody_in_rooms(trained, tmp_path, capsys):
    scene = SceneConfig(
        camera="custom",
        intrinsics=(256, 212, 182.0, 182.0, 127.5, 105.5),
        splits=SplitShares(0.0, 0.0, 1.0),
        room=RoomConfig(kinds=RoomWeights(1.0, 1.0, 1.0)),
        people=PeopleConfig(number=(2, 2), visible=(0.5, 1.0)),
    )
    write_corpus(tmp_path / "rooms", drawn_order(scene, 5, 3))
    words = (str(tmp_path / "rooms"), "--sensor", "kinect_v2")
    for options in ((), ("--found",)):
        assert main(["evaluate", str(trained), *words, "--resamples", "20", "--json", *options]) == 0
        scores = json.loads(capsys.readouterr().out)
        assert scores["n_scenes"] == 3
        assert scores["missing"] < 0.5
    out = tmp_path / "p"
    assert main(["predict", str(trained), "--corpus", *words, "--frame", "0", "1", "2", "--out", str(out)]) == 0
    answered = [json.loads(path.read_text()) for path in out.glob("frame_*.json")]
    assert len(answered) >= 3
    assert all(len(one["joints"]) == 15 for one in answered)


def test_a_net_has_a_card_as_a_forest_has(trained, toy_corpus, tmp_path):
    out = tmp_path / "card.md"
    assert main(["card", str(trained), str(toy_corpus.path), "--limit", "5", "--out", str(out)]) == 0
    assert "No recorded frame was learned from." in out.read_text()
    assert "a box around the true places of all joints" in out.read_text()
    assert "| trees |" not in out.read_text()
