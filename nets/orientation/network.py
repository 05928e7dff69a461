"""Orientation nets as torch modules."""

import numpy as np
import torch
from torch import Tensor, nn

from nets.modules import convolutions, from_arrays, hidden_layer, initialise
from nets.orientation.architectures import N_CHANNELS, TRUNKS
from nets.orientation.config import OrientationConfig
from nets.orientation.limits import LEAST_LOG_KAPPA, MOST_LOG_KAPPA, TINY


class OrientationNet(nn.Module):
    """A trunk with three linear outputs: angle, concentration, and posture or tilt and roll."""

    def __init__(self, config: OrientationConfig) -> None:
        """Draws the first weights from torch's generator."""
        super().__init__()
        trunk = TRUNKS[config.region, config.architecture]
        self.is_biternion = config.output.startswith("biternion")
        self.features = convolutions(trunk, N_CHANNELS)
        self.hidden = hidden_layer(trunk, config.view.height, config.view.width)
        self.angle = nn.Linear(trunk.n_hidden, config.n_angle)
        self.concentration = nn.Linear(trunk.n_hidden, 1)
        self.auxiliary = nn.Linear(trunk.n_hidden, config.n_auxiliary)
        initialise(self)
        for output in (self.angle, self.concentration, self.auxiliary):
            nn.init.zeros_(output.weight)
        if self.is_biternion:
            nn.init.normal_(self.angle.weight, std=0.01)

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """What the net puts out.

        Args:
            images: (n, 2, height, width) float32, see `nets.inputs`.

        Returns:
            (n, n_angle), (n,) and (n, n_auxiliary) float32, see `nets.orientation.decode.RawOutputs`.
        """
        hidden = self.hidden(self.features(images))
        angle = self.angle(hidden)
        if self.is_biternion:  # Beyer et al. 2015, equation 4
            angle = angle / torch.sqrt((angle * angle).sum(dim=1, keepdim=True) + TINY)
        # How sure the net is must not change what it is sure of.
        concentration = self.concentration(hidden.detach())[:, 0].clamp(LEAST_LOG_KAPPA, MOST_LOG_KAPPA)
        return angle, concentration, self.auxiliary(hidden)


def net_of(config: OrientationConfig, weights: dict[str, np.ndarray]) -> OrientationNet:
    """A net with the weights of a model, ready to be asked.

    Raises:
        ValueError: Weights that are not those of such a net.
    """
    with torch.random.fork_rng():
        net = OrientationNet(config)
    from_arrays(net, weights)
    return net.eval()
