"""Writes splits of a corpus in the formats that others read."""

import errno
import shutil
from collections.abc import Callable
from pathlib import Path

from pipelines.corpus import Corpus
from pipelines.errors import UserError
from pipelines.export.coco import export_coco
from pipelines.export.exr import export_exr
from pipelines.export.itop import export_itop
from pipelines.export.records import ExportJob
from pipelines.export.tar_shards import export_webdataset
from pipelines.progress import Progress
from synth.vocabulary import SPLITS

EXPORTERS: dict[str, Callable[[ExportJob], None]] = {
    "exr": export_exr,
    "coco": export_coco,
    "webdataset": export_webdataset,
    "itop": export_itop,
}
"""Exporters by the format's name; each writes one split into a folder shared by all."""


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
        UserError: The format is unknown, the sensor is unknown or a second one, the folder is not empty, a package
            is missing, or the disk is full.
    """
    if to not in EXPORTERS:
        raise UserError(f"format {to!r} is unknown; known are {', '.join(EXPORTERS)}")
    corpus.check_sensor(sensor)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise UserError(f"{out} is not empty; choose a new or empty folder")
    parts = {split: corpus.split(split) for split in splits}
    beside = out.with_name(out.name + ".part")
    shutil.rmtree(beside, ignore_errors=True)
    try:
        beside.mkdir(parents=True)
        with Progress(sum(map(len, parts.values())), "frame", "export") as bar:
            for split, indices in parts.items():
                if len(indices):
                    EXPORTERS[to](ExportJob(corpus, split, indices, beside, sensor, bar.update))
        beside.replace(out)
    except BaseException as error:
        shutil.rmtree(beside, ignore_errors=True)
        if isinstance(error, OSError):
            what = "the disk is full" if error.errno == errno.ENOSPC else error.strerror or str(error)
            raise UserError(f"cannot write {out}: {what}") from error
        raise
    return sum(map(len, parts.values()))
