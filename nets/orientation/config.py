"""Settings of orientation nets, and the sizes of what they look at."""

from dataclasses import dataclass
from typing import Literal, get_args

from nets.views import View
from storage.ranges import MAX_SEED, check_fields

Region = Literal["body", "head"]
"""What is looked at."""
Architecture = Literal["small", "paper"]
"""paper: the nets of the supplement of Beyer et al. 2015, table 1; small: a faster one."""
Output = Literal[
    "biternion_von_mises",
    "biternion_cosine",
    "von_mises",
    "regression",
    "softmax_interpolated",
    "softmax_centres",
]
"""What the net puts out and what it is trained with: a biternion with the von Mises or the cosine cost, an angle with
the von Mises cost or with the mean absolute deviation, classes whose centre, or the peak of a parabola through three
of them, is the answer."""
Optimizer = Literal["adamw", "adadelta"]

OUTPUTS: tuple[Output, ...] = get_args(Output)
POSTURES: tuple[str, ...] = ("standing", "sitting", "bent", "squatting")
"""What a body may do, by code; -1 = not known."""
FEWEST_BINS = 3
N_TILT_ROLL = 2


VIEWS: dict[tuple[Region, Architecture], View] = {
    ("body", "small"): View(64, 36, 3, 0.034, 0.6),
    ("body", "paper"): View(123, 54, 4, 0.018, 0.6),
    ("head", "small"): View(32, 32, 2, 0.0145, 0.25),
    ("head", "paper"): View(46, 46, 2, 0.01, 0.25),
}
"""By region and architecture; the paper's heads are crops of 46 out of 50 pixels."""


@dataclass(frozen=True)
class OrientationConfig:
    """Settings of an orientation net. The defaults are ours; docs/orientation.md says how the paper's differ.

    Attributes:
        region: body: the heading of the body, and its posture; head: pan, tilt and roll of the head.
        architecture: small, or the paper's.
        output: What the net puts out and what it is trained with.
        n_bins: Train with the centres of this many equal sectors in place of the true angles; 0 trains with the true
            angles, which classes cannot.
        kappa: Concentration in the von Mises cost.
        n_epochs: How often every frame is seen.
        batch_size: Frames a step.
        optimizer: adamw with a learning rate that falls along a cosine, or adadelta as in the paper.
        learning_rate: The highest learning rate of adamw.
        weight_decay: Of adamw.
        mirrors: Show half of the people in the mirror.
        cut_share: Share of the people who are shown without the objects around them.
        bleed_share: Share of those whose outline is wrong by a few pixels, as that of a segmentation.
        hole_share: Largest share of pixels that are lost.
        depth_jitter_m: Standard deviation of the distance that depth is told relative to [m].
        scale_jitter: Patches are shown up to this share larger or smaller.
        auxiliary_weight: Weight of the costs of posture, or of tilt and roll, beside that of the angle.
        seed: Seed of all randomness in training.
    """

    region: Region = "body"
    architecture: Architecture = "small"
    output: Output = "biternion_von_mises"
    n_bins: int = 0
    kappa: float = 1.0
    n_epochs: int = 40
    batch_size: int = 32
    optimizer: Optimizer = "adamw"
    learning_rate: float = 2e-3
    weight_decay: float = 0.01
    mirrors: bool = True
    cut_share: float = 0.5
    bleed_share: float = 0.5
    hole_share: float = 0.1
    depth_jitter_m: float = 0.03
    scale_jitter: float = 0.08
    auxiliary_weight: float = 0.3
    seed: int = 0

    def __post_init__(self) -> None:
        ranges = {
            "n_bins": (0, 360),
            "kappa": (0.01, 100.0),
            "n_epochs": (1, 10_000),
            "batch_size": (2, 10_000),
            "learning_rate": (1e-8, 10.0),
            "weight_decay": (0.0, 1.0),
            "depth_jitter_m": (0.0, 1.0),
            "scale_jitter": (0.0, 0.5),
            "auxiliary_weight": (0.0, 100.0),
            "seed": (0, MAX_SEED),
        }
        check_fields(self, ranges | dict.fromkeys(("cut_share", "bleed_share", "hole_share"), (0.0, 1.0)))
        least = FEWEST_BINS if self.has_classes else 0
        if self.n_bins < FEWEST_BINS and self.n_bins != least:
            allowed = f"at least {FEWEST_BINS}" + ("" if self.has_classes else ", or 0 for the true angles")
            raise ValueError(f"n_bins={self.n_bins} must be {allowed} with output={self.output}")

    @property
    def has_classes(self) -> bool:
        """Whether the net puts out classes."""
        return self.output.startswith("softmax")

    @property
    def view(self) -> View:
        """What the net looks at."""
        return VIEWS[self.region, self.architecture]

    @property
    def n_angle(self) -> int:
        """Numbers that the net puts out for the angle."""
        if self.has_classes:
            return self.n_bins
        return 2 if self.output.startswith("biternion") else 1

    @property
    def n_auxiliary(self) -> int:
        """Numbers that the net puts out beside the angle and its concentration."""
        return len(POSTURES) if self.region == "body" else N_TILT_ROLL
