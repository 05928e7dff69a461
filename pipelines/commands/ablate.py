"""undergrowth ablate: trains and scores all methods on one corpus."""

import json
import logging
import sys
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.ablate.ablation import run_ablation, usable_cores
from pipelines.ablate.config import Question, Size, asked, load_config
from pipelines.ablate.terminal import table_lines

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class AblateSettings:
    """Trains and scores every method on one corpus; run again, it goes on where it was interrupted.

    Attributes:
        size: demo (minutes), paper (1110 training frames), large (10000): which settings to begin with.
        config: TOML file with any of those settings; they go before the size's.
        out: Folder for corpora, models, rows and ablation.json; finished work in it is used again.
        questions: What else is asked; goes before the settings' own.
        poses: Pose library that the question imported tests on (`undergrowth import mocap`).
        objects: Object library that it tests on (`undergrowth import meshes`).
        threads: Threads, and processes that make frames; the scores do not depend on it.
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
        if self.threads < 1:
            raise ValueError(f"threads={self.threads} must be at least 1")

    def run(self) -> int:
        """Runs the ablation and prints its table."""
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
