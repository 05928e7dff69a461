"""undergrowth export-model: a trained net as a graph that other programs run."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from pipelines.errors import UserError
from pipelines.orientation.opening import KIND, model_kind, open_orientation_model
from pipelines.targets import check_place
from storage.atomic import write_atomically

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ExportModelSettings:
    """Writes a net as one file that runs without this program; needs undergrowth[nets].

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

        out = self.model.with_suffix(f".{self.to}") if self.out is None else self.out
        check_place(out)
        if out.exists() and not self.overwrite:
            raise UserError(f"{out} exists already; add --overwrite to replace it")
        kind = model_kind(self.model)
        if kind != KIND:
            raise UserError(f"{self.model} holds a model of kind {kind!r}; models that can be exported: {KIND}")
        try:
            from nets.orientation.export import to_onnx

            content = to_onnx(open_orientation_model(self.model))
        except MissingLibraryError as error:
            raise UserError(str(error)) from None
        write_atomically(out, content)
        log.info("%s: %.1f MB", out, len(content) / 1e6)
        return 0
