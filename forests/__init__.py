"""Learns joints from depth arrays; knows nothing of synth.

The names below are imported when they are first used, so that importing this package costs next to nothing.
"""

from typing import TYPE_CHECKING

from storage.lazy import exports

if TYPE_CHECKING:
    from forests.estimate import JointEstimate, JointPredictor, PixelLabeller
    from forests.finder.cutting import cut_person
    from forests.finder.find import Found, FoundPerson, PeopleFinder
    from forests.finder.floor import Floor, FloorPrior, NoFloorError, find_floor
    from forests.frames import FrameBatch, Intrinsics, LabelTable
    from forests.growing import GrowthConfig
    from forests.kinds import load_model
    from forests.oarf.config import OARFConfig
    from forests.oarf.forest import OcclusionAwareForest
    from forests.rwf.config import RWFConfig
    from forests.rwf.forest import RandomWalkForest

__all__ = [
    "Floor",
    "FloorPrior",
    "Found",
    "FoundPerson",
    "FrameBatch",
    "GrowthConfig",
    "Intrinsics",
    "JointEstimate",
    "JointPredictor",
    "LabelTable",
    "NoFloorError",
    "OARFConfig",
    "OcclusionAwareForest",
    "PeopleFinder",
    "PixelLabeller",
    "RWFConfig",
    "RandomWalkForest",
    "cut_person",
    "find_floor",
    "load_model",
]

__getattr__, __dir__ = exports(
    __name__,
    {
        "forests.estimate": ("JointEstimate", "JointPredictor", "PixelLabeller"),
        "forests.finder.cutting": ("cut_person",),
        "forests.finder.find": ("Found", "FoundPerson", "PeopleFinder"),
        "forests.finder.floor": ("Floor", "FloorPrior", "NoFloorError", "find_floor"),
        "forests.frames": ("FrameBatch", "Intrinsics", "LabelTable"),
        "forests.growing": ("GrowthConfig",),
        "forests.kinds": ("load_model",),
        "forests.oarf.config": ("OARFConfig",),
        "forests.oarf.forest": ("OcclusionAwareForest",),
        "forests.rwf.config": ("RWFConfig",),
        "forests.rwf.forest": ("RandomWalkForest",),
    },
)
