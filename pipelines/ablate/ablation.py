"""A whole ablation: plans it, does what is not yet done, scores it, writes ablation.json."""

import os
import time
from pathlib import Path

from pipelines.ablate.config import AblationConfig
from pipelines.ablate.document import make_document, write_document
from pipelines.ablate.folder import ResultsFolder
from pipelines.ablate.libraries import read_libraries
from pipelines.ablate.plan import make_plan
from pipelines.ablate.run import run_plan
from pipelines.corpus.folder import locked_folder


def usable_cores() -> int:
    """Cores that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_ablation(config: AblationConfig, out: Path, n_threads: int) -> dict:
    """Does all work that is not yet done, scores it, writes ablation.json.

    Args:
        config: What is asked.
        out: Folder for corpora, models, rows and ablation.json; finished work in it is used again.
        n_threads: Threads, and processes that make frames; the scores do not depend on it.

    Returns:
        What ablation.json holds, see docs/ablation.md.

    Raises:
        UserError: A folder in use, a full disk, damaged files in the folder, or a library that cannot be used.
    """
    begun = time.monotonic()
    folder = ResultsFolder(out)
    plan = make_plan(config, read_libraries(config))
    folder.prepare()
    with locked_folder(out):
        run_plan(plan, folder, n_threads)
        document = make_document(config, plan, folder)
        document["seconds_of_last_run"] = time.monotonic() - begun
        write_document(document, folder)
    return document
