"""Scenes: a posed person, the furniture around them and a camera; drawn, placed and rendered into frames."""

from typing import TYPE_CHECKING

from storage.lazy import exports

if TYPE_CHECKING:
    from synth.scene.bases import PoseMix
    from synth.scene.clips.recorded import MotionMix
    from synth.scene.clips.source import ClipSource
    from synth.scene.config import SceneConfig, SceneWeights
    from synth.scene.objects import ObjectMix
    from synth.scene.room.source import RoomSource
    from synth.scene.source import FrameSource

__all__ = [
    "ClipSource",
    "FrameSource",
    "MotionMix",
    "ObjectMix",
    "PoseMix",
    "RoomSource",
    "SceneConfig",
    "SceneWeights",
]

__getattr__, __dir__ = exports(
    __name__,
    {
        "synth.scene.bases": ("PoseMix",),
        "synth.scene.clips.recorded": ("MotionMix",),
        "synth.scene.clips.source": ("ClipSource",),
        "synth.scene.config": (
            "SceneConfig",
            "SceneWeights",
        ),
        "synth.scene.objects": ("ObjectMix",),
        "synth.scene.room.source": ("RoomSource",),
        "synth.scene.source": ("FrameSource",),
    },
)
