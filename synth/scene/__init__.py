"""Scenes: a posed person, the furniture around them and a camera; drawn, placed and rendered into frames."""

from synth.scene.bases import PoseMix
from synth.scene.config import SceneConfig, SceneWeights
from synth.scene.objects import ObjectMix
from synth.scene.source import FrameSource

__all__ = ["FrameSource", "ObjectMix", "PoseMix", "SceneConfig", "SceneWeights"]
