"""Settings of a random walk forest."""

from dataclasses import dataclass, field

from forests.growing import GrowthConfig
from forests.samples import Layer
from forests.skeleton.kinematics import SKELETON
from storage.ranges import MAX_SEED, check_fields

UPPER_BODY = ("head", "neck", "torso", "r_shoulder", "l_shoulder", "r_elbow", "l_elbow", "r_hand", "l_hand")
"""Names for `RWFConfig.joints`: what a desk or a crowd leaves to be seen."""


@dataclass(frozen=True)
class RWFConfig:
    """How a random walk forest is trained, and how it walks where no validation frames say better.

    Attributes:
        layer: Which image is learned from: what the sensor sees, or the person without the objects.
        joints: Names of the joints that get an expert, any order; empty = all of the training frames. Those
            that no training frame knows get none.
        skeleton: (joint, parent), parents first; limbs lie between the two.
        box_joints: Joints that the upper-body box of a training frame holds.
        n_trees: Trees of an expert; each step of a walk draws one.
        seed: Of points, features and walks.
        n_points: Training points of a joint in a frame.
        near_share: Share of the points that lie in a ball around the joint; the rest lie on the way to it.
        reach_m: Radius of the ball [m].
        start_noise_m: Standard deviation, along each axis, of the places about a parent joint that ways start
            from [m].
        box_noise_m: The same about the middle of an upper-body box, in training and on validation frames [m].
        gate_share: Share of the training joints that lie before and behind the gate on a point's depth, each.
        n_clusters: Cluster centres kept in a leaf.
        cluster_bandwidth: Of the directions' mean shift, as a chord of the unit sphere.
        n_walks: Walks of a joint, side by side, the most.
        n_steps: Steps of a walk. Validation frames may choose another number of them, with fewer walks where
            they would make more than n_walks * n_steps steps in all.
        step_m: Length of the first step [m].
        decay: Length of a step over that of the step before.
        n_arriving: First steps that the estimate does not count.
        ways_m: Lengths of a walk whose steps do not decay [m], for validation frames to choose from. Short ones
            end where limbs of the usual length end; long ones alone (1.2) suit people whom the training frames do
            not resemble.
        limb_share: Share of the training limbs that are shorter, and that are longer, than the limits.
        learn_skeleton: Also learn how to make one skeleton out of the joints' proposals (docs/skeletons.md).
        growth: How a tree is grown.
    """

    layer: Layer = "composite"
    joints: tuple[str, ...] = ()
    skeleton: tuple[tuple[str, str], ...] = SKELETON
    box_joints: tuple[str, ...] = UPPER_BODY[:5]
    n_trees: int = 1
    seed: int = 0
    n_points: int = 300
    near_share: float = 0.5
    reach_m: float = 0.3
    start_noise_m: float = 0.1
    box_noise_m: float = 0.15
    gate_share: float = 0.02
    n_clusters: int = 4
    cluster_bandwidth: float = 0.5
    n_walks: int = 8
    n_steps: int = 10
    step_m: float = 0.06
    decay: float = 0.95
    n_arriving: int = 5
    ways_m: tuple[float, ...] = (0.2, 0.3, 0.45, 0.65, 0.9, 1.2)
    limb_share: float = 0.01
    learn_skeleton: bool = False
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
        for name in ("reach_m", "cluster_bandwidth", "step_m", "decay"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)} must be above 0")
        if not self.ways_m or not min(self.ways_m) > 0:
            raise ValueError(f"ways_m={self.ways_m} must be one or more lengths above 0 m")
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
    "gate_share": (0.0, 0.5),
    "n_clusters": (1, 1000),
    "cluster_bandwidth": (0.0, 10.0),
    "n_walks": (1, 10_000),
    "n_steps": (1, 10_000),
    "step_m": (0.0, 10.0),
    "decay": (0.0, 1.0),
    "ways_m": (0.0, 100.0),
    "limb_share": (0.0, 0.5),
}
