"""Recorded people among drawn furniture: placed before their points, rendered, laid over their depth."""

from synth.scene.recorded.compose import Composer
from synth.scene.recorded.config import ComposeConfig, ComposeWeights

__all__ = ["ComposeConfig", "ComposeWeights", "Composer"]
