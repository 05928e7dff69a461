"""Settings of a regression forest."""

from dataclasses import dataclass, field
from typing import Literal, get_args

from forests.growing import GrowthConfig
from storage.ranges import MAX_SEED, check_fields

Mode = Literal["baseline", "occluders", "semantic"]
"""baseline: learned from bodies alone (Girshick et al. 2011). occluders: objects' pixels are one class.
semantic: each class of objects is one (Rafi et al. 2015, section 3.2)."""


@dataclass(frozen=True)
class OARFConfig:
    """How a regression forest is trained and asked.

    Attributes:
        mode: What is known of occluders.
        n_trees: Trees.
        seed: Of pixels and features.
        n_pixels: Pixels drawn from the person in a training frame.
        n_occluder_pixels: Pixels drawn from objects in a training frame (not for the baseline).
        max_samples: Most pixels drawn from all training frames. Of many frames fewer pixels each are drawn, from
            person and objects in the same ratio.
        leaf_bandwidth_m: b of the leaves' mean shift [m].
        n_leaf_votes: Votes kept a joint in a leaf, for body and for occluder samples each.
        n_voting_pixels: Pixels that vote in a frame.
        learn_skeleton: Also learn how to make one skeleton out of the joints' proposals (docs/skeletons.md).
        growth: How a tree is grown.
    """

    mode: Mode = "semantic"
    n_trees: int = 3
    seed: int = 0
    n_pixels: int = 1000
    n_occluder_pixels: int = 1000
    leaf_bandwidth_m: float = 0.05
    n_leaf_votes: int = 2
    n_voting_pixels: int = 500
    max_samples: int = 5_000_000
    learn_skeleton: bool = True
    growth: GrowthConfig = field(default_factory=GrowthConfig)

    def __post_init__(self) -> None:
        if self.mode not in get_args(Mode):
            raise ValueError(f"mode {self.mode!r} is unknown; known are {', '.join(get_args(Mode))}")
        check_fields(self, _RANGES)

    def pixels_a_frame(self, n_frames: int) -> tuple[int, int]:
        """Pixels that are drawn from the person and from the objects in each of so many frames."""
        n_objects = 0 if self.mode == "baseline" else self.n_occluder_pixels
        share = min(1.0, self.max_samples / (n_frames * (self.n_pixels + n_objects)))
        return max(1, int(share * self.n_pixels)), int(share * n_objects)


_RANGES = {
    "n_trees": (1, 1000),
    "seed": (0, MAX_SEED),
    "n_pixels": (1, 2**24),
    "n_occluder_pixels": (0, 2**24),
    "max_samples": (1, 2**31 - 1),
    "leaf_bandwidth_m": (0.001, 1.0),
    "n_leaf_votes": (1, 100),
    "n_voting_pixels": (1, 2**24),
}
