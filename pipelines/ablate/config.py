"""What an ablation is made of: a corpus, forests, seeds, questions; and the sizes that are shipped."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Literal, get_args

from forests.oarf.config import OARFConfig
from forests.rwf.config import RWFConfig
from pipelines.errors import UserError
from pipelines.settings import from_table, read_toml
from synth.render.sensors import SENSOR_NAMES
from synth.scene import SceneConfig
from synth.vocabulary import OCCLUDER_CLASSES

Size = Literal["demo", "paper", "large"]
"""Sizes that are shipped as TOML files beside this one."""

OARFRow = Literal["baseline", "occluders", "semantic"]
RWFRow = Literal["rwf_body", "rwf"]
Row = Literal["baseline", "occluders", "semantic", "rwf_body", "rwf"]
"""Methods. The first three are regression forests by their mode; rwf_body: a random walk forest that learned from
bodies alone; rwf: one that learned from what the sensor sees."""

Question = Literal["context", "paper_scenes", "unseen_class", "sensor", "imported", "frames", "trees", "pixels"]
"""What else can be asked: does the gain need the relation of object and pose; is it larger among tables and
laptops alone; does it hold for a class of objects that was never seen; under a noisy sensor; on recorded poses
and other people's objects; how does it grow with training frames, trees, voting pixels."""

OARF_ROWS: tuple[OARFRow, ...] = get_args(OARFRow)
RWF_ROWS: tuple[RWFRow, ...] = get_args(RWFRow)
ROWS: tuple[Row, ...] = get_args(Row)


@dataclass(frozen=True)
class CorpusConfig:
    """The corpus that is learned from and tested on.

    Attributes:
        train_frames: Frames to learn from.
        val_frames: Frames to tune on.
        test_frames: Frames to score on, of other subjects, objects and poses.
        seed: Of everything random in it.
        scene: What the scenes are drawn from; its splits are set by the numbers of frames.
    """

    train_frames: int = 1110
    val_frames: int = 200
    test_frames: int = 440
    seed: int = 2015
    scene: SceneConfig = field(default_factory=SceneConfig)

    def __post_init__(self) -> None:
        for name in ("train_frames", "val_frames", "test_frames"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name}={getattr(self, name)} must be at least 1")


@dataclass(frozen=True)
class AblationConfig:
    """An ablation. The defaults are the paper's figures.

    Attributes:
        corpus: Where the frames come from.
        rows: Methods.
        n_seeds: Trainings of each regression forest, by seeds oarf.seed, oarf.seed + 1, ...
        n_rwf_seeds: Trainings of each random walk forest, likewise.
        sensor: Sensor model for depth in training and test; None = clean.
        oarf: Regression forests; the row sets `mode`.
        rwf: Random walk forests; the row sets `layer`.
        questions: What else is asked.
        n_question_seeds: Trainings for each answer, at most `n_seeds`.
        unseen_class: Class of objects that the question unseen_class keeps out of training.
        noisy_sensor: Sensor model of the question sensor.
        test_poses: Pose library of the question imported (`undergrowth import mocap`).
        test_objects: Object library of it (`undergrowth import meshes`).
        frame_counts: Numbers of training frames of the question frames; the first so many are taken.
        tree_counts: Numbers of trees of the question trees; the first so many are asked.
        pixel_counts: Numbers of voting pixels of the question pixels.
        n_resamples: Resamples of the test frames for intervals and tests.
    """

    corpus: CorpusConfig = field(default_factory=CorpusConfig)
    rows: tuple[Row, ...] = ROWS
    n_seeds: int = 1
    n_rwf_seeds: int = 1
    sensor: str | None = None
    oarf: OARFConfig = field(default_factory=OARFConfig)
    rwf: RWFConfig = field(default_factory=RWFConfig)
    questions: tuple[Question, ...] = ()
    n_question_seeds: int = 1
    unseen_class: str = "stroller"
    noisy_sensor: str = "kinect_v2"
    test_poses: Path | None = None
    test_objects: Path | None = None
    frame_counts: tuple[int, ...] = (140, 280, 555, 1110)
    tree_counts: tuple[int, ...] = (1, 2, 3)
    pixel_counts: tuple[int, ...] = (50, 100, 200, 500, 1000, 2000)
    n_resamples: int = 2000

    def __post_init__(self) -> None:
        for name in ("n_seeds", "n_rwf_seeds", "n_question_seeds", "n_resamples"):
            _check_range(name, getattr(self, name), 1)
        _check_range("n_question_seeds", self.n_question_seeds, 1, self.n_seeds)
        _check_names("rows", self.rows, ROWS)
        _check_names("questions", self.questions, get_args(Question), least=0)
        _check_names("noisy_sensor", (self.noisy_sensor,), SENSOR_NAMES)
        if self.sensor is not None:
            _check_names("sensor", (self.sensor,), SENSOR_NAMES)
        _check_names("unseen_class", (self.unseen_class,), OCCLUDER_CLASSES[1:])
        for question, name, most in (
            ("frames", "frame_counts", self.corpus.train_frames),
            ("trees", "tree_counts", self.oarf.n_trees),
            ("pixels", "pixel_counts", None),
        ):
            for count in getattr(self, name) if question in self.questions else ():
                _check_range(name, count, 1, most)


def load_config(size: Size, path: Path | None = None) -> AblationConfig:
    """The configuration of a size, with a TOML file's settings before it.

    Args:
        size: One that is shipped.
        path: A file with some of an `AblationConfig`'s settings.

    Raises:
        UserError: The file is missing, no TOML, or has unknown or wrong settings.
    """
    table = tomllib.loads(files(__package__).joinpath(f"{size}.toml").read_text(encoding="utf-8"))
    if path is None:
        return from_table(AblationConfig, table, f"{size}.toml")
    return from_table(AblationConfig, merged(table, read_toml(path)), str(path))


def asked(
    config: AblationConfig,
    questions: tuple[Question, ...] = (),
    poses: Path | None = None,
    objects: Path | None = None,
) -> AblationConfig:
    """The same with other questions and libraries to test on, if any are given.

    Raises:
        UserError: A question's settings do not fit the rest.
    """
    given = {"questions": questions, "test_poses": poses, "test_objects": objects}
    try:
        return replace(config, **{name: value for name, value in given.items() if value})  # type: ignore[arg-type]
    except ValueError as error:
        raise UserError(str(error)) from None


def merged(table: Mapping[str, object], over: Mapping[str, object]) -> dict[str, object]:
    """A table with another's values before its own, in nested tables too."""
    out = dict(table)
    for key, value in over.items():
        below = out.get(key)
        both = isinstance(below, Mapping) and isinstance(value, Mapping)
        out[key] = merged(below, value) if both else value  # type: ignore[arg-type]
    return out


def _check_range(name: str, value: int, least: int, most: int | None = None) -> None:
    if value < least or (most is not None and value > most):
        allowed = f"at least {least}" if most is None else f"in {least}..{most}"
        raise ValueError(f"{name}={value} must be {allowed}")


def _check_names(name: str, given: tuple[str, ...], known: tuple[str, ...], least: int = 1) -> None:
    unknown = [item for item in given if item not in known]
    if unknown:
        raise ValueError(f"{name} {', '.join(map(repr, unknown))} unknown; known are {', '.join(known)}")
    if len(set(given)) < len(given) or len(given) < least:
        raise ValueError(f"{name}={list(given)} must be {least} or more different names")
