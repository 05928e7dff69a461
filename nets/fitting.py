"""Fits a torch module to a cost over many epochs; goes on after the last finished epoch to the same weights."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from nets.modules import from_arrays, to_arrays
from nets.runtime import seed_of

State = dict[str, np.ndarray]
"""Weights, the optimiser's memory and the number of finished epochs, by name."""
_WARM_UP = 0.05
"""Share of the steps in which adamw's learning rate rises."""
_FEWEST_A_STEP = 2
"""Batch normalisation needs more than one sample."""


class Checkpoint(Protocol):
    """Keeps the state after an epoch; pieces are numbered, and an epoch's replaces the last one's as number 0."""

    def load(self, tree: int, /) -> State | None:
        """The state that was kept, or None."""
        ...

    def save(self, tree: int, grown: State, /) -> None:
        """Keeps a state."""
        ...


@dataclass(frozen=True)
class Fit:
    """How a module is fitted.

    Attributes:
        n_epochs: How often every sample is seen.
        batch_size: Samples a step.
        optimizer: adamw, or adadelta with the paper's constants.
        learning_rate: The highest of adamw.
        weight_decay: Of adamw.
        seed: Of the order of the samples and all that the cost draws.
    """

    n_epochs: int
    batch_size: int
    optimizer: Literal["adamw", "adadelta"]
    learning_rate: float
    weight_decay: float
    seed: int


BatchCost = Callable[[NDArray[np.int64], np.random.Generator, torch.Generator], Tensor]
"""The cost of a batch: of the samples' numbers, with what draws for numpy and for torch."""


def fit(
    net: nn.Module,
    n_samples: int,
    cost: BatchCost,
    settings: Fit,
    checkpoint: Checkpoint | None = None,
    on_progress: Callable[[float], object] = lambda share: None,
) -> None:
    """Fits a module in place. Everything drawn in an epoch follows from the seed and the epoch's number alone.

    Args:
        net: The module, with its first weights.
        n_samples: Samples there are, at least 2.
        cost: Of a batch.
        settings: How.
        checkpoint: Where to keep the state after each epoch, and to go on from; None = nowhere.
        on_progress: Told the share of the epochs that is done, 0..1.

    Raises:
        ValueError: Too few samples, or a cost that is not finite.
    """
    if n_samples < _FEWEST_A_STEP:
        raise ValueError(f"a net cannot be fitted to {n_samples} samples; at least {_FEWEST_A_STEP} are needed")
    optimizer = _optimizer(net, settings)
    begun = 0
    state = checkpoint.load(0) if checkpoint is not None else None
    if state is not None:
        begun = _restore(net, optimizer, state)
    n_steps = max(1, n_samples // settings.batch_size)
    net.train()
    for epoch in range(begun, settings.n_epochs):
        _epoch(net, optimizer, n_samples, n_steps, cost, settings, epoch)
        if checkpoint is not None:
            checkpoint.save(0, _state(net, optimizer, epoch + 1))
        on_progress((epoch + 1) / settings.n_epochs)
    net.eval()


def _epoch(
    net: nn.Module,
    optimizer: torch.optim.Optimizer,
    n_samples: int,
    n_steps: int,
    cost: BatchCost,
    settings: Fit,
    epoch: int,
) -> None:
    rng = np.random.default_rng([settings.seed, epoch])
    generator = torch.Generator().manual_seed(seed_of(settings.seed, epoch, 1))
    torch.manual_seed(seed_of(settings.seed, epoch, 2))  # dropout draws from torch's own generator
    for step, batch in enumerate(np.array_split(rng.permutation(n_samples), n_steps)):
        if settings.optimizer == "adamw":
            share = (epoch * n_steps + step) / (settings.n_epochs * n_steps)
            optimizer.param_groups[0]["lr"] = settings.learning_rate * _schedule(share)
        optimizer.zero_grad()
        value = cost(batch, rng, generator)
        if not bool(torch.isfinite(value)):
            raise ValueError(f"the cost is not finite in epoch {epoch + 1}; try a lower learning rate")
        value.backward()
        optimizer.step()


def _schedule(share: float) -> float:
    """Of the highest learning rate: rises linearly, then falls along a cosine to 0."""
    if share < _WARM_UP:
        return max(share, 1e-3) / _WARM_UP
    return 0.5 * (1.0 + math.cos(math.pi * (share - _WARM_UP) / (1.0 - _WARM_UP)))


def _optimizer(net: nn.Module, settings: Fit) -> torch.optim.Optimizer:
    if settings.optimizer == "adadelta":
        return torch.optim.Adadelta(net.parameters(), lr=1.0, rho=0.95, eps=1e-7)
    return torch.optim.AdamW(net.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay)


def _state(net: nn.Module, optimizer: torch.optim.Optimizer, n_epochs: int) -> State:
    state = {f"net.{name}": value for name, value in to_arrays(net).items()}
    for number, memory in optimizer.state_dict()["state"].items():
        for name, value in memory.items():
            state[f"optimizer.{number}.{name}"] = value.detach().cpu().numpy().copy()
    return state | {"n_epochs": np.array(n_epochs, np.int64)}


def _restore(net: nn.Module, optimizer: torch.optim.Optimizer, state: State) -> int:
    """Sets net and optimiser, and gives the number of finished epochs."""
    from_arrays(net, {name[4:]: value for name, value in state.items() if name.startswith("net.")})
    memory: dict[int, dict[str, Any]] = {}
    for key, value in state.items():
        if key.startswith("optimizer."):
            _, number, name = key.split(".")
            memory.setdefault(int(number), {})[name] = torch.from_numpy(np.array(value))
    optimizer.load_state_dict(optimizer.state_dict() | {"state": memory})
    return int(state["n_epochs"])
