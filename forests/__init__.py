"""Learns joints from depth arrays; knows nothing of synth.

The names below are imported when they are first used, so that importing this package costs next to nothing.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from forests.estimate import JointEstimate, JointPredictor, PixelLabeller
    from forests.frames import FrameBatch, Intrinsics, LabelTable
    from forests.growing import GrowthConfig
    from forests.kinds import load_model
    from forests.oarf.config import OARFConfig
    from forests.oarf.forest import OcclusionAwareForest
    from forests.rwf.config import RWFConfig
    from forests.rwf.forest import RandomWalkForest

__all__ = [
    "FrameBatch",
    "GrowthConfig",
    "Intrinsics",
    "JointEstimate",
    "JointPredictor",
    "LabelTable",
    "OARFConfig",
    "OcclusionAwareForest",
    "PixelLabeller",
    "RWFConfig",
    "RandomWalkForest",
    "load_model",
]

_HOMES = {
    "FrameBatch": "forests.frames",
    "GrowthConfig": "forests.growing",
    "Intrinsics": "forests.frames",
    "JointEstimate": "forests.estimate",
    "JointPredictor": "forests.estimate",
    "LabelTable": "forests.frames",
    "OARFConfig": "forests.oarf.config",
    "OcclusionAwareForest": "forests.oarf.forest",
    "PixelLabeller": "forests.estimate",
    "RWFConfig": "forests.rwf.config",
    "RandomWalkForest": "forests.rwf.forest",
    "load_model": "forests.kinds",
}
"""Where each name is defined."""


if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        if name not in _HOMES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(importlib.import_module(_HOMES[name]), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
