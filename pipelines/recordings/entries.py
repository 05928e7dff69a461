"""Frames of recordings before they are read: which file, which row, which person; and the person's pixels."""

import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipelines.errors import UserError
from pipelines.foreign import ForeignFileError
from pipelines.recordings.foreground import cut_out, drop_blobs
from pipelines.recordings.itop import ItopIndex, read_depth_row, read_index
from pipelines.recordings.layout import Box, Layout
from pipelines.recordings.plausible import described, judge_person
from pipelines.recordings.readers import DepthImage, read_image, stored_unit

SMALLEST_BLOB = 0.02
"""Regions of fewer of the person's pixels than this share are dropped, where nothing else is asked for."""


@dataclass(frozen=True)
class Entry:
    """Where one frame comes from.

    Attributes:
        path: File of its depth.
        tick: Its place in time: that of the file among the files, or of the row in the file.
        box: What of the image is the person.
        subject: Who, if it is known.
        key: Name of the image, and of the person in it.
        itop: What the file holds, where one holds many frames; None also if such a file cannot be read.
    """

    path: Path
    tick: int
    box: Box
    subject: str
    key: str
    itop: ItopIndex | None = None

    @property
    def source(self) -> str:
        """Where it comes from, for messages."""
        if self.itop is not None:
            return f"{readable(str(self.path))}, row {self.tick}"
        return readable(str(self.path)) + (f", person {self.subject}" if self.subject else "")


def list_files(folder: Path, pattern: str) -> list[Path]:
    """A folder's files of a pattern, in order of the numbers in their names; pictures of ours are none.

    Raises:
        UserError: There are none.
    """
    paths = in_order(path for path in folder.glob(pattern) if not is_picture(path))
    if not paths:
        raise UserError(f"{folder} has no files {pattern}")
    return paths


def in_order(paths: Iterable[Path]) -> list[Path]:
    """Paths in order of the numbers in their names."""
    return sorted(paths, key=lambda path: (_numbers(path.name), path.name))


def is_picture(path: Path) -> bool:
    """Whether a file is called as the pictures of `undergrowth predict` are."""
    return path.name == "sheet.png" or path.name.endswith(".overlay.png")


def list_entries(paths: Sequence[Path], layout: Layout) -> list[Entry]:
    """The frames of some files: one a person of every image, or one a valid row of every ITOP file.

    An ITOP file that cannot be read gives one frame, which cannot be read either.
    """
    people = layout.foreground.people
    if layout.format == "itop":
        return [entry for path in paths for entry in _rows(path, layout, people[0])]
    names = [str(k) if len(people) > 1 else "" for k in range(len(people))]
    return [
        Entry(path, tick, box, name, "/".join(filter(None, (readable(path.stem), name))))
        for tick, path in enumerate(paths)
        for box, name in zip(people, names, strict=True)
    ]


def read_person(entry: Entry, layout: Layout, smallest_share: float = SMALLEST_BLOB) -> DepthImage:
    """(height, width) uint16 depth [mm] of an entry's person, 0 elsewhere.

    Raises:
        UserError: The file is missing, damaged, other than the layout says, or shows no person.
    """
    if layout.format == "itop":
        index = _index(entry.path, layout) if entry.itop is None else entry.itop
        depth = read_depth_row(index, entry.tick, layout)
    else:
        depth = read_image(entry.path, layout)
    image = drop_blobs(cut_out(depth, entry.box), smallest_share)
    if not image.any():
        raise ForeignFileError(
            f"{entry.source} shows no person within the layout's foreground; {described(depth)}"
        )
    return image


def judge_entry(entry: Entry, layout: Layout, image: DepthImage) -> str:
    """Refuses what was kept of an entry's image if it is no person; tells in a sentence what is unlikely, else "".

    Raises:
        ImplausibleError: It is no person.
    """
    return judge_person(entry.source, image, layout.camera, lambda: stored_unit(entry.path, layout))


def partner(path: Path, layout: Layout) -> Path | None:
    """The file of joints beside a file of depth; None if the layout has none, or the name is of another kind."""
    before, _, after = layout.files.partition("*")
    if layout.annotation is None or not (path.name.startswith(before) and path.name.endswith(after)):
        return None
    middle = path.name[len(before) : len(path.name) - len(after)]
    return path.with_name(layout.annotation.files.replace("{}", middle))


def readable(name: str) -> str:
    """A name of a file as text that can be stored: bytes that stand for no character appear as their codes."""
    return os.fsencode(name).decode("utf-8", "backslashreplace")


def _rows(path: Path, layout: Layout, box: Box) -> list[Entry]:
    stem = readable(path.stem)
    try:
        index = _index(path, layout)
    except ForeignFileError:
        return [Entry(path, 0, box, "", stem)]
    return [
        Entry(path, row, box, subject, f"{stem}/{row}", index)
        for row, subject in zip(index.rows, index.subjects, strict=True)
    ]


def _index(path: Path, layout: Layout) -> ItopIndex:
    labels = partner(path, layout)
    return read_index(path, labels if labels is not None and labels.exists() else None, layout)


def _numbers(name: str) -> list[int]:
    return [int(digits) for digits in re.findall(r"\d+", name)]
