"""undergrowth train oarf, undergrowth train rwf: a forest out of a corpus."""

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
import tyro
from numpy.typing import NDArray
from tqdm import tqdm

from forests.calibration import WITHIN_M
from forests.frames import LabelTable
from forests.modelfile import ModelFileError, read_model
from forests.oarf.config import OARFConfig
from forests.records import to_json
from forests.rwf.config import RWFConfig
from pipelines.commands.evaluate import spread
from pipelines.corpus.header import software_versions
from pipelines.corpus.joined import JoinedFrames, digests_of, open_corpora, sensors_of
from pipelines.corpus.read import Corpus
from pipelines.corpus.sequence import LABELS, CorpusFrames
from pipelines.errors import UserError
from pipelines.metrics import errors, read_truths
from pipelines.models.asking import contestant_of, predict_frames
from pipelines.models.checkpoints import TreeFolder, open_trees
from pipelines.settings import from_table, read_toml
from synth.vocabulary import JointState

log = logging.getLogger(__name__)


class ForestKind(NamedTuple):
    """What training needs to know of a kind of forest.

    Attributes:
        train: Frames and config to a model, with a `TreeStore`.
        save: Writes a model.
        predictor: A model ready to be asked.
        pack_tree: A tree as arrays.
        unpack_tree: Arrays, label table and config to a tree.
    """

    train: Callable[..., Any]
    save: Callable[[Path, Any, dict[str, Any]], None]
    predictor: Callable[[Any], Any]
    pack_tree: Callable[[Any], dict[str, np.ndarray]]
    unpack_tree: Callable[[dict[str, np.ndarray], LabelTable, Any], Any]


def _regression_forests() -> ForestKind:
    from forests.oarf.predict import Predictor
    from forests.oarf.storage import pack_tree, save_model, unpack_tree
    from forests.oarf.train import train

    return ForestKind(train, save_model, Predictor, pack_tree, unpack_tree)


def _random_walk_forests() -> ForestKind:
    from forests.rwf.predict import Predictor
    from forests.rwf.storage import pack_tree, save_model, unpack_tree
    from forests.rwf.train import train

    return ForestKind(train, save_model, Predictor, pack_tree, unpack_tree)


KINDS: dict[str, Callable[[], ForestKind]] = {"oarf": _regression_forests, "rwf": _random_walk_forests}


