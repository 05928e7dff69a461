"""Settings of a random walk forest."""

from dataclasses import dataclass, field

from forests.growing import GrowthConfig
from forests.samples import Layer
from forests.skeleton.kinematics import SKELETON
from storage.ranges import MAX_SEED, check_fields

UPPER_BODY = ("head", "neck", "torso", "r_shoulder", "l_shoulder", "r_elbow", "l_elbow", "r_hand", "l_hand")
"""Names for `RWFConfig.joints`: what a desk or a crowd leaves to be seen."""

MOST_WALKS = 4096
"""Walkers of a joint, and steps of a walk, at most."""


@dataclass(frozen=True)
class RWFConfig:
    """How a random walk forest is trained, and how it walks where no validation frames say better.

    Attributes:
        layer: Which image is learned from: what the sensor sees, or the person without the objects.
        joints: Names of the joints that get an expert, any order; empty = all of the training frames. Those
            that no training frame knows get none.
        skeleton: (joint, parent), parents first; limbs lie between the two.
        box_joints: Joints that the upper-body box of a training frame holds.
        n_trees: Trees of an expert; walkers ask them in turn.
        seed: Of points, features and walks.
        n_points: Training points of a joint in a frame.
        near_share: Share of the points that lie in a ball around the joint; the rest lie on the way to it.
        reach_m: Radius of the ball [m].
        start_noise_m: Standard deviation, along each axis, of the places about a parent joint that ways start
            from [m].
        box_noise_m: The same about the middle of an upper-body box, in training and on validation frames [m].
        cut_share: Share of the training frames that are learned from once more as of a camera that stands so near
            that the image ends on the person: trees then know of joints outside the image.
        gate_share: Share of the training joints that lie farther behind the image's surface than points may.
        snap_m: Points less far behind the surface are put on it, for the trees of an expert in turn [m]. Trees of
            points on the surface see most people better, those of points behind it what is hidden.
        softness_m: Trees are grown by directions for points farther from the joint than this, by offsets for nearer
            ones [m].
        n_clusters: Clusters of offsets kept in a leaf.
        cluster_bandwidth_m: Of the offsets' mean shift, b of its kernel exp(-d^2 / b^2) [m].
        n_walks: Walkers of a joint, side by side.
        n_box_walks: The same of the joints that `box_joints` names, which fewer walkers find as well.
        n_steps: Steps of a walk.
        n_arriving: First steps whose votes do not count in the end.
        scatter_m: Standard deviation of the walkers about the estimate, along each axis [m]. Validation frames may
            choose another, as for the next two.
        bandwidth_m: Of the votes' mean shift, likewise [m].
        n_proposals: Places that are answered for a joint, the most.
        limb_share: Share of the training limbs that are shorter, and that are longer, than the limits.
        learn_skeleton: Also learn how to make one skeleton out of the joints' proposals (docs/skeletons.md).
        growth: How a tree is grown.
    """

    layer: Layer = "composite"
    joints: tuple[str, ...] = ()
    skeleton: tuple[tuple[str, str], ...] = SKELETON
    box_joints: tuple[str, ...] = UPPER_BODY[:5]
    n_trees: int = 4
    seed: int = 0
    n_points: int = 150
    near_share: float = 0.5
    reach_m: float = 0.3
    start_noise_m: float = 0.1
    box_noise_m: float = 0.15
    cut_share: float = 0.25
    gate_share: float = 0.02
    snap_m: tuple[float, ...] = (10.0, 0.3)
    softness_m: float = 0.5
    n_clusters: int = 4
    cluster_bandwidth_m: float = 0.14
    n_walks: int = 32
    n_box_walks: int = 16
    n_steps: int = 3
    n_arriving: int = 1
    scatter_m: float = 0.05
    bandwidth_m: float = 0.1
    n_proposals: int = 6
    limb_share: float = 0.01
    learn_skeleton: bool = True
    growth: GrowthConfig = field(
        default_factory=lambda: GrowthConfig(
            max_depth=18,
            n_candidates=300,
            max_samples_per_split=1000,
            n_finalists=40,
            min_samples_leaf=10,
            max_offset_m=0.5,
        )
    )

    def __post_init__(self) -> None:
        check_fields(self, _RANGES)
        for name in ("reach_m", "cluster_bandwidth_m", "scatter_m", "bandwidth_m"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} must be above 0")
        if not self.snap_m:
            raise ValueError("snap_m must hold one length or more")
        for name in ("gate_share", "limb_share"):
            if not getattr(self, name) < 0.5:
                raise ValueError(f"{name}={getattr(self, name)} must be in [0, 0.5)")
        if not 0 <= self.n_arriving < self.n_steps:
            raise ValueError(f"n_arriving={self.n_arriving} must be in [0, n_steps={self.n_steps})")


_RANGES = {
    "n_trees": (1, 1000),
    "seed": (0, MAX_SEED),
    "n_points": (1, 2**24),
    "near_share": (0.0, 1.0),
    "reach_m": (0.0, 10.0),
    "start_noise_m": (0.0, 10.0),
    "box_noise_m": (0.0, 10.0),
    "cut_share": (0.0, 1.0),
    "gate_share": (0.0, 0.5),
    "snap_m": (0.0, 100.0),
    "softness_m": (0.0, 10.0),
    "n_clusters": (1, 1000),
    "cluster_bandwidth_m": (0.0, 10.0),
    "n_walks": (1, MOST_WALKS),
    "n_box_walks": (1, MOST_WALKS),
    "n_steps": (1, MOST_WALKS),
    "scatter_m": (0.0, 10.0),
    "bandwidth_m": (0.0, 10.0),
    "n_proposals": (1, 1000),
    "limb_share": (0.0, 0.5),
}
