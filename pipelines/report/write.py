"""Writes the page of an ablation, and asks its forests about recordings that the page shows too."""

import logging
from collections.abc import Sequence
from pathlib import Path

from pipelines.ablate.schema import DOCUMENT_NAME
from pipelines.errors import UserError
from pipelines.foreign import reading
from pipelines.predicting.recording import Folder, Recording, ask_recording
from pipelines.report.models import first_models
from pipelines.report.page import rendered
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
from pipelines.report.source import Source
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


def write_report(source: Source, out: Path, recordings: Sequence[Recording] = ()) -> None:
    """Writes the page to a file; its folder is made if it is not there."""
    out.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(out, report_page(source, recordings))


def report_page(source: Source, recordings: Sequence[Recording] = ()) -> str:
    """The page's HTML; the same for the same folders.

    Raises:
        UserError: The ablation's document is damaged.
    """
    with reading(source.folder / DOCUMENT_NAME, "the document of an ablation"):
        sections = [section(source) for section in SECTIONS]
        if recordings:
            place = SECTIONS.index(examples_section) + 1
            sections.insert(place, recorded_section(recordings))
        return rendered("page", title=TITLE, lead=lead(source), sections=sections)


def recordings_of(source: Source, folders: Sequence[Folder]) -> list[Recording]:
    """What the ablation's forests find in folders of recordings.

    Raises:
        UserError: The models do not lie in the ablation's folder, or a folder has no frames.
    """
    models = first_models(source) if folders else {}
    if folders and not models:
        raise UserError(f"{source.folder} holds no models that could predict the recorded frames")
    contestants = {name: model.contestant for name, model in models.items()}
    recordings = [ask_recording(folder, contestants) for folder in folders]
    for recording in recordings:
        for reason in recording.skipped:
            log.info("skipped: %s", reason)
    return recordings
