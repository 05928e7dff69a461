"""Convolutional trunks as tables of stages, which the torch module and the exported graph are both built from."""

import math
from typing import NamedTuple

KERNEL = 3


class Stage(NamedTuple):
    """Convolutions of 3x3, each with batch normalisation and ReLU, and what is pooled after them.

    Attributes:
        channels: Of each convolution.
        pool: (rows, columns) of the largest value that is kept; None = nothing is pooled.
        padding: Rows and columns of zeros around the input of each convolution.
    """

    channels: tuple[int, ...]
    pool: tuple[int, int] | None
    padding: int


class Trunk(NamedTuple):
    """Stages, and one hidden layer on top of them.

    Attributes:
        stages: From the image on.
        n_hidden: Units of the hidden layer.
        dropouts: Shares that are dropped before and after the hidden layer in training.
    """

    stages: tuple[Stage, ...]
    n_hidden: int
    dropouts: tuple[float, float]


def flat_size(trunk: Trunk, height: int, width: int) -> int:
    """Numbers that the last stage puts out for an input of a size."""
    n_channels = 0
    for stage in trunk.stages:
        for n_channels in stage.channels:  # noqa: B007 - the last one counts
            height, width = (side + 2 * stage.padding - KERNEL + 1 for side in (height, width))
        if stage.pool is not None:
            height, width = math.ceil(height / stage.pool[0]), math.ceil(width / stage.pool[1])
    return n_channels * height * width
