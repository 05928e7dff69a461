"""The heat map net: an encoder, and a decoder that takes in what the encoder saw at each scale."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from nets.heatmap.config import HeatmapConfig
from nets.modules import initialise
from nets.stages import KERNEL

N_CHANNELS = 2
"""Of the input: relative depth, and whether there is any."""


def block(n_in: int, n_out: int, stride: int = 1) -> nn.Sequential:
    """A convolution of 3x3 with batch normalisation and ReLU."""
    convolution = nn.Conv2d(n_in, n_out, KERNEL, stride=stride, padding=1, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(n_out), nn.ReLU())


class HeatmapNet(nn.Module):
    """Maps at half the input's size for each joint: heat, and depth; and two numbers a joint of its state."""

    def __init__(self, config: HeatmapConfig, n_joints: int) -> None:
        """Draws the first weights from torch's generator."""
        super().__init__()
        a, b, c, d = config.channels
        self.n_joints = n_joints
        self.down1 = nn.Sequential(block(N_CHANNELS, a, 2), block(a, a))
        self.down2 = nn.Sequential(block(a, b, 2), block(b, b))
        self.down3 = nn.Sequential(block(b, c, 2), block(c, c))
        self.down4 = nn.Sequential(block(c, d, 2), block(d, d), block(d, d))
        self.narrow3, self.narrow2, self.narrow1 = (nn.Conv2d(n, m, 1) for n, m in ((d, c), (c, b), (b, a)))
        self.up3, self.up2, self.up1 = block(c, c), block(b, b), block(a, a)
        self.heat = nn.Conv2d(a, n_joints, 1)
        self.depth = nn.Conv2d(a, n_joints, 1)
        self.state = nn.Linear(d, 2 * n_joints)
        initialise(self)
        for output in (self.heat, self.depth, self.state):
            nn.init.normal_(output.weight, std=0.01)

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """What the net puts out.

        Args:
            images: (n, 2, height, width) float32, see `nets.inputs`.

        Returns:
            (n, n_joints, height / 2, width / 2) heat and depths [m], and (n, 2, n_joints) logits that a joint is
            hidden by an object, and outside the image.
        """
        one = self.down1(images)
        two = self.down2(one)
        three = self.down3(two)
        four = self.down4(three)
        maps = self.up3(three + _twice(self.narrow3(four)))
        maps = self.up2(two + _twice(self.narrow2(maps)))
        maps = self.up1(one + _twice(self.narrow1(maps)))
        state = self.state(four.mean(dim=(2, 3))).reshape(-1, 2, self.n_joints)
        return self.heat(maps), self.depth(maps), state


def _twice(maps: Tensor) -> Tensor:
    """Maps of twice the size."""
    return functional.interpolate(maps, scale_factor=2.0, mode="nearest")


def net_of(config: HeatmapConfig, n_joints: int) -> HeatmapNet:
    """A net whose weights are not set yet, ready to be asked; torch's generator is left as it was."""
    with torch.random.fork_rng():
        return HeatmapNet(config, n_joints).eval()
