"""What an ablation's configuration asks for: conditions, and the work behind them."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar, get_args

from pipelines.ablate.config import FOREST_ROWS, REGRESSION_ROWS, AblationConfig, Question, Told
from pipelines.ablate.jobs import CorpusJob, ScoringJob, Selection, TrainingJob
from pipelines.ablate.libraries import Libraries
from pipelines.corpus.rooms.views import Place
from pipelines.models.kinds import VARIANTS, ModelConfig
from synth.scene.config import SceneWeights
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights

_ORACLES_COMPARED: Mapping[Told | None, tuple[Told | None, ...]] = {"classes": (None, "mask")}
"""What a truth is compared with, beside others nothing alone: the mask is what classes tell without names."""
ROOM_PEOPLE = (1, 4)
"""People in a frame of the question rooms."""
Setting = str | int | bool | None
"""A condition's value of what its question varies."""
_Job = TypeVar("_Job", CorpusJob, TrainingJob, ScoringJob)


@dataclass(frozen=True)
class Condition:
    """Methods that are compared with one another.

    Attributes:
        question: What is asked; None = the main table.
        settings: What this condition has, beside others of its question.
        scorings: Of each method, one a seed.
        compared: Scorings of other conditions, by a name, that each method is compared with itself in.
    """

    question: Question | None
    settings: tuple[tuple[str, Setting], ...]
    scorings: tuple[ScoringJob, ...]
    compared: tuple[tuple[str, tuple[ScoringJob, ...]], ...] = ()

    @property
    def rows(self) -> tuple[str, ...]:
        """The methods, in order."""
        return tuple(dict.fromkeys(job.training.row for job in self.scorings))

    def of_row(self, row: str) -> tuple[ScoringJob, ...]:
        """A method's scorings, by seed."""
        return tuple(job for job in self.scorings if job.training.row == row)


@dataclass(frozen=True)
class Plan:
    """All work of an ablation.

    Attributes:
        conditions: The main table first.
    """

    conditions: tuple[Condition, ...]

    @property
    def scorings(self) -> tuple[ScoringJob, ...]:
        """Each once."""
        return _once(job for condition in self.conditions for job in condition.scorings)

    @property
    def trainings(self) -> tuple[TrainingJob, ...]:
        """Each once."""
        return _once(job.training for job in self.scorings)

    @property
    def corpora(self) -> tuple[CorpusJob, ...]:
        """Each once."""
        return _once(corpus for job in self.scorings for corpus in (job.training.corpus, job.corpus))


def _once(jobs: Iterable[_Job]) -> tuple[_Job, ...]:
    return tuple({job.key: job for job in jobs}.values())


def make_plan(config: AblationConfig, libraries: Libraries | None = None) -> Plan:
    """Plans the main table and every question asked.

    Conditions of a question differ in what it asks about alone; those that equal work of the main table share it.

    Args:
        config: What is asked.
        libraries: What the question imported tests on.
    """
    main = Condition(None, (), tuple(_main(config)))
    known = libraries or Libraries()
    asked = [condition for name in config.questions for condition in QUESTIONS[name](config, known)]
    return Plan((main, *asked))


def _main(config: AblationConfig) -> Iterator[ScoringJob]:
    for row in config.rows:
        for number in range(config.n_seeds.get(VARIANTS[row].name, 1)):
            yield scoring(config, row, number)


def scoring(config: AblationConfig, row: str, number: int) -> ScoringJob:
    """A method trained with its seed of that number and scored as the main table has it."""
    corpus = config.corpus
    training = TrainingJob(
        row,
        _settings(config, row, number),
        CorpusJob(corpus),
        Selection("train", corpus.train_frames),
        Selection("val", corpus.val_frames),
        config.sensor,
    )
    return ScoringJob(training, training.corpus, Selection("test", corpus.test_frames), config.sensor)


def _settings(config: AblationConfig, row: str, number: int) -> ModelConfig:
    """Settings of a method's training of that number."""
    kind = VARIANTS[row]
    settings: Any = config.models[kind.name]
    return replace(settings, **kind.variants[row].settings, seed=settings.seed + number)


def _condition(
    config: AblationConfig,
    question: Question,
    settings: Mapping[str, Setting],
    training: Mapping[str, Any] | None = None,
    asked: Mapping[str, Any] | None = None,
    rows: Iterable[str] = REGRESSION_ROWS,
) -> Condition:
    """A condition of the main table's methods with other fields of their trainings and of their scorings."""
    scorings = []
    for row in (row for row in rows if row in config.rows):
        for number in range(config.n_question_seeds):
            job = scoring(config, row, number)
            other = replace(job.training, **training or {})
            scorings.append(replace(job, training=other, **asked or {}))
    return Condition(question, tuple(settings.items()), tuple(scorings))


