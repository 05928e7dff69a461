"""Trunks as torch modules, and modules as plain arrays."""

from collections.abc import Mapping

import numpy as np
import torch
from torch import nn

from nets.stages import KERNEL, Trunk, flat_size


def convolutions(trunk: Trunk, n_channels: int) -> nn.Sequential:
    """The stages of a trunk.

    Args:
        trunk: The table.
        n_channels: Of the input.
    """
    layers: list[nn.Module] = []
    for stage in trunk.stages:
        for n_out in stage.channels:
            # Batch normalisation has a bias of its own.
            layers += [nn.Conv2d(n_channels, n_out, KERNEL, padding=stage.padding, bias=False)]
            layers += [nn.BatchNorm2d(n_out), nn.ReLU()]
            n_channels = n_out
        if stage.pool is not None:
            layers.append(nn.MaxPool2d(stage.pool, ceil_mode=True))
    return nn.Sequential(*layers)


def hidden_layer(trunk: Trunk, height: int, width: int) -> nn.Sequential:
    """What follows the stages, for inputs of that size."""
    before, after = trunk.dropouts
    return nn.Sequential(
        nn.Flatten(),
        nn.Dropout(before),
        nn.Linear(flat_size(trunk, height, width), trunk.n_hidden),
        nn.ReLU(),
        nn.Dropout(after),
    )


def initialise(module: nn.Module) -> None:
    """Xavier weights and zero biases, as in the paper's supplement; draws from torch's generator."""
    for part in module.modules():
        if isinstance(part, nn.Conv2d | nn.Linear):
            nn.init.xavier_uniform_(part.weight)
            if part.bias is not None:
                nn.init.zeros_(part.bias)


def to_arrays(module: nn.Module) -> dict[str, np.ndarray]:
    """Copies of a module's parameters and buffers, by name."""
    return {name: value.detach().cpu().numpy().copy() for name, value in module.state_dict().items()}


def from_arrays(module: nn.Module, arrays: Mapping[str, np.ndarray]) -> None:
    """Sets a module's parameters and buffers.

    Raises:
        ValueError: Names, shapes or types that are not the module's.
    """
    state = module.state_dict()
    if sorted(arrays) != sorted(state):
        odd = sorted(set(arrays) ^ set(state))
        raise ValueError(f"weights do not fit the net: {', '.join(odd[:3])}")
    for name, value in arrays.items():
        there = state[name].cpu().numpy()
        if there.shape != value.shape or there.dtype != value.dtype:
            raise ValueError(
                f"weights {name} are {value.dtype} {value.shape}, must be {there.dtype} {there.shape}"
            )
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            raise ValueError(f"weights {name} are not finite")
    module.load_state_dict({name: torch.from_numpy(np.array(value)) for name, value in arrays.items()})
