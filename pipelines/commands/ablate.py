"""undergrowth ablate: trains and scores all methods on one corpus."""

import json
import logging
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from pipelines.ablate.ablation import run_ablation, usable_cores
from pipelines.ablate.config import Question, Size, asked, load_config
from pipelines.ablate.schema import DOCUMENT_NAME
from pipelines.ablate.terminal import table_lines
from pipelines.drawing.files import write_picture
from pipelines.errors import UserError
from pipelines.orientation import ablation, table
from pipelines.orientation.opening import check_torch
from pipelines.targets import check_folder
from storage.ranges import MAX_THREADS, check_fields

_COUNTS_NAME, _TURNING_NAME = "orientation.png", "turning.png"
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class AblateSettings:
    """Trains every method on the same frames, scores them all on the same test frames and prints the differences.

    If it is interrupted, the same command continues where it stopped.

    Attributes:
        size: The settings to start from: demo (takes minutes), paper (1110 training frames) or large (10000
            training frames). orientation compares nets that tell which way heads face instead; it needs
            undergrowth[nets].
        config: TOML file with any of these settings. They override those of the size.
        out: Folder for corpora, models, rows and ablation.json (orientation.json). Finished work in it is reused.
        questions: Further questions to answer. They replace those of the settings.
        poses: Library of poses for the question imported, made by `undergrowth import mocap`.
        objects: Library of objects for the question imported, made by `undergrowth import meshes`.
        threads: Number of threads, and of processes that make frames. The scores do not depend on it.
        json: Print one JSON object instead of a table.
    """

    size: Size | Literal["orientation"] = "paper"
    config: Path | None = None
    out: Path = Path("out/ablation")
    questions: tuple[Question, ...] = ()
    poses: Path | None = None
    objects: Path | None = None
    threads: int = field(default_factory=usable_cores)
    json: bool = False

    def __post_init__(self) -> None:
        check_fields(self, {"threads": (1, MAX_THREADS)})

    def run(self) -> int:
        """Runs the ablation and prints its table."""
        if self.size == "orientation":
            return self._run_orientation()
        check_folder(self.out, [DOCUMENT_NAME])
        config = load_config(self.size, self.config)
        config = asked(config, self.questions, self.poses, self.objects)
        document = run_ablation(config, self.out, self.threads)
        if self.json:
            sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
            return 0
        for line in table_lines(document):
            log.info("%s", line)
        log.info("")
        log.info("rows, models and scores: %s", self.out)
        return 0

    def _run_orientation(self) -> int:
        """Runs the ablation of orientation nets and prints its table."""
        if self.questions or self.poses or self.objects:
            raise UserError("--questions, --poses and --objects are for models that find joints")
        check_torch()
        check_folder(self.out, [ablation.DOCUMENT_NAME, _COUNTS_NAME, _TURNING_NAME])
        config = ablation.ablation_config(self.config)
        document = ablation.run_orientation_ablation(config, self.out, self.threads)
        write_picture(self.out / _COUNTS_NAME, table.counts_picture(document))
        n_bins = 8 if 8 in config.bins else max(config.bins)
        write_picture(self.out / _TURNING_NAME, table.turning_picture(document, n_bins))
        if self.json:
            sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
            return 0
        for line in table.table_lines(document):
            log.info("%s", line)
        log.info("rows and scores: %s; answers against the truth: %s", self.out, self.out / _COUNTS_NAME)
        return 0