@dataclass(frozen=True)
class TrainSettings:
    """Settings of training that all kinds of forests share; `forest` is the kind's own config."""

    kind: ClassVar[str]
    forest_class: ClassVar[type]

    corpora: Annotated[tuple[Path, ...], tyro.conf.Positional]
    out: Path
    config: Path | None = None
    sensor: str | None = None
    max_frames: int = 0
    threads: int = 1
    overwrite: bool = False
    forest: Any = None

    def __post_init__(self) -> None:
        if not self.corpora:
            raise ValueError("corpora: name at least one folder")
        for name, least in {"max_frames": 0, "threads": 1}.items():
            if getattr(self, name) < least:
                raise ValueError(f"{name}={getattr(self, name)} must be at least {least}")

    @classmethod
    def from_toml(cls, path: Path) -> Self:
        """Defaults out of a TOML file; corpora and model file are still missing."""
        table = read_toml(path)
        forest: Any = from_table(cls.forest_class, _section(table, path), f"{path}.forest")
        own = from_table(_FileSettings, {k: v for k, v in table.items() if k != "forest"}, str(path))
        given = {item.name: getattr(own, item.name) for item in fields(own) if item.name != "forest"}
        return cls(tyro.MISSING, tyro.MISSING, path, **given, forest=forest)

    def run(self) -> int:
        """Trains the forest and writes it."""
        check_target(self.out, self.overwrite)
        corpora = open_corpora(self.corpora)
        frames, validation = (self._frames(corpora, split) for split in ("train", "val"))
        for line in (*_told(frames, validation, self.sensor), *_lacking(frames, self.forest)):
            log.info("%s", line)
        kind = KINDS[self.kind]()
        facts = {
            "corpus": digests_of(corpora),
            "sensor": self.sensor,
            "max_frames": self.max_frames,
            "software": software_versions(),
        }
        store: TreeFolder[Any] = TreeFolder(
            self.out.with_name(self.out.name + ".partial"),
            facts | {"kind": self.kind, "config": to_json(self.forest), "labels": to_json(LABELS)},
            kind.pack_tree,
            lambda arrays: kind.unpack_tree(arrays, LABELS, self.forest),
        )
        with open_trees(store, self.overwrite):
            if store.n_trees:
                log.info("going on after %d trees in %s", store.n_trees, store.path)
            model = self._train(kind, frames, validation, store)
            scores = _scores(kind.predictor(model), validation, self.threads)
            n_frames = {"train": len(frames), "val": len(validation)}
            kind.save(self.out, model, facts | {"n_frames": n_frames, "scores": scores})
            store.clear()
        if scores:
            log.info(
                "%.1f %% of the val joints within 10 cm (it was tuned on them)", 100 * scores["accuracy_10cm"]
            )
        log.info("%s: %.1f MB", self.out, self.out.stat().st_size / 1e6)
        return 0

    def _frames(self, corpora: Sequence[Corpus], split: str) -> JoinedFrames:
        pairs = zip(corpora, sensors_of(corpora, self.sensor), strict=True)
        chosen = (CorpusFrames(one, spread(one.split(split), self.max_frames), sensor) for one, sensor in pairs)
        return JoinedFrames(tuple(chosen))

    def _train(self, kind: ForestKind, frames: JoinedFrames, validation: JoinedFrames, store: TreeFolder) -> Any:
        layout = "{percentage:3.0f}%|{bar}| {elapsed}, {remaining} left"
        with tqdm(total=1.0, bar_format=layout, delay=2.0, smoothing=0, dynamic_ncols=True) as bar:
            try:
                return kind.train(
                    frames,
                    self.forest,
                    validation=validation,
                    n_threads=self.threads,
                    checkpoint=store,
                    on_progress=lambda share: bar.update(share - bar.n),
                )
            except KeyboardInterrupt:
                log.info("%d finished trees are kept; the same command goes on after them", store.n_trees)
                raise
            except ValueError as error:
                raise UserError(f"training on {', '.join(map(str, self.corpora))}: {error}") from None


@dataclass(frozen=True)
class TrainOarfSettings(TrainSettings):
    """Trains a regression forest on the train splits of one or more corpora and tunes it on their val splits.

    Run again, it goes on after the last finished tree; the same settings give the same bytes.

    Attributes:
        corpora: Folders of the corpora, whose frames are learned together.
        out: File of the model.
        config: TOML file with any of these settings; those on the command line go before it.
        sensor: Sensor model for the depth of generated frames; by default clean depth.
        max_frames: Take so many frames of each split of each corpus only, evenly spread; 0 takes all.
        threads: Threads; the model does not depend on it.
        overwrite: Replace a model that is there, drop trees of another training.
        forest: How the forest is trained.
    """

    kind = "oarf"
    forest_class = OARFConfig

    forest: Annotated[OARFConfig, tyro.conf.arg(name="")] = field(default_factory=OARFConfig)


@dataclass(frozen=True)
class TrainRwfSettings(TrainSettings):
    """Trains a random walk forest on the train splits of one or more corpora and tunes it on their val splits.

    Run again, it goes on after the last finished tree; the same settings give the same bytes.

    Attributes:
        corpora: Folders of the corpora, whose frames are learned together.
        out: File of the model.
        config: TOML file with any of these settings; those on the command line go before it.
        sensor: Sensor model for the depth of generated frames; by default clean depth.
        max_frames: Take so many frames of each split of each corpus only, evenly spread; 0 takes all.
        threads: Threads; the model does not depend on it.
        overwrite: Replace a model that is there, drop trees of another training.
        forest: How the forest is trained.
    """

    kind = "rwf"
    forest_class = RWFConfig

    forest: Annotated[RWFConfig, tyro.conf.arg(name="")] = field(default_factory=RWFConfig)


