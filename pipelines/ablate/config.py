"""What an ablation is made of: a corpus, forests, seeds, questions; and the sizes that are shipped."""

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, get_args

from pipelines.errors import UserError
from pipelines.models.kinds import COMPARED, VARIANTS, ModelConfig
from pipelines.settings import from_table, read_toml
from storage.ranges import MAX_FRAMES, MAX_SEED, check_fields, check_number
from synth.render.sensors import SENSOR_NAMES
from synth.scene import SceneConfig
from synth.vocabulary import OCCLUDER_CLASSES

Size = Literal["demo", "paper", "large"]
"""Sizes that are shipped as TOML files beside this one."""

Question = Literal[
    "context",
    "paper_scenes",
    "unseen_class",
    "sensor",
    "imported",
    "skeletons",
    "oracles",
    "frames",
    "trees",
    "pixels",
    "rooms",
]
"""What else can be asked: does the gain need the relation of object and pose; is it larger among tables and
laptops alone; does it hold for a class of objects that was never seen; under a noisy sensor; on recorded poses
and other people's objects; what do whole skeletons gain; what would the truth gain of what hides the person, or
of the person; how does it grow with training frames, trees, voting pixels; what is lost in rooms with several people
whom a finder finds."""

Told = Literal["mask", "classes", "heading", "posture", "size", "predicted"]
"""What the question oracles tells trees beside depth. mask: by pixel, nothing, the person or an object; classes: the
same with each class of objects for itself; heading: where the person faces; posture: the family of poses; size: the
stature. All these are truths; predicted is what a first forest predicts of the classes."""

ROWS: tuple[str, ...] = tuple(VARIANTS)
"""Methods: baseline, occluders and semantic are regression forests by their mode; rwf_body: a random walk forest
that learned from bodies alone; rwf: one that learned from what the sensor sees. heat_body and heat are heat map nets
that learned from the same; heat_object and heat_classes also learned to tell where objects are, or their classes."""
FOREST_ROWS: tuple[str, ...] = tuple(row for row, kind in VARIANTS.items() if not kind.is_net)
"""Methods that do not need torch."""
REGRESSION_ROWS: tuple[str, ...] = tuple(COMPARED["oarf"].variants)
"""Methods that most questions compare."""


SCENES = "scenes"
"""The scenes of the paper's setting: a file beside this one that every size begins with."""


def _shipped(name: str) -> dict[str, object]:
    """The tables of a TOML file beside this one."""
    return tomllib.loads(files(__package__).joinpath(f"{name}.toml").read_text(encoding="utf-8"))


@functools.cache
def paper_scenes() -> SceneConfig:
    """The scenes on which all documented figures are measured, those of `examples/paper.toml`."""
    return from_table(CorpusConfig, _shipped(SCENES)["corpus"], f"{SCENES}.toml").scene  # type: ignore[arg-type]


