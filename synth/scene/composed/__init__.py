"""Recorded people among drawn furniture: placed before their points, rendered, laid over their depth."""

from synth.scene.composed.compose import Composer
from synth.scene.composed.config import ComposeConfig, ComposeWeights

__all__ = ["ComposeConfig", "ComposeWeights", "Composer"]
