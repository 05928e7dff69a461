"""Corpora on disk, training, scoring, ablation, report and commands: all that knows both `synth` and `forests`."""

from typing import TYPE_CHECKING

from storage.lazy import exports

if TYPE_CHECKING:
    from pipelines.corpus.read import Corpus
    from pipelines.corpus.rooms.clips import Clip, clips_of
    from pipelines.corpus.sequence import CorpusFrames
    from pipelines.corpus.torch_dataset import torch_dataset
    from pipelines.drawing.labels import PixelLabels
    from pipelines.drawing.overlays import overlay
    from pipelines.errors import CorpusError, UserError
    from pipelines.generation.writing import generate_corpus

__all__ = [
    "Clip",
    "Corpus",
    "CorpusError",
    "CorpusFrames",
    "PixelLabels",
    "UserError",
    "clips_of",
    "generate_corpus",
    "overlay",
    "torch_dataset",
]

__getattr__, __dir__ = exports(
    __name__,
    {
        "pipelines.corpus.read": ("Corpus",),
        "pipelines.corpus.rooms.clips": ("Clip", "clips_of"),
        "pipelines.corpus.sequence": ("CorpusFrames",),
        "pipelines.corpus.torch_dataset": ("torch_dataset",),
        "pipelines.drawing.labels": ("PixelLabels",),
        "pipelines.drawing.overlays": ("overlay",),
        "pipelines.errors": ("CorpusError", "UserError"),
        "pipelines.generation.writing": ("generate_corpus",),
    },
)
