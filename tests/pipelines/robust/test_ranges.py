"""Settings out of their range are refused by name, NaN, infinity and huge numbers too."""

import dataclasses
import math
import types
import typing
from pathlib import Path

import pytest

from forests.growing import GrowthConfig
from forests.oarf.config import OARFConfig
from forests.rwf.config import RWFConfig
from nets.heatmap.config import HeatmapConfig
from nets.orientation.config import OrientationConfig
from pipelines.ablate.config import AblationConfig, CorpusConfig
from pipelines.commands.ablate import AblateSettings
from pipelines.commands.demo import DemoSettings
from pipelines.commands.evaluate import EvaluateSettings
from pipelines.commands.generate import GenerateSettings
from pipelines.commands.importing.depth import DepthSettings
from pipelines.commands.importing.meshes import MeshSettings
from pipelines.commands.importing.mocap import MocapSettings
from pipelines.commands.inspect import InspectSettings
from pipelines.commands.predict import PredictSettings
from pipelines.commands.train import settings_of
from pipelines.commands.train_orientation import TrainOrientationSettings
from pipelines.errors import UserError
from pipelines.generation.libraries import LibraryUse, pose_mix
from pipelines.orientation.ablation import OrientationAblationConfig
from pipelines.settings import from_table
from storage.ranges import check_fields, check_number, check_span
from synth.bodies.poses.library import write_library
from synth.camera import Camera
from synth.scene.composed import ComposeConfig
from synth.scene.composed.config import ComposeWeights
from synth.scene.config import SceneConfig, SceneWeights, SplitShares
from tests.pipelines.toy_libraries import poses_of

P = Path("x")
SETTINGS = {
    GenerateSettings: {"out": P},
    settings_of("oarf"): {"corpora": (P,), "out": P},
    settings_of("heatmap"): {"corpora": (P,), "out": P},
    TrainOrientationSettings: {"corpora": (P,), "out": P},
    EvaluateSettings: {"model": P, "corpus": P},
    PredictSettings: {"model": P},
    DepthSettings: {"folder": P, "out": P},
    MocapSettings: {"folder": P, "out": P},
    MeshSettings: {"folder": P, "out": P},
    InspectSettings: {"corpus": P},
    AblateSettings: {},
    DemoSettings: {"real": P, "camera": "kinect_v2"},
    GrowthConfig: {}, OARFConfig: {}, RWFConfig: {}, SceneConfig: {}, SceneWeights: {}, SplitShares: {},
    ComposeConfig: {}, ComposeWeights: {}, CorpusConfig: {}, AblationConfig: {},
    HeatmapConfig: {}, OrientationConfig: {}, OrientationAblationConfig: {},
    Camera: {"width": 4, "height": 4, "fx": 1.0, "fy": 1.0, "cx": 1.0, "cy": 1.0},
}  # fmt: skip
ELSEWHERE = {"poses_share", "objects_share", "intrinsics", "distance"}
"""Checked by what the command makes of them."""


def absurd(kind):
    """Values that no setting of a type may have."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (types.UnionType, typing.Union):
        for item in arguments:
            yield from absurd(item)
    elif kind is int:
        yield from (10**20, -1, 10**5000)
    elif kind is float:
        yield from (math.inf, -math.inf, math.nan)
    elif origin is tuple:
        numbers = [item for item in arguments if item in (int, float)]
        for item in dict.fromkeys(numbers):
            for value in absurd(item):
                yield tuple(value if other is item else 1 for other in numbers)


@pytest.mark.parametrize("cls", SETTINGS, ids=lambda cls: cls.__name__)
def test_no_absurd_number_is_taken(cls):
    hints = typing.get_type_hints(cls)
    for item in dataclasses.fields(cls):
        if (cls.__name__.endswith("Settings") and item.name in ELSEWHERE) or not item.init:
            continue
        for value in absurd(hints[item.name]):
            if (item.name, value) == ("far", math.inf) and cls is PredictSettings:
                continue
            with pytest.raises(ValueError, match=r".") as caught:
                cls(**SETTINGS[cls] | {item.name: value})
            assert "\n" not in str(caught.value)


@pytest.mark.parametrize("share", [math.nan, math.inf, -0.1])
def test_shares_of_a_library_are_checked(share, tmp_path):
    write_library(tmp_path / "lib", poses_of("train"))
    with pytest.raises(UserError, match="share="):
        pose_mix(LibraryUse(tmp_path / "lib", share, ("train",)))


def test_a_table_says_the_same_in_one_sentence():
    for table in ({"frames": 10**20}, {"frames": 10**5000}, {"scene": {"distance": [1.0, 10**400]}}):
        with pytest.raises(UserError, match=r"^f.toml") as caught:
            from_table(GenerateSettings, table, "f.toml", out=P)
        assert len(str(caught.value)) < 300


def test_ranges_hold_their_ends():
    check_number("n", 1, 1, 2)
    check_span("s", (1.0, 2.0), 1.0, 2.0)
    check_span("s", None, 1.0, 2.0)
    for value in (0.9, 2.1, math.nan, math.inf):
        with pytest.raises(ValueError, match=r"n=.* must be in 1\.\.2 m"):
            check_number("n", value, 1, 2, "m")
    for span in ((2.0, 1.0), (0.0, 1.0), (1.0, 3.0), (math.nan, 1.0)):
        with pytest.raises(ValueError, match=r"s=.* must be "):
            check_span("s", span, 1.0, 2.0)
    with pytest.raises(ValueError, match="sizes=3"):
        check_fields(types.SimpleNamespace(sizes=(1, 3), n=None), {"sizes": (1, 2), "n": (1, 2)})
