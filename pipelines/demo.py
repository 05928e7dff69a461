"""undergrowth demo: the whole story at a small size, from frames to a report."""

import logging
from dataclasses import dataclass, field
from pathlib import Path

from pipelines.ablate.command import AblateSettings, ablate, usable_cores
from pipelines.ablate.config import Size
from pipelines.ablate.terminal import table_lines
from pipelines.inspect import inspect
from pipelines.report.command import write_report
from pipelines.report.source import read_source

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class DemoSettings:
    """Makes frames, trains all forests on them, scores them, writes the report; minutes at the size demo.

    Run again, it goes on where it was interrupted.

    Attributes:
        out: Folder for corpus, models, scores, pictures and the report.
        size: Which settings of `undergrowth ablate`.
        config: TOML file with any of those settings; they go before the size's.
        threads: Threads, and processes that make frames; the scores do not depend on it.
    """

    out: Path = Path("out/demo")
    size: Size = "demo"
    config: Path | None = None
    threads: int = field(default_factory=usable_cores)

    def run(self) -> int:
        """Runs all steps; ends with the table and the report's path."""
        results = self.out / "ablation"
        document = ablate(AblateSettings(self.size, self.config, results, threads=self.threads))
        source = read_source(results)
        write_report(source, self.out / "report.html")
        if source.corpus is not None:
            log.info("frames: %s", inspect(source.corpus, self.out / "inspect")[0])
        for line in table_lines(document):
            log.info("%s", line)
        log.info("")
        log.info("report: %s", self.out / "report.html")
        return 0
