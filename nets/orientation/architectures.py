"""The trunks of orientation nets."""

from nets.orientation.config import Architecture, Region
from nets.stages import Stage, Trunk

N_CHANNELS = 2
"""Of the input: relative depth, and whether there is any."""

_DROPOUTS = (0.2, 0.5)
TRUNKS: dict[tuple[Region, Architecture], Trunk] = {
    # Beyer et al. 2015, supplement, table 1: "General" on 46x46, and "HOC" on 123x54 pixels.
    ("head", "paper"): Trunk(
        (Stage((24, 24), (2, 2), 0), Stage((48, 48), (2, 2), 0), Stage((64, 64), None, 0)), 512, _DROPOUTS
    ),
    ("body", "paper"): Trunk(
        (Stage((24, 24, 24), (3, 2), 0), Stage((48, 48, 48), (3, 3), 0), Stage((64, 64), None, 0)), 512, _DROPOUTS
    ),
    ("head", "small"): Trunk(
        (Stage((16,), (2, 2), 1), Stage((32, 32), (2, 2), 1), Stage((64, 64), (2, 2), 1)), 128, (0.1, 0.2)
    ),
    ("body", "small"): Trunk(
        (Stage((16,), (2, 2), 1), Stage((32,), (2, 2), 1), Stage((64, 64), (2, 2), 1), Stage((96,), None, 1)),
        128,
        (0.1, 0.2),
    ),
}
"""By region and architecture. As in the paper's own code, pooling rounds up: heads end in 64 maps of 5x5."""
