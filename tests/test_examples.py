"""The examples run as they stand and write what they say."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from pipelines.ablate.config import load_config
from pipelines.commands.generate import GenerateSettings
from pipelines.corpus import Corpus
from pipelines.generation.writing import write_shown

ROOT = Path(__file__).parents[1]
WRITES = {
    "01_one_body.py": ["body.urdf"],
    "02_one_frame.py": ["clean.png", "kinect_v1.png"],
    "03_own_objects.py": [],
    "04_read_a_corpus.py": ["corpus.json", "manifest.jsonl"],
    "05_train_forest.py": ["forest.safetensors", "joints.png"],
}


def test_every_example_is_listed() -> None:
    assert sorted(path.name for path in (ROOT / "examples").glob("*.py")) == sorted(WRITES)


@pytest.mark.parametrize("name", sorted(WRITES))
def test_an_example_runs(name: str, tmp_path: Path) -> None:
    command = [sys.executable, str(ROOT / "examples" / name), str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    for written in WRITES[name]:
        assert (tmp_path / "out" / written).stat().st_size > 0


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.stem)
def test_settings_of_a_corpus_make_frames(path: Path, tmp_path: Path) -> None:
    given = GenerateSettings.from_toml(path)
    n_frames = max(4, given.scene.frames_a_scene)
    small = replace(given, out=tmp_path / "corpus", frames=n_frames)
    write_shown(small.out, small.order(), 1)
    corpus = Corpus.open(small.out)
    assert len(corpus) == n_frames
    assert corpus.camera(0).name == given.scene.camera


@pytest.mark.parametrize("path", sorted((ROOT / "examples/ablate").glob("*.toml")), ids=lambda path: path.stem)
def test_settings_of_an_ablation_ask_a_question(path: Path) -> None:
    assert load_config("demo", path).questions == (path.stem,)
