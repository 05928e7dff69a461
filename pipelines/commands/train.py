"""undergrowth train KIND: a model of any kind out of one or more corpora."""

import contextlib
import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, make_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import numpy as np
import tyro
from numpy.typing import NDArray

from forests.calibration import WITHIN_M
from forests.estimate import JointPredictor
from forests.growing import Crew
from forests.modelfile import read_model
from forests.records import to_json
from pipelines.corpus.header import software_versions
from pipelines.corpus.joined import FrameChoice, JoinedFrames, digests_of, open_corpora
from pipelines.corpus.read import Corpus
from pipelines.corpus.rooms.views import PeopleFrames
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import UserError
from pipelines.metrics import errors
from pipelines.metrics.truths import truths_of_frames
from pipelines.models.asking import contestant_of, predict_frames
from pipelines.models.kinds import KINDS, ModelKind
from pipelines.models.training import n_finished_trees, partial_folder, train_into
from pipelines.progress import Progress
from pipelines.settings import defaults_from
from pipelines.targets import check_file
from storage.ranges import MAX_FRAMES, MAX_THREADS, check_fields
from storage.remote import url_of
from synth.vocabulary import JointState

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class TrainSettings:
    """The settings of training that all kinds of models share; `settings_of` adds those of the kind.

    Attributes:
        corpora: Folders of the corpora. The model is trained on the frames of all of them together; of rooms, on
            everybody in them who is 1 to 5 m away and at least a quarter visible.
        out: File of the model.
        config: TOML file with any of these settings. Settings given on the command line override it.
        sensor: Name of a sensor model whose noise is added to the depth of generated frames. "random" adds that of
            another sensor to every frame, for models that are asked about any camera; "ideal" leaves the depth
            clean.
        max_frames: Use at most this many frames of each split of each corpus, evenly spread; 0 uses all.
        threads: Number of threads. The model does not depend on it.
        scheduler: Dask scheduler whose workers read the frames and grow the trees: tcp://HOST:PORT, or local:N for N
            workers of this machine. All must see the corpora and the model's folder. Needs undergrowth[cluster].
        overwrite: Replace an existing model, and delete unfinished trees that were trained with other settings.
    """

    kind: ClassVar[ModelKind]

    corpora: Annotated[tuple[Path, ...], tyro.conf.Positional]
    out: Path
    config: Path | None = None
    sensor: str | None = "random"
    max_frames: int = 0
    threads: int = 1
    scheduler: str | None = None
    overwrite: bool = False

    def __post_init__(self) -> None:
        if not self.corpora:
            raise ValueError("corpora: give at least one folder")
        check_fields(self, {"max_frames": (0, MAX_FRAMES), "threads": (1, MAX_THREADS)})

    @classmethod
    def from_toml(cls, path: Path) -> Self:
        """Defaults out of a TOML file; corpora and model file are still missing."""
        return defaults_from(cls, path, corpora=tyro.MISSING, out=tyro.MISSING)

    @property
    def model(self) -> Any:
        """The kind's own settings."""
        return self.forest  # type: ignore[attr-defined]

    def run(self) -> int:
        """Trains the model and writes it."""
        check_file(self.out, read_model, self.overwrite)
        corpora = open_corpora(self.corpora)
        rooms = [str(corpus.path) for corpus in corpora if corpus.header.has_rooms]
        if rooms and not self.kind.learns_rooms:
            raise UserError(f"a {self.kind.title} learns from frames of one person; {rooms[0]} holds whole scenes")
        frames, validation = (self._choice(split).frames(corpora) for split in ("train", "val"))
        for line in (*_told(frames, validation, self.sensor), *_lacking(frames, self.kind, self.model)):
            log.info("%s", line)
        scores = self._train(corpora, frames, validation)
        if scores:
            log.info(
                "%.1f %% of the joints in the val split are within 10 cm (the model was tuned on this split)",
                100 * scores["accuracy_10cm"],
            )
        log.info("%s: %.1f MB", self.out, self.out.stat().st_size / 1e6)
        return 0

    def _choice(self, split: str) -> FrameChoice:
        return FrameChoice(self.corpora, split, self.sensor, self.max_frames)

    @contextlib.contextmanager
    def _crew(self) -> Iterator[Crew | None]:
        """The workers of the scheduler, if one is given."""
        if self.scheduler is None:
            yield None
            return
        from pipelines.cluster.crew import ClusterCrew
        from pipelines.engine.cluster import open_cluster

        if self.kind.is_net:
            raise UserError("nets are trained on one machine; leave --scheduler out")
        with open_cluster(self.scheduler) as cluster:
            folder = self.out.with_name(self.out.name + ".workers")
            choice = replace(
                self._choice("train"), corpora=tuple(p if url_of(p) else p.resolve() for p in self.corpora)
            )
            with ClusterCrew(cluster, folder.resolve(), choice) as crew:
                yield crew

    def _train(
        self, corpora: Sequence[Corpus], frames: JoinedFrames, validation: JoinedFrames
    ) -> dict[str, float] | None:
        """Writes the model and returns its scores on the validation frames."""
        facts = {
            "corpus": digests_of(corpora),
            "sensor": self.sensor,
            "max_frames": self.max_frames,
            "software": software_versions(),
        }
        if self.kind.is_net:
            facts |= {"threads": self.threads}
        identity = {"kind": self.kind.name, "config": to_json(self.model), "labels": to_json(frames.labels)}
        scores: dict[str, float] | None = None

        def metadata(model: Any) -> dict[str, Any]:
            nonlocal scores
            scores = _scores(self.kind.tools().predictor(model), validation, self.threads)
            return facts | {"n_frames": {"train": len(frames), "val": len(validation)}, "scores": scores}

        partial = partial_folder(self.out)
        with self._crew() as crew, Progress(name=f"train {self.kind.name}") as bar:
            try:
                train_into(
                    self.out,
                    self.kind,
                    self.model,
                    frames,
                    validation,
                    identity=facts | identity,
                    metadata=metadata,
                    n_threads=self.threads,
                    drops_others=self.overwrite,
                    on_resume=lambda n: log.info("continuing after %s in %s", self._pieces(n), partial),
                    on_share=bar.set_done,
                    crew=crew,
                )
            except KeyboardInterrupt:
                kept = self._pieces(n_finished_trees(self.out))
                log.info("%s are kept; run the same command to continue after them", kept)
                raise
            except ValueError as error:
                raise UserError(f"training on {', '.join(map(str, self.corpora))}: {error}") from None
        return scores

    def _pieces(self, n: int) -> str:
        """What is finished of a training, in words; of epochs the state after the last one is kept."""
        return f"{n} finished trees" if self.kind.piece == "tree" else f"all finished {self.kind.piece}s"


