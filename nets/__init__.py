"""Neural networks beside the forests: which way people face. The only package that imports torch.

The names below are imported when they are first used; those that need torch say so where it is missing.
"""

from typing import TYPE_CHECKING

from storage.lazy import exports

if TYPE_CHECKING:
    from nets.orientation.config import OrientationConfig
    from nets.orientation.estimate import OrientationEstimate
    from nets.orientation.predict import OrientationPredictor

__all__ = ["OrientationConfig", "OrientationEstimate", "OrientationPredictor"]

__getattr__, __dir__ = exports(
    __name__,
    {
        "nets.orientation.config": ("OrientationConfig",),
        "nets.orientation.estimate": ("OrientationEstimate",),
        "nets.orientation.predict": ("OrientationPredictor",),
    },
)