@dataclass(frozen=True)
class CorpusConfig:
    """The corpus on which an ablation trains and tests.

    Attributes:
        train_frames: Number of training frames.
        val_frames: Number of frames for tuning.
        test_frames: Number of frames for scoring, with other subjects, objects and poses.
        seed: Seed of all randomness in the corpus.
        scene: How the scenes are drawn; by default as `paper_scenes`. The splits follow from the numbers of
            frames.
    """

    train_frames: int = 1110
    val_frames: int = 200
    test_frames: int = 440
    seed: int = 2015
    scene: SceneConfig = field(default_factory=paper_scenes)

    def __post_init__(self) -> None:
        check_fields(self, dict.fromkeys(("train_frames", "val_frames", "test_frames"), (1, MAX_FRAMES // 3)))
        check_fields(self, {"seed": (0, MAX_SEED)})


@dataclass(frozen=True)
class AblationConfig:
    """The settings of an ablation. The defaults are the paper's figures.

    Attributes:
        corpus: Where the frames come from.
        rows: Methods to compare; by default all forests. Nets need undergrowth[nets].
        n_seeds: Number of trainings by kind of model, with seeds counted on from the kind's own.
        sensor: Sensor model for the depth in training and test; None means clean depth.
        models: Settings by kind of model; in a file, a table for each ([oarf], [rwf], [heatmap]). A row sets its
            variant.
        questions: Further questions to answer.
        n_question_seeds: Number of trainings for each condition of a question, at most `n_seeds`.
        unseen_class: Class of objects that the question unseen_class keeps out of training.
        noisy_sensor: Sensor model of the questions sensor and rooms.
        oracles: What the question oracles tells, beside nothing.
        test_poses: Library of poses for the question imported, made by `undergrowth import mocap`.
        test_objects: Library of objects for the question imported, made by `undergrowth import meshes`.
        frame_counts: Numbers of training frames for the question frames. Each condition uses the first frames of
            the corpus.
        tree_counts: Numbers of trees for the question trees. Each condition uses the first trees of a forest.
        pixel_counts: Numbers of voting pixels for the question pixels.
        n_resamples: Number of resamples of the test frames for intervals and tests.
    """

    corpus: CorpusConfig = field(default_factory=CorpusConfig)
    rows: tuple[str, ...] = FOREST_ROWS
    n_seeds: dict[str, int] = field(default_factory=lambda: dict.fromkeys(COMPARED, 1))
    sensor: str | None = None
    models: Mapping[str, ModelConfig] = field(default_factory=lambda: _models({}, ""))
    questions: tuple[Question, ...] = ()
    n_question_seeds: int = 1
    unseen_class: str = "stroller"
    noisy_sensor: str = "kinect_v2"
    oracles: tuple[Told, ...] = get_args(Told)
    test_poses: Path | None = None
    test_objects: Path | None = None
    frame_counts: tuple[int, ...] = (140, 280, 555, 1110)
    tree_counts: tuple[int, ...] = (1, 2, 3)
    pixel_counts: tuple[int, ...] = (50, 100, 200, 500, 1000, 2000)
    n_resamples: int = 2000

    def __post_init__(self) -> None:
        _check_names("n_seeds", tuple(self.n_seeds), tuple(COMPARED))
        for name, count in self.n_seeds.items():
            check_number(f"n_seeds.{name}", count, 1, 1000)
        check_fields(self, {"n_resamples": (1, 10**6), "n_question_seeds": (1, self.n_seeds["oarf"])})
        _check_names("rows", self.rows, ROWS)
        _check_names("questions", self.questions, get_args(Question), least=0)
        _check_names("oracles", self.oracles, get_args(Told))
        _check_names("noisy_sensor", (self.noisy_sensor,), SENSOR_NAMES)
        if self.sensor is not None:
            _check_names("sensor", (self.sensor,), SENSOR_NAMES)
        _check_names("unseen_class", (self.unseen_class,), OCCLUDER_CLASSES[1:])
        for question, name, most in (
            ("frames", "frame_counts", self.corpus.train_frames),
            ("trees", "tree_counts", self.regression_forest.n_trees),
            ("pixels", "pixel_counts", 2**24),
        ):
            check_fields(self, {name: (1, most if question in self.questions else MAX_FRAMES)})

    def plain(self) -> dict[str, Any]:
        """The settings by name as a file has them: those of each kind of model in a table of its own."""
        settings = asdict(self)
        models: dict[str, Any] = settings.pop("models")
        return settings | models

    @property
    def regression_forest(self) -> Any:
        """Settings of the regression forests, which the questions about trees and pixels vary."""
        return self.models["oarf"]


def load_config(size: Size, path: Path | None = None) -> AblationConfig:
    """The configuration of a size, with a TOML file's settings before it.

    Args:
        size: One that is shipped.
        path: A file with some of an `AblationConfig`'s settings.

    Raises:
        UserError: The file is missing, no TOML, or has unknown or wrong settings.
    """
    table = merged(_shipped(SCENES), _shipped(size))
    where = f"{size}.toml" if path is None else str(path)
    table = table if path is None else merged(table, read_toml(path))
    models = _models({name: table.pop(name) for name in COMPARED if name in table}, where)
    return from_table(AblationConfig, table, where, models=models)


def _models(tables: Mapping[str, object], where: str) -> dict[str, ModelConfig]:
    """Settings of every kind of model out of a file's tables.

    Those left out keep their defaults, but that each joint is found on its own, as by the forests of the paper.
    """
    wrong = [name for name, table in tables.items() if not isinstance(table, Mapping)]
    if wrong:
        raise UserError(f"{where}.{wrong[0]}={tables[wrong[0]]!r} must be a table")
    models: dict[str, ModelConfig] = {}
    for name, kind in COMPARED.items():
        table: Mapping[str, object] = tables.get(name, {})  # type: ignore[assignment]
        alone = {} if kind.is_net else {"learn_skeleton": False}
        models[name] = from_table(kind.config_class(), {**alone, **table}, f"{where}.{name}")
    return models


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


def _check_names(name: str, given: tuple[str, ...], known: tuple[str, ...], least: int = 1) -> None:
    unknown = [item for item in given if item not in known]
    if unknown:
        raise ValueError(f"{name}: {', '.join(map(repr, unknown))} is unknown; known are {', '.join(known)}")
    if len(set(given)) < len(given) or len(given) < least:
        raise ValueError(f"{name}={list(given)} must hold at least {least} names, all different")
