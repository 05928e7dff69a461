"""The paper's setting is spelled out, so that other defaults of scenes change no documented figure."""

import dataclasses
import tomllib
from pathlib import Path

import pytest

from pipelines.ablate.config import AblationConfig, load_config, paper_scenes
from pipelines.commands.generate import GenerateSettings
from synth.scene import FrameSource, SceneConfig
from synth.scene.config import SplitShares

ROOT = Path(__file__).parents[3]
OPTIONAL = {"intrinsics", "distance", "height"}
"""Settings that are None in the paper's setting, which a TOML file cannot say."""


def test_the_example_says_what_ablations_draw() -> None:
    scene = GenerateSettings.from_toml(ROOT / "examples/paper.toml").scene
    assert scene == paper_scenes() == AblationConfig().corpus.scene
    assert scene.splits == SplitShares()


@pytest.mark.parametrize("size", ["demo", "paper", "large"])
def test_every_size_draws_the_papers_scenes(size: str, tmp_path: Path) -> None:
    assert load_config(size).corpus.scene == paper_scenes()
    mine = tmp_path / "mine.toml"
    mine.write_text("[corpus.scene]\nchild_share = 0.3\n")
    assert load_config(size, mine).corpus.scene == dataclasses.replace(paper_scenes(), child_share=0.3)


def test_every_setting_is_spelled_out() -> None:
    table = tomllib.loads((ROOT / "examples/paper.toml").read_text())["scene"]
    assert set(table) == {field.name for field in dataclasses.fields(SceneConfig)} - OPTIONAL
    assert all(getattr(paper_scenes(), name) is None for name in OPTIONAL)


def test_the_papers_people_are_those_of_the_plain_families_and_clothes() -> None:
    scene = dataclasses.replace(paper_scenes(), camera="kinect_v1_qvga")
    frames = list(FrameSource(scene, 2, 12))
    assert not any("life" in name or "recorded" in name for name in {f.info.pose_family for f in frames})
    assert not any({"slack", "hem_width"} & set(frame.info.subject) for frame in frames)
    assert {str(frame.info.subject["bottom"]) for frame in frames} & {"straight", "wide", "coat"} == set()
