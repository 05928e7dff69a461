"""Recorded people among drawn furniture: placed before their points, rendered, laid over their depth."""

from typing import TYPE_CHECKING

from storage.lazy import exports

if TYPE_CHECKING:
    from synth.scene.composed.compose import Composer
    from synth.scene.composed.config import ComposeConfig, ComposeWeights

__all__ = [
    "ComposeConfig",
    "ComposeWeights",
    "Composer",
]

__getattr__, __dir__ = exports(
    __name__,
    {
        "synth.scene.composed.compose": ("Composer",),
        "synth.scene.composed.config": (
            "ComposeConfig",
            "ComposeWeights",
        ),
    },
)