def _ask_context(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    for is_kept in (True, False):
        scene = replace(config.corpus.scene, is_context_kept=is_kept)
        corpus = CorpusJob(replace(config.corpus, scene=scene))
        yield _condition(config, "context", {"is_context_kept": is_kept}, {"corpus": corpus}, {"corpus": corpus})


def _ask_paper_scenes(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    """The paper's objects: tables, half of them with a laptop that is typed on, and the seats before them."""
    scenes = SceneWeights(**dict.fromkeys(SceneWeights.names(), 0.0) | {"table": 0.5, "laptop_table": 0.5})
    for is_paper in (False, True):
        scene = replace(config.corpus.scene, scenes=scenes) if is_paper else config.corpus.scene
        corpus = CorpusJob(replace(config.corpus, scene=scene))
        settings = {"objects": "tables and laptops" if is_paper else "all"}
        yield _condition(config, "paper_scenes", settings, {"corpus": corpus}, {"corpus": corpus})


def _ask_unseen_class(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    """Both train on as many frames and tune on the same."""
    name, corpus = config.unseen_class, config.corpus
    val = Selection("val", corpus.val_frames, "without", name)
    test = Selection("test", corpus.test_frames, "showing", name)
    for is_seen in (True, False):
        train = Selection("train", corpus.train_frames, "as_many" if is_seen else "without", name)
        settings = {"class": name, "is_seen_in_training": is_seen}
        yield _condition(config, "unseen_class", settings, {"train": train, "val": val}, {"test": test})


def _ask_sensor(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    """Of the methods that learn from what the sensor sees: bodies alone have no noise."""
    for in_training in (None, config.noisy_sensor):
        for in_test in (None, config.noisy_sensor):
            settings = {"in_training": in_training, "in_test": in_test}
            rows: tuple[str, ...] = ("occluders", "semantic")
            yield _condition(config, "sensor", settings, {"sensor": in_training}, {"sensor": in_test}, rows)


def _ask_imported(config: AblationConfig, libraries: Libraries) -> Iterator[Condition]:
    """The main table's forests, all trainings of them, on test frames of another origin."""
    for objects in dict.fromkeys((None, libraries.objects)):
        for poses in dict.fromkeys((None, libraries.poses)):
            settings = {
                "poses": "recorded" if poses else "procedural",
                "objects": "imported" if objects else "procedural",
            }
            corpus = CorpusJob(config.corpus, Libraries(poses, objects))
            scorings = tuple(replace(job, corpus=corpus) for job in _main(config))
            yield Condition("imported", tuple(settings.items()), scorings)


def models_of(config: AblationConfig) -> Mapping[str, Any]:
    """The settings of every kind of model, whose fields differ."""
    return config.models


def _ask_skeletons(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    """The same forests, told to learn one skeleton out of their proposals, and with each joint on its own."""
    for is_one in (True, False):
        settings = {"is_one_skeleton": is_one}
        yield _condition(_learning_skeletons(config, is_one), "skeletons", settings, rows=FOREST_ROWS)


def _learning_skeletons(config: AblationConfig, is_one: bool) -> AblationConfig:
    """The same ablation with models that make, or do not make, one skeleton of their proposals."""
    forests = {VARIANTS[row].name for row in FOREST_ROWS}
    models = {
        name: replace(settings, learn_skeleton=is_one) if name in forests else settings
        for name, settings in models_of(config).items()
    }
    return replace(config, models=models)


def _ask_oracles(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    """The semantic forest, told nothing but depth, and told one truth after the other, in training and in test."""
    config = _learning_skeletons(config, False)
    scorings: dict[Told | None, tuple[ScoringJob, ...]] = {}
    for truth in (None, *(told for told in get_args(Told) if told in config.oracles)):
        settings = {"told": truth or "nothing"}
        condition = _condition(config, "oracles", settings, {"told": truth}, rows=("semantic",))
        others = [name for name in _ORACLES_COMPARED.get(truth, (None,)) if name in scorings]
        yield replace(condition, compared=tuple((f"told {name or 'nothing'}", scorings[name]) for name in others))
        scorings[truth] = condition.scorings


def _ask_frames(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    for count in config.frame_counts:
        yield _condition(config, "frames", {"n_train_frames": count}, {"train": Selection("train", count)})


def _ask_trees(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    for count in config.tree_counts:
        n_trees = 0 if count == config.regression_forest.n_trees else count
        yield _condition(config, "trees", {"n_trees": count}, asked={"n_trees": n_trees})


def _ask_pixels(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    for count in config.pixel_counts:
        n_pixels = 0 if count == config.regression_forest.n_voting_pixels else count
        yield _condition(config, "pixels", {"n_voting_pixels": count}, asked={"n_pixels": n_pixels})


def _ask_rooms(config: AblationConfig, _: Libraries) -> Iterator[Condition]:
    """The same people of the same rooms, with the noise of a sensor: cut out by their true masks, and in the room.

    Forests learn as they are asked, but that in the room they learn from places as far off as a finder's, and are asked
    at the true places and at those that the finder finds.
    """
    kinds = RoomWeights(living=1.0, office=1.0, hall=1.0)
    scene = replace(config.corpus.scene, room=RoomConfig(kinds=kinds), people=PeopleConfig(number=ROOM_PEOPLE))
    corpus = CorpusJob(replace(config.corpus, scene=scene))
    places: tuple[tuple[str, Place, Place], ...] = (
        ("cut out", "mask", "mask"),
        ("in the room", "near", "true"),
        ("in the room", "near", "found"),
    )
    cut_outs: tuple[tuple[str, tuple[ScoringJob, ...]], ...] = ()
    for image, in_training, in_test in places:
        settings = {"people": image, "box": "found" if in_test == "found" else "true"}
        alike = {"corpus": corpus, "sensor": config.noisy_sensor}
        training, asked = alike | {"place": in_training}, alike | {"place": in_test}
        condition = _condition(config, "rooms", settings, training, asked, config.rows)
        yield replace(condition, compared=cut_outs)
        cut_outs = cut_outs or (("cut out", condition.scorings),)


QUESTIONS: dict[Question, Callable[[AblationConfig, Libraries], Iterator[Condition]]] = {
    "context": _ask_context,
    "paper_scenes": _ask_paper_scenes,
    "unseen_class": _ask_unseen_class,
    "sensor": _ask_sensor,
    "imported": _ask_imported,
    "skeletons": _ask_skeletons,
    "oracles": _ask_oracles,
    "frames": _ask_frames,
    "trees": _ask_trees,
    "pixels": _ask_pixels,
    "rooms": _ask_rooms,
}
