"""Settings of heat map nets."""

from dataclasses import dataclass
from typing import Literal

from nets.views import View
from storage.ranges import MAX_SEED, check_fields

HeatCost = Literal["cross_entropy", "mse"]
"""cross_entropy: a map is a distribution over its cells. mse: the squared difference to a bell, as in the deliverable
of SPENCER, section 4.5."""
Layer = Literal["composite", "body"]
Naming = Literal["none", "one_class", "each_class"]
"""What a net learns to tell of the objects beside the joints: nothing, where they are, or of which class they are."""

VIEW = View(96, 80, 4, 0.024, 0.8)
STRIDE = 4
"""Pixels of the input to a cell of a map."""
SIGMA = 0.7
"""Of the bells in the targets [cells]."""
CELL_MIDDLE = (STRIDE - 1) / 2.0
"""Where the middle of the first cell lies in the input [px]."""
STATES = ("visible", "hidden", "self_hidden", "outside")
"""What the net tells of a joint: seen; behind an object; behind the person's own body; not in the image."""


@dataclass(frozen=True)
class HeatmapConfig:
    """How a heat map net is trained.

    Attributes:
        channels: Channels at each scale: 1/4, 1/8 and 1/16 of the input's size.
        blocks: Residual blocks at each scale.
        heat_cost: What the maps are trained with.
        layer: composite: learn from what the sensor sees; body: from people without the objects.
        naming: What the net learns to tell of the objects beside the joints.
        n_epochs: How often every frame is seen.
        batch_size: Frames a step.
        learning_rate: The highest learning rate of adamw; it falls along a cosine.
        weight_decay: Of adamw.
        mirrors: Show half of the people in the mirror.
        cut_share: Share of the people who are shown without the objects around them.
        bleed_share: Share of those whose outline is wrong by a few pixels, as that of a segmentation.
        hole_share: Largest share of pixels that are lost.
        depth_jitter_m: Standard deviation of the distance that depth is told relative to [m].
        scale_jitter: Patches are shown up to this share larger or smaller.
        depth_weight: Weight of the cost of depths beside that of the maps, by metre.
        state_weight: Weight of the cost of joints' states.
        parts_weight: Weight of the cost of telling the body part in each cell, behind objects too; 0 = not told.
        naming_weight: Weight of the cost of telling the objects in each cell.
        seed: Seed of all randomness in training.
    """

    channels: tuple[int, ...] = (48, 96, 160)
    blocks: tuple[int, ...] = (2, 2, 3)
    heat_cost: HeatCost = "cross_entropy"
    layer: Layer = "composite"
    naming: Naming = "none"
    n_epochs: int = 10
    batch_size: int = 32
    learning_rate: float = 3e-3
    weight_decay: float = 0.01
    mirrors: bool = True
    cut_share: float = 0.2
    bleed_share: float = 0.5
    hole_share: float = 0.1
    depth_jitter_m: float = 0.03
    scale_jitter: float = 0.1
    depth_weight: float = 5.0
    state_weight: float = 0.3
    parts_weight: float = 1.0
    naming_weight: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        ranges: dict[str, tuple[float, float]] = {
            "channels": (1, 4096),
            "blocks": (0, 100),
            "n_epochs": (1, 10_000),
            "batch_size": (2, 10_000),
            "learning_rate": (1e-8, 10.0),
            "weight_decay": (0.0, 1.0),
            "depth_jitter_m": (0.0, 1.0),
            "scale_jitter": (0.0, 0.5),
            "depth_weight": (0.0, 1000.0),
            "state_weight": (0.0, 1000.0),
            "parts_weight": (0.0, 1000.0),
            "naming_weight": (0.0, 1000.0),
            "seed": (0, MAX_SEED),
        }
        check_fields(self, ranges | dict.fromkeys(("cut_share", "bleed_share", "hole_share"), (0.0, 1.0)))
        for name in ("channels", "blocks"):
            if len(values := getattr(self, name)) != N_SCALES:
                raise ValueError(f"{name}={list(values)} must be three numbers, one a scale")

    @property
    def view(self) -> View:
        """What the net looks at."""
        return VIEW


N_SCALES = 3
