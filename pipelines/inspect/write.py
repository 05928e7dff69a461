"""Writes an inspection: contact sheets, index.html and statistics.json."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from pipelines.corpus import Corpus
from pipelines.corpus.rooms.clips import clips_of
from pipelines.drawing.captions import bordered
from pipelines.drawing.files import write_picture
from pipelines.drawing.frames import contact_sheet
from pipelines.drawing.palette import Picture
from pipelines.drawing.rooms import room_sheet
from pipelines.errors import UserError
from pipelines.inspect.page import statistics_page
from pipelines.inspect.statistics import statistics_of
from pipelines.inspect.strips import film_strip
from pipelines.progress import Progress
from pipelines.spread import first_to_last
from pipelines.targets import check_folder
from storage.atomic import write_atomically

FRAMES_PER_SHEET = 12
MOMENTS = 6
"""Moments of a film strip, which stands for so many frames of a contact sheet."""
PAGE_NAMES = ("index.html", "statistics.json")
"""Beside the contact sheets."""
SCHEMA = "undergrowth statistics"
SCHEMA_VERSION = 1


def write_inspection(
    corpus: Corpus, out: Path, n_frames: int = 24, sensor: str | None = None, zoom: float = 1.45
) -> list[Path]:
    """Writes contact sheets, index.html and statistics.json.

    Args:
        corpus: An open corpus.
        out: Folder; made if it is not there.
        n_frames: Frames to draw, at most those there are.
        sensor: Sensor model for the depth, or None for clean depth.
        zoom: Size of the pictures over the person's box; 0 for whole images, as whole scenes always are.

    Returns:
        What was written, the first contact sheet first.

    Raises:
        UserError: No frames to draw, no such sensor for this corpus, or files of others are in the folder.
        OSError: A file cannot be written.
    """
    if n_frames < 1:
        raise UserError(f"frames={n_frames} must be at least 1")
    if len(corpus) == 0:
        raise UserError(f"{corpus.path} has no finished frame yet")
    corpus.check_sensor(sensor)
    n_sheets = -(-min(n_frames, len(corpus)) // FRAMES_PER_SHEET)
    check_folder(out, [*PAGE_NAMES, *map(_sheet_name, range(n_sheets))])
    out.mkdir(parents=True, exist_ok=True)
    sheets = _write_sheets(corpus, out, n_frames, sensor, zoom)
    statistics = statistics_of(corpus)
    page, numbers = (out / name for name in PAGE_NAMES)
    write_atomically(page, statistics_page(corpus, statistics, [path.name for path in sheets]))
    document = {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, **asdict(statistics)}
    write_atomically(numbers, json.dumps(document, indent=1) + "\n")
    return [*sheets, page, numbers]


def _sheet_name(k: int) -> str:
    return f"sheet_{k:02d}.png"


def _film_strips(corpus: Corpus, sheet: int, n_frames: int, sensor: str | None) -> Picture:
    """The strips of one sheet; sheets go through the clips as contact sheets go through the frames."""
    clips = list(clips_of(corpus))
    if not clips:
        raise UserError(f"{corpus.path} has no finished clip yet")
    chosen = first_to_last(len(clips), -(-n_frames // MOMENTS))
    per_sheet = FRAMES_PER_SHEET // MOMENTS
    shown = [clips[int(i)] for i in chosen[sheet * per_sheet : (sheet + 1) * per_sheet]] or clips[-1:]
    strips = [film_strip(clip, MOMENTS, sensor) for clip in shown]
    width = max(strip.shape[1] for strip in strips)
    return np.vstack([bordered(strip, right=width - strip.shape[1]) for strip in strips])


def _write_sheets(corpus: Corpus, out: Path, n_frames: int, sensor: str | None, zoom: float) -> list[Path]:
    places = first_to_last(len(corpus), n_frames)
    numbers = corpus.indices[places]
    written = []
    with Progress(len(numbers), "frame", "inspect") as bar:
        for k, first in enumerate(range(0, len(numbers), FRAMES_PER_SHEET)):
            shown = numbers[first : first + FRAMES_PER_SHEET]
            path = out / _sheet_name(k)
            if "clip" in corpus.header.fields:
                picture = _film_strips(corpus, k, len(places), sensor)
            elif corpus.header.has_rooms:
                picture = room_sheet([corpus.scene(int(i), sensor) for i in shown])
            else:
                picture = contact_sheet([corpus.frame(int(i), sensor) for i in shown], zoom=zoom)
            write_picture(path, picture)
            bar.update(len(shown))
            written.append(path)
    return written
