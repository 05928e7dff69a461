"""Writes splits of a corpus in the formats that others read."""

import contextlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus import Corpus
from pipelines.corpus.folder import locked_folder
from pipelines.errors import UserError, in_words
from pipelines.export.coco import export_coco
from pipelines.export.exr import export_exr
from pipelines.export.itop import export_itop
from pipelines.export.records import ExportJob
from pipelines.export.rooms.coco import export_room_coco
from pipelines.export.rooms.exr import export_room_exr
from pipelines.export.rooms.itop import export_room_itop
from pipelines.export.rooms.mot import export_mot
from pipelines.export.rooms.tar_shards import export_room_webdataset
from pipelines.export.tar_shards import export_webdataset
from pipelines.progress import Progress
from storage.atomic import TEMPORARY_SUFFIX
from synth.vocabulary import SPLITS

EXPORTERS: dict[str, Callable[[ExportJob], None]] = {
    "exr": export_exr,
    "coco": export_coco,
    "webdataset": export_webdataset,
    "itop": export_itop,
}
"""Exporters by the format's name; each writes one split into a folder shared by all."""
ROOM_EXPORTERS: dict[str, Callable[[ExportJob], None]] = {
    "exr": export_room_exr,
    "coco": export_room_coco,
    "webdataset": export_room_webdataset,
    "itop": export_room_itop,
    "mot": export_mot,
}
"""The same for whole scenes."""


def export(corpus: Corpus, to: str, out: Path, splits: tuple[str, ...] = SPLITS, sensor: str | None = None) -> int:
    """Writes splits of a corpus beside and renames the folder when it is whole.

    Args:
        corpus: An open corpus.
        to: A key of `EXPORTERS`.
        out: New or empty folder.
        splits: Which splits; those without frames are left out.
        sensor: Sensor model for the composite depth, or None.

    Returns:
        Frames written.

    Raises:
        UserError: The format is unknown, the sensor is unknown or a second one, the folder is not empty or in
            use, a package is missing, or the disk is full.
    """
    if to not in ROOM_EXPORTERS:
        raise UserError(f"format {to!r} is unknown; known are {', '.join(ROOM_EXPORTERS)}")
    corpus.check_sensor(sensor)
    exporters = ROOM_EXPORTERS if corpus.header.has_rooms else EXPORTERS
    if to not in exporters:
        raise UserError(f"{corpus.path} holds single people; {to} needs clips of whole scenes")
    write_split = exporters[to]
    parts = {split: corpus.split(split) for split in splits}
    try:
        with _unfinished_folder(out) as beside, Progress(sum(map(len, parts.values())), "frame", "export") as bar:
            for split, indices in parts.items():
                for prefix, chosen in _by_camera(corpus, to, indices):
                    write_split(ExportJob(corpus, split, chosen, beside, sensor, bar.update, prefix))
            beside.replace(out)
    except OSError as error:
        raise UserError(in_words(error, out)) from error
    return sum(map(len, parts.values()))


def _by_camera(corpus: Corpus, to: str, indices: NDArray[np.int64]) -> Iterator[tuple[str, NDArray[np.int64]]]:
    """Prefix of the files' names and frames of what is written apart: ITOP has files of their own for each camera."""
    n = corpus.header.cameras if to == "itop" else 1
    is_itops = corpus.header.config.get("scene", {}).get("rig") == "front_top"
    names = ("side_", "top_") if is_itops else tuple(f"view{k}_" for k in range(n))
    for k in range(n):
        chosen = indices[k::n]
        if len(chosen):
            yield (names[k] if n > 1 else ""), chosen


@contextlib.contextmanager
def _unfinished_folder(out: Path) -> Iterator[Path]:
    """An empty folder beside, held against a second writer; gone in the end, if it was not renamed.

    Raises:
        UserError: The folder itself is not empty, or another process writes it.
    """
    beside = out.with_name(f"{out.name}.undergrowth-export{TEMPORARY_SUFFIX}")
    _refuse_full(out)
    beside.mkdir(parents=True, exist_ok=True)
    with locked_folder(beside):
        _refuse_full(out)  # another writer may just have ended
        for item in beside.iterdir():
            shutil.rmtree(item) if item.is_dir() else item.unlink()
        try:
            yield beside
        except BaseException:
            shutil.rmtree(beside, ignore_errors=True)
            raise


def _refuse_full(out: Path) -> None:
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise UserError(f"{out} is not empty; choose a new or empty folder")
