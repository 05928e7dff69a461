"""undergrowth export: a corpus in the formats that others read."""

import errno
import logging
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from tqdm import tqdm

from pipelines.corpus import Corpus
from pipelines.errors import UserError
from pipelines.export.coco import export_coco
from pipelines.export.exr import export_exr
from pipelines.export.itop import export_itop
from pipelines.export.records import ExportJob
from pipelines.export.tar_shards import export_webdataset
from synth.vocabulary import SPLITS

log = logging.getLogger(__name__)

EXPORTERS: dict[str, Callable[[ExportJob], None]] = {
    "exr": export_exr,
    "coco": export_coco,
    "webdataset": export_webdataset,
    "itop": export_itop,
}
"""Exporters by the format's name; each writes one split into a folder shared by all."""


@dataclass(frozen=True)
class ExportSettings:
    """Writes a corpus in another format.

    Attributes:
        corpus: Its folder.
        to: exr, coco (with PNG maps), webdataset or itop (HDF5).
        out: New or empty folder.
        split: The split to write; all if left out.
        sensor: Apply this sensor model to the composite depth; the clean depth if left out.
        allow_incomplete: Take the finished frames of an unfinished corpus.
    """

    corpus: Annotated[Path, tyro.conf.Positional]
    to: Literal["exr", "coco", "webdataset", "itop"]
    out: Path
    split: Literal["train", "val", "test"] | None = None
    sensor: str | None = None
    allow_incomplete: bool = False

    def run(self) -> int:
        """Exports and tells how much."""
        corpus = Corpus.open(self.corpus, self.allow_incomplete)
        splits = SPLITS if self.split is None else (self.split,)
        n_frames = export(corpus, self.to, self.out, splits, self.sensor)
        log.info("%d frames in %s", n_frames, self.out)
        return 0


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
        raise UserError(f"{out} holds files already; choose a new or an empty folder")
    parts = {split: corpus.split(split) for split in splits}
    beside = out.with_name(out.name + ".part")
    shutil.rmtree(beside, ignore_errors=True)
    try:
        beside.mkdir(parents=True)
        with tqdm(total=sum(map(len, parts.values())), unit="frame", delay=2.0) as bar:
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
