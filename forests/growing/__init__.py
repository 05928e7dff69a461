"""Growing a tree from sampled pixels."""

from forests.growing.config import GrowthConfig
from forests.growing.crew import Call, Crew
from forests.growing.grow import DIRECTION_ONE, GrownTree, grow_class_tree, grow_direction_tree

__all__ = ["DIRECTION_ONE", "Call", "Crew", "GrownTree", "GrowthConfig", "grow_class_tree", "grow_direction_tree"]