@dataclass(frozen=True)
class _FileSettings:
    sensor: str | None = None
    max_frames: int = 0
    threads: int = 1
    overwrite: bool = False
    forest: dict[str, Any] = field(default_factory=dict)


def _told(frames: JoinedFrames, validation: JoinedFrames, sensor: str | None) -> Iterator[str]:
    """What is learned from, in sentences."""
    for train, val in zip(frames.parts, validation.parts, strict=True):
        yield f"training on {len(train)} frames of {train.corpus.path}, tuning on {len(val)}"
    if measured := [str(part.corpus.path) for part in frames.parts if part.sensor != sensor]:
        yield f"sensor {sensor} measures generated frames alone, those of {', '.join(measured)} stay as recorded"


def _lacking(frames: JoinedFrames, forest: OARFConfig | RWFConfig) -> Iterator[str]:
    """What cannot be learned from training frames, in sentences.

    Raises:
        UserError: A corpus has no training frames, or they tell no joint.
    """
    is_told = np.any([_joints_told(part) for part in frames.parts], axis=0)
    if untold := [name for name, told in zip(LABELS.joints, is_told.tolist(), strict=True) if not told]:
        yield f"no training frame tells where these joints are, nothing is learned of them: {', '.join(untold)}"
    has_objects = any(part.corpus.info(int(number)).objects for part in frames.parts for number in part.indices)
    if isinstance(forest, OARFConfig) and forest.mode != "baseline" and not has_objects:
        yield f"no training frame shows an object: the mode {forest.mode} learns what the baseline learns"


def _joints_told(frames: CorpusFrames) -> NDArray[np.bool_]:
    """(n_joints,) bool, which joints any training frame of a corpus tells."""
    if not len(frames):
        raise UserError(f"{frames.corpus.path} has no frames of the split train")
    is_told: NDArray[np.bool_] = frames.corpus.arrays("joint_state", frames.indices) != JointState.UNKNOWN
    if not is_told.any():
        raise UserError(f"{frames.corpus.path} cannot be trained on: its training frames tell no joints")
    return np.asarray(is_told.any(axis=0))


def _section(table: dict[str, Any], path: Path) -> dict[str, Any]:
    section = table.get("forest", {})
    if not isinstance(section, dict):
        raise UserError(f"{path}.forest must be a table")
    return section


def check_target(path: Path, overwrite: bool) -> None:
    """Makes sure that a model may be written there.

    Raises:
        UserError: Something is there that must not be replaced, or the folder is missing.
    """
    if not path.parent.is_dir():
        raise UserError(f"{path.parent} is no folder; make it first")
    if not path.exists():
        return
    try:
        read_model(path)
    except ModelFileError as error:
        raise UserError(f"{error}; it is not overwritten, choose another file") from None
    if not overwrite:
        raise UserError(f"{path} is there already; give --overwrite to replace it")


def _scores(predictor: Any, validation: JoinedFrames, n_threads: int) -> dict[str, float] | None:
    """Share of the known joints within 10 cm on the validation frames of all corpora; None without any."""
    contestant = replace(contestant_of("trained", predictor), classes=None)
    of_corpora = [np.empty(0)]
    for part in filter(len, validation.parts):
        results, _ = predict_frames(contestant, part, read_truths(part.corpus, part.indices), n_threads)
        of_corpora.append(errors(results).ravel())
    error = np.concatenate(of_corpora)
    error = error[~np.isnan(error)]
    return {"accuracy_10cm": round(float((error <= WITHIN_M).mean()), 6)} if len(error) else None
