"""undergrowth report: one page out of an ablation's folder."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.predicting.images import recording_layout
from pipelines.predicting.recording import Folder
from pipelines.recordings.plain import GivenCamera
from pipelines.report.source import read_source
from pipelines.report.write import recordings_of, write_report
from pipelines.targets import check_ours, check_place

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ReportSettings:
    """Writes the tables, charts and example frames of an ablation as one HTML file.

    Attributes:
        folder: Folder that `undergrowth ablate` wrote.
        out: The HTML file. By default it is report.html in the folder.
        corpus: The corpus of the main table, if it has been moved out of the folder.
        recorded: Folders of recorded depth. The page then also shows what the forests find there.
        layout: Name of the layout of these folders, or a .toml file. By default the layout is found from their
            contents.
        camera: Camera preset of these folders, if no layout describes them.
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
        if self.out is not None:
            check_place(out)
        check_ours(out, ".html")
        camera = GivenCamera(self.camera) if self.camera else None
        folders = [Folder(path, *recording_layout(path, self.layout, camera)) for path in self.recorded]
        source = read_source(self.folder, self.corpus)
        write_report(source, out, recordings_of(source, folders))
        log.info("%s", out)
        return 0