def settings_of(name: str) -> type[TrainSettings]:
    """The settings class of `undergrowth train NAME`: those that all kinds share, and the kind's own."""
    kind = KINDS[name]
    own = kind.config_class()
    cls = make_dataclass(
        f"Train{name.capitalize()}Settings",
        [("forest", Annotated[own, tyro.conf.arg(name="")], field(default_factory=own))],
        bases=(TrainSettings,),
        frozen=True,
        namespace={"kind": kind},
    )
    cls.__module__ = __name__
    cls.__doc__ = f"""Trains a {kind.title} on the train splits of corpora and tunes it on their val splits.

    If it is interrupted, the same command continues after the last finished {kind.piece}. The same settings give the
    same bytes{" on the same number of threads" if kind.is_net else ""}.

    Attributes:
        forest: How the {kind.title} is trained.
    """
    return cls


def _told(frames: JoinedFrames, validation: JoinedFrames, sensor: str | None) -> Iterator[str]:
    """What is learned from, in sentences."""
    for train, val in zip(frames.parts, validation.parts, strict=True):
        what = "people in rooms" if isinstance(train, PeopleFrames) else "frames"
        yield f"training on {len(train)} {what} of {train.corpus.path}, tuning on {len(val)}"
    if measured := [str(part.corpus.path) for part in frames.parts if part.sensor != sensor]:
        noise = "random sensors" if sensor == "random" else sensor
        yield f"the noise of {noise} is not added to the recorded frames of {', '.join(measured)}"


def _lacking(frames: JoinedFrames, kind: ModelKind, config: Any) -> Iterator[str]:
    """What cannot be learned from training frames, in sentences.

    Raises:
        UserError: A corpus has no training frames, or they tell no joint.
    """
    is_told = np.any([_joints_told(part) for part in frames.parts], axis=0)
    if untold := [name for name, told in zip(frames.labels.joints, is_told.tolist(), strict=True) if not told]:
        yield f"these joints are unknown in all training frames and are not learned: {', '.join(untold)}"
    if kind.needs_objects(config) and not _shows_objects(frames):
        yield "no training frame shows an object, so that nothing is learned of objects"


def _shows_objects(frames: JoinedFrames) -> bool:
    return any(part.corpus.record(int(number)).objects for part in frames.parts for number in part.indices)


def _joints_told(frames: CorpusFrames | PeopleFrames) -> NDArray[np.bool_]:
    """(n_joints,) bool, which joints any training frame of a corpus tells."""
    if not len(frames):
        what = "nobody to learn from in" if isinstance(frames, PeopleFrames) else "no frames of"
        raise UserError(f"{frames.corpus.path} has {what} the split train")
    is_told: NDArray[np.bool_] = frames.corpus.arrays("joint_state", frames.indices) != JointState.UNKNOWN
    if not is_told.any():
        raise UserError(
            f"{frames.corpus.path} cannot be used for training: no joint is known in its training frames"
        )
    return np.asarray(is_told.reshape(-1, is_told.shape[-1]).any(axis=0))


def _scores(predictor: JointPredictor, validation: JoinedFrames, n_threads: int) -> dict[str, float] | None:
    """Share of the known joints within 10 cm on the validation frames of all corpora; None without any."""
    contestant = replace(contestant_of("trained", predictor), labeller=None)
    of_corpora = [np.empty(0)]
    for part in filter(len, validation.parts):
        results, _ = predict_frames(contestant, part, truths_of_frames(part), n_threads)
        of_corpora.append(errors(results).ravel())
    error = np.concatenate(of_corpora)
    error = error[~np.isnan(error)]
    return {"accuracy_10cm": round(float((error <= WITHIN_M).mean()), 6)} if len(error) else None
