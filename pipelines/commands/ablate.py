"""undergrowth ablate: trains and scores all methods on one corpus."""

import json
import logging
import os
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.ablate.config import Question, Size, asked, load_config
from pipelines.ablate.document import make_document, write_document
from pipelines.ablate.folder import ResultsFolder
from pipelines.ablate.libraries import read_libraries
from pipelines.ablate.plan import make_plan
from pipelines.ablate.run import run_plan
from pipelines.ablate.terminal import table_lines
from pipelines.corpus.folder import locked_folder

log = logging.getLogger(__name__)


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
        document = ablate(self)
        if self.json:
            sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
            return 0
        for line in table_lines(document):
            log.info("%s", line)
        log.info("")
        log.info("rows, models and scores: %s", self.out)
        return 0


def ablate(settings: AblateSettings) -> dict:
    """Does all work that is not yet done, scores it, writes ablation.json.

    Returns:
        What ablation.json holds, see docs/ablation.md.

    Raises:
        UserError: Wrong settings, a folder in use, a full disk, damaged files in the folder.
    """
    begun = time.monotonic()
    config = load_config(settings.size, settings.config)
    config = asked(config, settings.questions, settings.poses, settings.objects)
    folder = ResultsFolder(settings.out)
    plan = make_plan(config, read_libraries(config))
    folder.prepare()
    with locked_folder(settings.out):
        run_plan(plan, folder, settings.threads)
        document = make_document(config, plan, folder)
        document["seconds_of_last_run"] = time.monotonic() - begun
        write_document(document, folder)
    return document
