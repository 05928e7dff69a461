"""Corpora on disk, training, scoring, ablation, report and commands: all that knows both `synth` and `forests`."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipelines.corpus.read import Corpus
    from pipelines.corpus.sequence import CorpusFrames
    from pipelines.corpus.torch_dataset import torch_dataset
    from pipelines.drawing.labels import PixelLabels
    from pipelines.drawing.overlays import overlay
    from pipelines.errors import CorpusError, UserError
    from pipelines.generation.writing import generate_corpus

_PLACES = {
    "Corpus": "corpus.read",
    "CorpusError": "errors",
    "CorpusFrames": "corpus.sequence",
    "PixelLabels": "drawing.labels",
    "UserError": "errors",
    "generate_corpus": "generation.writing",
    "overlay": "drawing.overlays",
    "torch_dataset": "corpus.torch_dataset",
}
"""Where each name lives; imported when it is asked for."""

__all__ = [
    "Corpus",
    "CorpusError",
    "CorpusFrames",
    "PixelLabels",
    "UserError",
    "generate_corpus",
    "overlay",
    "torch_dataset",
]


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    return __all__
