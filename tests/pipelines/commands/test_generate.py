"""undergrowth generate with the real scenes: bytes, settings, errors."""

import json

import pytest

from pipelines.cli import main
from pipelines.corpus import Corpus
from pipelines.corpus.faults import faults
from synth.bodies.skeleton import DOFS
from synth.scene import SceneConfig

SMALL = """
frames = 66
seed = 4

[scene]
camera = "custom"
intrinsics = [160, 120, 142.0, 142.0, 79.5, 59.5]

[scene.scenes]
table = 0.5
"""


@pytest.fixture(scope="module")
def small_toml(tmp_path_factory):
    path = tmp_path_factory.mktemp("settings") / "small.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def real_corpus(tmp_path_factory, small_toml):
    root = tmp_path_factory.mktemp("real") / "c"
    assert main(["generate", str(root), "--config", str(small_toml)]) == 0
    return Corpus.open(root)


def test_a_real_corpus_is_sound(real_corpus):
    assert len(real_corpus) == 66
    assert list(faults(real_corpus)) == []
    assert {name: len(real_corpus.split(name)) > 0 for name in ("train", "val", "test")} == {
        "train": True, "val": True, "test": True,
    }  # fmt: skip
    assert [name for name, _, _ in real_corpus.header.labels["angles"]] == [dof.name for dof in DOFS]


def test_the_resolved_settings_are_saved(real_corpus):
    scene = real_corpus.header.config["scene"]
    assert scene["camera"] == "custom"
    assert scene["scenes"]["table"] == 0.5
    assert scene["scenes"]["stroller"] == SceneConfig().scenes.stroller
    assert real_corpus.header.config["renderer"] == "numba"


@pytest.mark.slow
def test_two_workers_give_the_bytes_of_one(real_corpus, small_toml, tmp_path, bytes_of, capsys):
    out = tmp_path / "two"
    assert main(["generate", str(out), "--config", str(small_toml), "--workers", "2"]) == 0
    assert bytes_of(out) == bytes_of(real_corpus.path)
    assert "renderer: numba" in capsys.readouterr().out


def test_a_sensor_is_applied_on_reading_and_repeats(real_corpus):
    clean = real_corpus.arrays("depth", [3, 40])
    noisy = real_corpus.arrays("depth", [3, 40], sensor="kinect_v2")
    assert (noisy != clean).any(axis=(1, 2)).all()
    assert (noisy[1] == real_corpus.frame(40, sensor="kinect_v2").depth).all()
    assert (real_corpus.frame(40, sensor="ideal").depth == clean[1]).all()


def test_the_command_line_goes_before_the_file(small_toml, tmp_path):
    out = tmp_path / "c"
    assert main(["generate", str(out), "--config", str(small_toml), "--frames", "3", "--seed", "9"]) == 0
    header = json.loads((out / "corpus.json").read_text())
    assert (header["n_frames"], header["seed"]) == (3, 9)
    assert header["config"]["scene"]["intrinsics"][0] == 160


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("frame = 3", "unknown key 'frame'; known are frames, seed"),
        ("[scene]\ncamara = 'x'", ".scene has an unknown key 'camara'"),
        ("[scene]\ncamera = 'kinect_v9'", "kinect_v9"),
        ("[scene.scenes]\nbathtub = 1", ".scene.scenes has an unknown key 'bathtub'; known are unhidden"),
        ("[scene.scenes]\ntable = -1", "table=-1.0"),
        ("[scene]\nclearance = [-0.1, 0.05]", "clearance=(-0.1, 0.05)"),
        ("frames = -2", "frames=-2 must be in"),
        ("frames = 'many'", "frames='many' must be int, not str"),
        ("renderer = 'metal'", "renderer='metal' is unknown; known are numba, pyrender"),
        ("seed = 'x", "not valid TOML"),
    ],
)
def test_wrong_settings_are_one_line_and_touch_nothing(tmp_path, capsys, text, message):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    assert main(["generate", str(tmp_path / "c"), "--config", str(path)]) == 1
    err = capsys.readouterr().err
    assert message in err
    assert err.startswith("undergrowth: error: ")
    assert err.count("\n") == 1
    assert not (tmp_path / "c").exists()
