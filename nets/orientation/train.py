"""Trains orientation nets."""

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from nets.fitting import Checkpoint, Fit, fit
from nets.inputs import draw, training_inputs
from nets.modules import to_arrays
from nets.orientation.angles import angular_error, bin_centre, bin_of
from nets.orientation.concentration import calibrate
from nets.orientation.config import OrientationConfig
from nets.orientation.costs import COSTS, concentration_cost, posture_cost, tilt_roll_cost
from nets.orientation.decode import decode_angle
from nets.orientation.frames import Patches
from nets.orientation.model import OrientationModel
from nets.orientation.network import OrientationNet
from nets.orientation.predict import ask_patches
from nets.runtime import repeatable, seed_of

CONCENTRATION_WEIGHT = 0.1
_INITIAL = 3
"""Purpose of the seed that the first weights are drawn with."""


def train(
    patches: Patches,
    config: OrientationConfig,
    *,
    validation: Patches,
    n_threads: int = 1,
    checkpoint: Checkpoint | None = None,
    on_progress: Callable[[float], object] = lambda share: None,
) -> OrientationModel:
    """Trains a net and calibrates its concentration.

    On the CPU the same patches, settings and number of threads give the same weights to the bit.

    Args:
        patches: What to learn from.
        config: How.
        validation: What to calibrate on; may be empty.
        n_threads: Threads; another number gives slightly different weights.
        checkpoint: Where to keep the state after each epoch, and to go on from.
        on_progress: Told the share of the work that is done, 0..1.

    Raises:
        ValueError: Too few patches, or a cost that is not finite.
    """
    settings = Fit(
        config.n_epochs,
        config.batch_size,
        config.optimizer,
        config.learning_rate,
        config.weight_decay,
        config.seed,
    )
    with repeatable(n_threads):
        torch.manual_seed(seed_of(config.seed, 0, _INITIAL))
        net = OrientationNet(config)
        cost = _Cost(net, patches, config)
        fit(net, len(patches.angle), cost, settings, checkpoint, on_progress)
        model = OrientationModel(config, to_arrays(net))
        raw = ask_patches(net, config, validation.relative)
    error = angular_error(raw.angle, validation.angle)
    return OrientationModel(config, model.weights, calibrate(raw.log_concentration, error))


class _Cost:
    """The cost of a batch of patches."""

    def __init__(self, net: OrientationNet, patches: Patches, config: OrientationConfig) -> None:
        self._net, self._config = net, config
        self._relative, self._kind = (torch.from_numpy(np.ascontiguousarray(v)) for v in patches[:2])
        self._patches = patches

    def __call__(self, batch: NDArray[np.int64], rng: np.random.Generator, generator: torch.Generator) -> Tensor:
        config = self._config
        draws = draw(rng, len(batch), config)
        at = torch.from_numpy(batch)
        images = training_inputs(self._relative[at], self._kind[at], draws, config.view, generator)
        sign = np.where(draws.is_mirrored, -1.0, 1.0)
        angle = learned_angle(sign * self._patches.angle[batch], config.n_bins)
        raw, log_kappa, auxiliary = self._net(images)
        sector = torch.from_numpy(bin_of(angle, max(1, config.n_bins)))
        target = torch.from_numpy(angle.astype(np.float32))
        cost = COSTS[config.output](raw, target, sector, config.kappa).mean()
        error = angular_error(decode_angle(raw.detach().numpy(), config.output), angle)
        sure = concentration_cost(log_kappa, torch.from_numpy(error.astype(np.float32))).mean()
        cost = cost + CONCENTRATION_WEIGHT * sure
        if config.auxiliary_weight > 0.0:
            cost = cost + config.auxiliary_weight * self._second(auxiliary, batch, sign)
        return cost

    def _second(self, auxiliary: Tensor, batch: NDArray[np.int64], sign: NDArray[np.float64]) -> Tensor:
        """The cost of postures, or of tilts and rolls."""
        patches = self._patches
        if self._config.region == "body":
            return posture_cost(auxiliary, torch.from_numpy(patches.posture[batch]))
        true = np.stack([patches.tilt[batch], sign * patches.roll[batch]], axis=1)
        return tilt_roll_cost(auxiliary, torch.from_numpy(true.astype(np.float32)))


def learned_angle(angle: NDArray[np.floating], n_bins: int) -> NDArray[np.float64]:
    """(n,) angles that are learned: the true ones (n,), or the middles of their sectors [rad]."""
    return bin_centre(bin_of(angle, n_bins), n_bins) if n_bins else np.asarray(angle, np.float64)
