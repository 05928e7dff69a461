"""The heat map net: an encoder, and a decoder that takes in what the encoder saw at each scale."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from nets.heatmap.config import STATES, STRIDE, HeatmapConfig
from nets.modules import initialise

N_CHANNELS = 2
"""Of the input: relative depth, and whether there is any."""


class Names(NamedTuple):
    """What a net is trained to tell.

    Attributes:
        n_joints: Joints.
        n_parts: Body parts in the cells; 0 = not told.
        n_classes: Classes of objects in the cells; 0 = not told.
    """

    n_joints: int
    n_parts: int = 0
    n_classes: int = 0


def block(n_in: int, n_out: int, stride: int = 1, kernel: int = 3) -> nn.Sequential:
    """A convolution with batch normalisation and ReLU."""
    convolution = nn.Conv2d(n_in, n_out, kernel, stride=stride, padding=kernel // 2, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(n_out), nn.ReLU(inplace=True))


class Residual(nn.Module):
    """Adds what a convolution of 3x3 finds; in narrow blocks, on half of the channels."""

    def __init__(self, n: int, is_narrow: bool) -> None:
        super().__init__()
        half = max(1, n // 2)
        layers = (block(n, half, kernel=1), block(half, half), block(half, n, kernel=1))
        self.path = nn.Sequential(*layers) if is_narrow else nn.Sequential(block(n, n))

    def forward(self, maps: Tensor) -> Tensor:
        """(n, channels, rows, columns) as given."""
        return maps + self.path(maps)


def residuals(n: int, count: int, is_narrow: bool) -> nn.Sequential:
    """Several of them, one after the other."""
    return nn.Sequential(*(Residual(n, is_narrow) for _ in range(count)))


class HeatmapNet(nn.Module):
    """Maps at a quarter of the input's size for each joint: heat, and depth; and four numbers a joint of its state."""

    def __init__(self, config: HeatmapConfig, names: Names) -> None:
        """Draws the first weights from torch's generator."""
        super().__init__()
        a, b, c = config.channels
        self.n_joints = names.n_joints
        self.stem = block(N_CHANNELS * STRIDE**2, a)
        self.down1 = residuals(a, config.blocks[0], False)
        self.down2 = nn.Sequential(block(a, b, 2), *residuals(b, config.blocks[1], True))
        self.down3 = nn.Sequential(block(b, c, 2), *residuals(c, config.blocks[2], True))
        self.narrow2, self.narrow1 = nn.Conv2d(c, b, 1), nn.Conv2d(b, a, 1)
        self.up2, self.up1 = block(b, b), block(a, a)
        self.heat = nn.Conv2d(a, names.n_joints, 1)
        self.depth = nn.Conv2d(a, names.n_joints, 1)
        self.state = nn.Linear(c, len(STATES) * names.n_joints)
        # Told in training alone: cells that know what they show make better maps.
        self.part = nn.Conv2d(a, 1 + names.n_parts, 1) if names.n_parts else None
        self.object = nn.Conv2d(a, 1 + names.n_classes, 1) if names.n_classes else None
        initialise(self)
        for output in (self.heat, self.depth, self.state):
            nn.init.normal_(output.weight, std=0.01)

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """What the net puts out.

        Args:
            images: (n, 2, height, width) float32, see `nets.inputs`.

        Returns:
            (n, n_joints, height / 4, width / 4) heat and depths [m], and (n, 4, n_joints) logits of the states.
        """
        maps, deepest = self.features(images)
        return self.heat(maps), self.depth(maps), self.states(deepest)

    def features(self, images: Tensor) -> tuple[Tensor, Tensor]:
        """(n, channels, height / 4, width / 4) what all outputs are made of, and the deepest scale."""
        one = self.down1(self.stem(functional.pixel_unshuffle(images, STRIDE)))
        two = self.down2(one)
        three = self.down3(two)
        maps = self.up2(two + _twice(self.narrow2(three)))
        return self.up1(one + _twice(self.narrow1(maps))), three

    def states(self, deepest: Tensor) -> Tensor:
        """(n, 4, n_joints) logits of the states."""
        mean: Tensor = self.state(deepest.mean(dim=(2, 3)))
        return mean.reshape(-1, len(STATES), self.n_joints)


def _twice(maps: Tensor) -> Tensor:
    """Maps of twice the size."""
    return functional.interpolate(maps, scale_factor=2.0, mode="nearest")


def names_of(weights: Mapping[str, np.ndarray], n_joints: int) -> Names:
    """What a net with these weights is trained to tell."""

    def count(name: str) -> int:
        bias = weights.get(f"{name}.bias")
        return 0 if bias is None else len(bias) - 1

    return Names(n_joints, count("part"), count("object"))


def net_of(config: HeatmapConfig, names: Names) -> HeatmapNet:
    """A net whose weights are not set yet, ready to be asked; torch's generator is left as it was."""
    with torch.random.fork_rng():
        return HeatmapNet(config, names).eval()
