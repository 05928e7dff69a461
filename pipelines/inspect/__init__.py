"""undergrowth inspect: contact sheets and a page of statistics."""

import json
import logging
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import tyro

from pipelines.corpus import Corpus
from pipelines.drawing.frames import contact_sheet
from pipelines.errors import UserError
from pipelines.inspect.page import statistics_page
from pipelines.inspect.statistics import statistics_of
from pipelines.progress import Progress

log = logging.getLogger(__name__)

FRAMES_PER_SHEET = 12


@dataclass(frozen=True)
class InspectSettings:
    """Draws contact sheets of a corpus and writes a page of its statistics.

    Attributes:
        corpus: Its folder.
        frames: How many frames are drawn, evenly spread.
        out: Folder of the pictures; by default the corpus' name with "-inspect", beside it.
        sensor: Draw the depth as this sensor would see it.
        zoom: Cut every picture to the person's box times this; 0 shows whole images.
        allow_incomplete: Take the finished frames of an unfinished corpus.
    """

    corpus: Annotated[Path, tyro.conf.Positional]
    frames: int = 24
    out: Path | None = None
    sensor: str | None = None
    zoom: float = 1.45
    allow_incomplete: bool = False

    def run(self) -> int:
        """Writes the pictures and tells where."""
        corpus = Corpus.open(self.corpus, self.allow_incomplete)
        resolved = self.corpus.resolve()
        out = self.out or resolved.with_name(resolved.name + "-inspect")
        for path in inspect(corpus, out, self.frames, self.sensor, self.zoom):
            log.info("%s", path)
        return 0


def inspect(
    corpus: Corpus, out: Path, n_frames: int = 24, sensor: str | None = None, zoom: float = 1.45
) -> list[Path]:
    """Writes contact sheets, index.html and statistics.json.

    Args:
        corpus: An open corpus.
        out: Folder; made if it is not there.
        n_frames: Frames to draw, at most those there are.
        sensor: Sensor model for the depth, or None for clean depth.
        zoom: Size of the pictures over the person's box; 0 for whole images.

    Returns:
        What was written, the first contact sheet first.

    Raises:
        UserError: No frames to draw, or no such sensor for this corpus.
    """
    if n_frames < 1:
        raise UserError(f"frames={n_frames} must be at least 1")
    if len(corpus) == 0:
        raise UserError(f"{corpus.path} has no finished frame yet")
    corpus.check_sensor(sensor)
    out.mkdir(parents=True, exist_ok=True)
    places = np.linspace(0, len(corpus) - 1, min(n_frames, len(corpus))).round().astype(int)
    numbers = corpus.indices[places]
    written = []
    with Progress(len(numbers), "frame", "inspect") as bar:
        for k, first in enumerate(range(0, len(numbers), FRAMES_PER_SHEET)):
            shown = numbers[first : first + FRAMES_PER_SHEET]
            path = out / f"sheet_{k:02d}.png"
            cv2.imwrite(str(path), contact_sheet([corpus.frame(int(i), sensor) for i in shown], zoom=zoom))
            bar.update(len(shown))
            written.append(path)
    statistics = statistics_of(corpus)
    page, numbers_file = out / "index.html", out / "statistics.json"
    page.write_text(statistics_page(corpus, statistics, [path.name for path in written]), encoding="utf-8")
    numbers_file.write_text(json.dumps(asdict(statistics), indent=1) + "\n", encoding="utf-8")
    return [*written, page, numbers_file]
