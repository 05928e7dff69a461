"""Pieces of an ablation's work, each with a key: a digest of all that its result depends on."""

import functools
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipelines.ablate.config import CorpusConfig, Told
from pipelines.ablate.digests import digest_of, sources_digest, versions
from pipelines.ablate.libraries import Libraries
from pipelines.corpus import Corpus
from pipelines.corpus.header import version_of
from pipelines.corpus.rooms.views import Place
from pipelines.errors import UserError
from pipelines.models.kinds import VARIANTS, ModelConfig, ModelKind
from pipelines.spread import evenly_spread
from synth.scene import SceneConfig
from synth.scene.config import SplitShares

_HINTS_SOURCE = "pipelines/ablate/hints.py"
_ROOMS_SOURCE = "pipelines/corpus/rooms"
_SCORING_SOURCES = ("pipelines/corpus", "pipelines/metrics", "pipelines/models/asking.py")


@dataclass(frozen=True)
class CorpusJob:
    """A corpus to be made.

    Attributes:
        config: What it holds.
        imported: What its frames take besides what is drawn; with any, it holds the test frames alone.
    """

    config: CorpusConfig
    imported: Libraries = field(default_factory=Libraries)

    @functools.cached_property
    def key(self) -> str:
        """Digest of the corpus."""
        what = (self.config.seed, self.scene, self.counts, self.imported.digests)
        return digest_of("corpus", what, versions(), sources_digest("synth"))

    @functools.cached_property
    def source_key(self) -> str:
        """Digest of where its frames come from: frame i of a split is the same for any numbers of frames."""
        scene = replace(self.config.scene, splits=SplitShares())
        what = (self.config.seed, scene, self.imported.digests)
        return digest_of("frames", what, versions(), sources_digest("synth"))

    @property
    def counts(self) -> tuple[int, int, int]:
        """Frames of train, val and test."""
        config = self.config
        if self.imported:
            return 0, 0, config.test_frames
        return config.train_frames, config.val_frames, config.test_frames

    @property
    def n_frames(self) -> int:
        """Frames of all splits."""
        return sum(self.counts)

    @property
    def scene(self) -> SceneConfig:
        """What the scenes are drawn from, splits by the numbers of frames."""
        return replace(self.config.scene, splits=SplitShares(*map(float, self.counts)))


@dataclass(frozen=True)
class Selection:
    """Frames by rule.

    Attributes:
        split: Name of the split.
        n: The first so many of it.
        rule: all: all of these; without: those that show no object of the class; showing: those that do;
            as_many: as many as `without` takes, evenly spread over all.
        class_name: The rule's class of objects.
    """

    split: Literal["train", "val", "test"]
    n: int
    rule: Literal["all", "without", "showing", "as_many"] = "all"
    class_name: str = ""

    def of(self, corpus: Corpus) -> NDArray[np.int64]:
        """The frames' numbers.

        Raises:
            UserError: The rule leaves none.
        """
        numbers = corpus.split(self.split)[: self.n]
        if self.rule != "all":
            is_shown = np.array([_shows(corpus, int(i), self.class_name) for i in numbers], np.bool_)
            n_without = int((~is_shown).sum())
            spread = numbers[evenly_spread(len(numbers), n_without)]
            numbers = {"without": numbers[~is_shown], "showing": numbers[is_shown], "as_many": spread}[self.rule]
        if not len(numbers):
            raise UserError(
                f"the split {self.split} has no frames left for the rule {self.rule} {self.class_name}".rstrip()
            )
        return numbers


def _of_rooms(place: Place | None) -> tuple[Place, ...]:
    """What keys hold of it: nothing of single people, whose keys do not know of rooms."""
    return () if place is None else (place,)


def _shows(corpus: Corpus, index: int, class_name: str) -> bool:
    objects = corpus.info(index).objects
    return any(item.class_name == class_name and item.visible_fraction > 0 for item in objects)


@dataclass(frozen=True)
class TrainingJob:
    """A model to be trained.

    Attributes:
        row: Name of the method.
        config: How the model is trained, seed included.
        corpus: Where the frames come from.
        train: Frames to learn from.
        val: Frames to tune on.
        sensor: Sensor model of both.
        told: What the trees are told of every frame beside its depth, in scoring too.
        place: Where the people of rooms are cut out; None for a corpus of single people.
    """

    row: str
    config: ModelConfig
    corpus: CorpusJob
    train: Selection
    val: Selection
    sensor: str | None = None
    told: Told | None = None
    place: Place | None = None

    @property
    def kind(self) -> ModelKind:
        """The kind of model."""
        return VARIANTS[self.row]

    @functools.cached_property
    def key(self) -> str:
        """Digest of the model."""
        frames = (self.corpus.source_key, self.train, self.val, self.sensor, self.told, *_of_rooms(self.place))
        return digest_of("model", self.kind.name, self.config, frames, self._versions, self._sources)

    @property
    def _versions(self) -> dict:
        return versions() | ({"torch": version_of("torch")} if self.kind.is_net else {})

    @property
    def _sources(self) -> str:
        nets = ("nets",) if self.kind.is_net else ()
        told = () if self.told is None else (_HINTS_SOURCE,)
        rooms = () if self.place is None else (_ROOMS_SOURCE,)
        return sources_digest("forests", *nets, *told, *rooms)

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.row}-{self.config.seed}-{self.key[:12]}"


@dataclass(frozen=True)
class ScoringJob:
    """A model to be scored.

    Attributes:
        training: The model.
        corpus: Where the test frames come from.
        test: Frames of it.
        sensor: Sensor model of them.
        n_trees: The first so many trees are asked; 0 = all.
        n_pixels: Pixels that vote; 0 = as trained.
        place: Where the people of rooms are cut out; None for a corpus of single people.
    """

    training: TrainingJob
    corpus: CorpusJob
    test: Selection
    sensor: str | None = None
    n_trees: int = 0
    n_pixels: int = 0
    place: Place | None = None

    @functools.cached_property
    def key(self) -> str:
        """Digest of the rows."""
        asked = (
            self.corpus.source_key,
            self.test,
            self.sensor,
            self.n_trees,
            self.n_pixels,
            *_of_rooms(self.place),
        )
        return digest_of("rows", self.training.key, asked, sources_digest(*_SCORING_SOURCES))

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.training.row}-{self.training.config.seed}-{self.key[:12]}"
