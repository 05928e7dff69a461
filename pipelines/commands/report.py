"""undergrowth report: one page out of an ablation's folder."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.errors import UserError
from pipelines.predicting.images import recording_layout
from pipelines.predicting.recording import Folder, Recording, ask_recording
from pipelines.recordings.plain import GivenCamera
from pipelines.report.markup import document
from pipelines.report.models import first_models
from pipelines.report.sections.breakdowns import (
    classes_section,
    curves_section,
    joints_section,
    reliability_section,
)
from pipelines.report.sections.facts import configuration_section, lead, protocol_section
from pipelines.report.sections.gallery import examples_section
from pipelines.report.sections.questions import questions_section
from pipelines.report.sections.recorded import recorded_section
from pipelines.report.sections.tables import detection_section, measures_section, pixels_section, precision_section
from pipelines.report.source import Source, read_source
from storage.atomic import write_atomically

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
        recorded: Folders of recorded depth; the page shows what the forests find there.
        layout: Name of the layout of these folders, or a .toml file; by default found from their contents.
        camera: Camera preset of these folders, where no layout describes them.
    """

    folder: Annotated[Path, tyro.conf.Positional]
    out: Path | None = None
    corpus: Path | None = None
    recorded: tuple[Path, ...] = ()
    layout: str | None = None
    camera: str | None = None

    def run(self) -> int:
        """Writes the page and tells where."""
        out = self.out or self.folder / "report.html"
        camera = GivenCamera(self.camera) if self.camera else None
        folders = [Folder(path, *recording_layout(path, self.layout, camera)) for path in self.recorded]
        source = read_source(self.folder, self.corpus)
        write_report(source, out, recordings_of(source, folders))
        log.info("%s", out)
        return 0


def recordings_of(source: Source, folders: Sequence[Folder]) -> list[Recording]:
    """What the ablation's forests find in folders of recordings.

    Raises:
        UserError: The models do not lie in the ablation's folder, or a folder has no frames.
    """
    models = first_models(source) if folders else {}
    if folders and not models:
        raise UserError(f"{source.folder} holds no models, so that none can be asked about recorded frames")
    contestants = {name: model.contestant for name, model in models.items()}
    recordings = [ask_recording(folder, contestants) for folder in folders]
    for recording in recordings:
        for reason in recording.skipped:
            log.info("skipped: %s", reason)
    return recordings


def write_report(source: Source, out: Path, recordings: Sequence[Recording] = ()) -> None:
    """Writes the page to a file."""
    out.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(out, report_page(source, recordings))


def report_page(source: Source, recordings: Sequence[Recording] = ()) -> str:
    """The page's HTML; the same for the same folders."""
    sections = [section(source) for section in SECTIONS]
    if recordings:
        place = SECTIONS.index(examples_section) + 1
        sections.insert(place, recorded_section(recordings))
    return document(TITLE, lead(source), sections)
