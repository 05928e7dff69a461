"""undergrowth train orientation: a net that tells which way bodies or heads face, out of one or more corpora."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
import tyro

from forests.modelfile import read_model
from nets.orientation.config import OrientationConfig
from nets.orientation.frames import Patches
from pipelines.corpus.joined import open_corpora
from pipelines.corpus.read import Corpus
from pipelines.errors import UserError
from pipelines.models.training import partial_folder
from pipelines.orientation.opening import check_torch
from pipelines.orientation.scoring import validation_scores
from pipelines.orientation.training import check_patches, cut_patches, frames_of, identity_of, train_into
from pipelines.progress import Progress
from pipelines.settings import defaults_from
from pipelines.targets import check_file
from storage.ranges import MAX_FRAMES, MAX_THREADS, check_fields

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class TrainOrientationSettings:
    """Trains a net that tells which way people face on the train splits of corpora; needs undergrowth[nets].

    Its concentration is calibrated on their val splits. If it is interrupted, the same command continues after the
    last finished epoch. On the CPU the same settings and number of threads give the same weights.

    Attributes:
        corpora: Folders of the corpora. The net is trained on the frames of all of them together.
        out: File of the model.
        config: TOML file with any of these settings. Settings given on the command line override it.
        sensor: Name of a sensor model whose noise is added to the depth of generated frames. "random" adds that of
            another sensor to every frame; "ideal" leaves the depth clean.
        max_frames: Use at most this many frames of each split of each corpus, evenly spread; 0 uses all.
        threads: Number of threads. Another number gives slightly different weights.
        overwrite: Replace an existing model, and delete an unfinished training with other settings.
        net: How the net is trained.
    """

    corpora: Annotated[tuple[Path, ...], tyro.conf.Positional]
    out: Path
    config: Path | None = None
    sensor: str | None = "random"
    max_frames: int = 0
    threads: int = 1
    overwrite: bool = False
    net: Annotated[OrientationConfig, tyro.conf.arg(name="")] = field(default_factory=OrientationConfig)

    def __post_init__(self) -> None:
        if not self.corpora:
            raise ValueError("corpora: give at least one folder")
        check_fields(self, {"max_frames": (0, MAX_FRAMES), "threads": (1, MAX_THREADS)})

    @classmethod
    def from_toml(cls, path: Path) -> Self:
        """Defaults out of a TOML file; corpora and model file are still missing."""
        return defaults_from(cls, path, corpora=tyro.MISSING, out=tyro.MISSING)

    def run(self) -> int:
        """Trains the net and writes it.

        Raises:
            UserError: torch is missing, corpora that cannot be used, or a file that may not be replaced.
        """
        check_torch()
        check_file(self.out, read_model, self.overwrite)
        corpora = open_corpora(self.corpora)
        train, val = (self._patches(corpora, split) for split in ("train", "val"))
        check_patches(train, corpora, self.net)
        log.info(
            "training on %d patches of the %s, calibrating on %d",
            len(train.angle),
            self.net.region,
            len(val.angle),
        )
        scores = self._train(corpora, train, val)
        if scores:
            log.info("%s", "; ".join(f"{name} {value:g}" for name, value in scores.items()))
        log.info("%s: %.1f MB", self.out, self.out.stat().st_size / 1e6)
        return 0

    def _patches(self, corpora: Sequence[Corpus], split: str) -> Patches:
        return cut_patches(frames_of(corpora, split, self.net, self.sensor, self.max_frames), self.net)

    def _train(self, corpora: Sequence[Corpus], train: Patches, val: Patches) -> dict[str, float]:
        identity = identity_of(corpora, self.net, self.sensor, self.max_frames, self.threads)
        scores: dict[str, float] = {}

        def metadata(model: Any) -> dict[str, Any]:
            scores.update(validation_scores(model, val))
            counts = {"train": len(train.angle), "val": len(val.angle)}
            angles = np.histogram(train.angle, 12, (-np.pi, np.pi))[0].tolist()
            return {**identity, "n_frames": counts, "angles_by_12": angles, "scores": scores}

        partial = partial_folder(self.out)
        with Progress(name="train orientation") as bar:
            try:
                train_into(
                    self.out,
                    self.net,
                    train,
                    val,
                    identity=identity,
                    metadata=metadata,
                    n_threads=self.threads,
                    drops_others=self.overwrite,
                    on_resume=lambda n: log.info("continuing after %d finished epochs in %s", n, partial),
                    on_share=bar.set_done,
                )
            except KeyboardInterrupt:
                log.info("the last finished epoch is kept; run the same command to continue after it")
                raise
            except ValueError as error:
                raise UserError(f"training on {', '.join(map(str, self.corpora))}: {error}") from None
        return scores
