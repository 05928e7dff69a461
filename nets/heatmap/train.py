"""Trains heat map nets."""

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from forests.calibration import WITHIN_M, fit_logistic
from forests.frames import FrameSequence
from nets.fitting import Checkpoint, Fit, fit
from nets.heatmap.config import HeatmapConfig
from nets.heatmap.model import N_TERMS, OUTCOMES, HeatmapModel, patch_places, terms_of
from nets.heatmap.network import HeatmapNet
from nets.heatmap.predict import ask_net
from nets.heatmap.samples import JointPatches, collect_patches, mirrored_order
from nets.heatmap.targets import depth_cost, heat_cost, state_cost, targets_of
from nets.inputs import draw, training_inputs
from nets.modules import to_arrays
from nets.runtime import repeatable, seed_of

_INITIAL = 3
"""Purpose of the seed that the first weights are drawn with."""


def train(
    frames: FrameSequence,
    config: HeatmapConfig,
    *,
    validation: FrameSequence,
    n_threads: int = 1,
    checkpoint: Checkpoint | None = None,
    on_progress: Callable[[float], object] = lambda share: None,
) -> HeatmapModel:
    """Trains a net and calibrates its probabilities.

    On the CPU the same frames, settings and number of threads give the same weights to the bit.

    Args:
        frames: What to learn from.
        config: How.
        validation: What to calibrate on; may be empty.
        n_threads: Threads; another number gives slightly different weights.
        checkpoint: Where to keep the state after each epoch, and to go on from.
        on_progress: Told the share of the work that is done, 0..1.

    Raises:
        ValueError: Too few frames, or a cost that is not finite.
    """
    names = frames.labels.joints
    patches = collect_patches(frames, config)
    settings = Fit(
        config.n_epochs, config.batch_size, "adamw", config.learning_rate, config.weight_decay, config.seed
    )
    with repeatable(n_threads):
        torch.manual_seed(seed_of(config.seed, 0, _INITIAL))
        net = HeatmapNet(config, len(names))
        fit(net, len(patches.depth), _Cost(net, patches, config, names), settings, checkpoint, on_progress)
        unsure = np.full((len(OUTCOMES), len(names), N_TERMS), np.nan, np.float32)
        model = HeatmapModel(config, names, to_arrays(net), unsure)
        held_out = collect_patches(validation, config)
        return HeatmapModel(config, names, model.weights, _calibration(net, model, held_out))


class _Cost:
    """The cost of a batch of patches."""

    def __init__(
        self, net: HeatmapNet, patches: JointPatches, config: HeatmapConfig, names: tuple[str, ...]
    ) -> None:
        self._net, self._config, self._patches = net, config, patches
        self._relative, self._kind = torch.from_numpy(patches.relative), torch.from_numpy(patches.kind)
        self._mirrored = mirrored_order(names)

    def __call__(self, batch: NDArray[np.int64], rng: np.random.Generator, generator: torch.Generator) -> Tensor:
        config = self._config
        draws = draw(rng, len(batch), config)
        at = torch.from_numpy(batch)
        images = training_inputs(self._relative[at], self._kind[at], draws, config.view, generator)
        targets = targets_of(self._patches, batch, draws, config.view, self._mirrored)
        heat, depth, state = self._net(images)
        cost = heat_cost(heat, targets, config.heat_cost) + config.depth_weight * depth_cost(depth, targets)
        return cost + config.state_weight * state_cost(state, targets)


def _calibration(net: HeatmapNet, model: HeatmapModel, patches: JointPatches) -> NDArray[np.float32]:
    """(3, n_joints, N_TERMS) float32 weights; NaN of joints that no validation frame knows."""
    weights = model.calibration.copy()
    if not len(patches.depth):
        return weights
    view = model.config.view
    terms, errors = [], []
    for relative, place, depth in zip(patches.relative, patches.place, patches.depth, strict=True):
        peaks, state = ask_net(net, model, relative)
        terms.append(terms_of(peaks, state))
        off = patch_places(peaks, view)[:, 0] - np.concatenate([place, depth[:, None]], axis=1)
        errors.append(np.linalg.norm(off * (view.pixel_m, view.pixel_m, 1.0), axis=1))
    told, error = np.array(terms), np.array(errors)
    is_known = np.isfinite(error)
    for k, outcome in enumerate((error <= WITHIN_M, patches.is_hidden, patches.is_outside)):
        for joint in range(told.shape[1]):
            known = is_known[:, joint]
            if known.any():
                weights[k, joint] = fit_logistic(told[known, joint], outcome[known, joint])
    return weights
