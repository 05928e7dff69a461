"""undergrowth export and export-model: a corpus, or a trained model, in the formats that others read."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from forests.modelfile import ModelFileError
from pipelines.corpus import Corpus
from pipelines.errors import UserError
from pipelines.export.write import export
from pipelines.orientation.opening import model_kind
from pipelines.targets import check_place
from storage.atomic import write_atomically
from synth.vocabulary import SPLITS

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ExportSettings:
    """Writes a corpus in another format.

    Attributes:
        corpus: Folder of the corpus.
        to: Format: exr, coco (with PNG maps), webdataset, itop (HDF5) or, of clips, mot
            (MOTChallenge).
        out: New or empty folder.
        split: Split to write. By default all splits are written.
        sensor: Add the noise of this sensor model to the composite depth. By default the depth stays clean.
        allow_incomplete: Use the finished frames of an unfinished corpus.
    """

    corpus: Annotated[Path, tyro.conf.Positional]
    to: Literal["exr", "coco", "webdataset", "itop", "mot"]
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


def _orientation(path: Path) -> bytes:
    from nets.orientation.export import to_onnx
    from nets.orientation.storage import load_model

    return to_onnx(load_model(path))


def _heatmap(path: Path) -> bytes:
    from nets.heatmap.export import to_onnx
    from nets.heatmap.storage import load_model

    return to_onnx(load_model(path))


def _forest(path: Path) -> bytes:
    from forests.oarf.storage import load_model
    from pipelines.export.forest.write import to_onnx

    return to_onnx(load_model(path))


EXPORTERS: Mapping[str, Callable[[Path], bytes]] = {
    "orientation": _orientation,
    "heatmap": _heatmap,
    "oarf": _forest,
}
"""What writes a model of a kind as an ONNX graph."""


@dataclass(frozen=True)
class ExportModelSettings:
    """Writes a net or a regression forest as one file that runs without this program; needs undergrowth[nets].

    Attributes:
        model: File of the model.
        out: File to write. By default it lies beside the model and has its name.
        to: Format of the file.
        overwrite: Replace an existing file.
    """

    model: Annotated[Path, tyro.conf.Positional]
    out: Path | None = None
    to: Literal["onnx"] = "onnx"
    overwrite: bool = False

    def run(self) -> int:
        """Writes the file.

        Raises:
            UserError: The model cannot be used or exported, a library is missing, or the file exists.
        """
        from nets.runtime import MissingLibraryError
        from pipelines.export.errors import UnexportableError

        out = self.model.with_suffix(f".{self.to}") if self.out is None else self.out
        check_place(out)
        if out.exists() and not self.overwrite:
            raise UserError(f"{out} exists already; add --overwrite to replace it")
        kind = model_kind(self.model)
        if kind not in EXPORTERS:
            known = ", ".join(EXPORTERS)
            raise UserError(f"{self.model} holds a model of kind {kind!r}; models that can be exported: {known}")
        try:
            content = EXPORTERS[kind](self.model)
        except (MissingLibraryError, ModelFileError) as error:
            raise UserError(str(error)) from None
        except UnexportableError as error:
            raise UserError(f"{self.model} cannot be exported: {error}") from None
        write_atomically(out, content)
        log.info("%s: %.1f MB", out, len(content) / 1e6)
        return 0
