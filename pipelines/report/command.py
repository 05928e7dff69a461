"""undergrowth report: one page out of an ablation's folder."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.corpus.header import write_atomically
from pipelines.report.markup import document
from pipelines.report.sections.breakdowns import (
    classes_section,
    curves_section,
    joints_section,
    reliability_section,
)
from pipelines.report.sections.facts import configuration_section, lead, protocol_section
from pipelines.report.sections.gallery import examples_section
from pipelines.report.sections.questions import questions_section
from pipelines.report.sections.tables import detection_section, measures_section, pixels_section, precision_section
from pipelines.report.source import Source, read_source

log = logging.getLogger(__name__)

TITLE = "Joints behind objects: an ablation"
SECTIONS = (
    precision_section,
    detection_section,
    curves_section,
    joints_section,
    classes_section,
    examples_section,
    questions_section,
    pixels_section,
    reliability_section,
    measures_section,
    protocol_section,
    configuration_section,
)
"""Of the page, in order."""


@dataclass(frozen=True)
class ReportSettings:
    """Writes the tables, charts and example frames of an ablation as one HTML file.

    Attributes:
        folder: Where `undergrowth ablate` wrote.
        out: The file; by default report.html in the folder.
        corpus: The main table's corpus, if it does not lie in the folder any more.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    out: Path | None = None
    corpus: Path | None = None

    def run(self) -> int:
        """Writes the page and tells where."""
        out = self.out or self.folder / "report.html"
        write_report(read_source(self.folder, self.corpus), out)
        log.info("%s", out)
        return 0


def write_report(source: Source, out: Path) -> None:
    """Writes the page to a file."""
    out.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(out, report_page(source))


def report_page(source: Source) -> str:
    """The page's HTML; the same for the same folder."""
    return document(TITLE, lead(source), [section(source) for section in SECTIONS])
