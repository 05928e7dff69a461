"""undergrowth ablate: trains and scores all methods on one corpus."""

import json
import logging
import sys
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.ablate.ablation import run_ablation, usable_cores
from pipelines.ablate.config import Question, Size, asked, load_config
from pipelines.ablate.schema import DOCUMENT_NAME
from pipelines.ablate.terminal import table_lines
from pipelines.targets import check_folder
from storage.ranges import MAX_THREADS, check_fields

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class AblateSettings:
    """Trains every method on the same frames, scores them all on the same test frames and prints the differences.

    If it is interrupted, the same command continues where it stopped.

    Attributes:
        size: The settings to start from: demo (takes minutes), paper (1110 training frames) or large (10000
            training frames).
        config: TOML file with any of these settings. They override those of the size.
        out: Folder for corpora, models, rows and ablation.json. Finished work in it is reused.
        questions: Further questions to answer. They replace those of the settings.
        poses: Library of poses for the question imported, made by `undergrowth import mocap`.
        objects: Library of objects for the question imported, made by `undergrowth import meshes`.
        threads: Number of threads, and of processes that make frames. The scores do not depend on it.
        json: Print one JSON object instead of a table.
    """

    size: Size = "paper"
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
