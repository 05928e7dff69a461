"""Trains heat map nets."""

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from forests.calibration import WITHIN_M, fit_logistic
from forests.frames import FrameSequence, LabelTable
from nets.fitting import Checkpoint, Fit, fit
from nets.heatmap.config import STATES, HeatmapConfig
from nets.heatmap.model import N_TERMS, OUTCOMES, HeatmapModel, patch_places, terms_of
from nets.heatmap.network import HeatmapNet, Names
from nets.heatmap.predict import ask_net
from nets.heatmap.samples import JointPatches, collect_patches, mirrored_order
from nets.heatmap.targets import (
    Targets,
    cell_cost,
    depth_cost,
    heat_cost,
    shown_in_cells,
    state_cost,
    targets_of,
)
from nets.inputs import Draws, draw, training_inputs
from nets.modules import to_arrays
from nets.runtime import repeatable, seed_of

_INITIAL = 3
"""Purpose of the seed that the first weights are drawn with."""
_PATCHES = 1
"""Number of the piece that a checkpoint keeps the patches in."""


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
        checkpoint: Where to keep the patches, and the state after each epoch, and to go on from.
        on_progress: Told the share of the work that is done, 0..1.

    Raises:
        ValueError: Too few frames, or a cost that is not finite.
    """
    labels, names = frames.labels, frames.labels.joints
    patches = _kept_patches(frames, config, n_threads, checkpoint)
    settings = Fit(
        config.n_epochs, config.batch_size, "adamw", config.learning_rate, config.weight_decay, config.seed
    )
    with repeatable(n_threads):
        torch.manual_seed(seed_of(config.seed, 0, _INITIAL))
        net = HeatmapNet(config, told_names(config, labels))
        fit(net, len(patches.depth), _Cost(net, patches, config, labels), settings, checkpoint, on_progress)
        unsure = np.full((len(OUTCOMES), len(names), N_TERMS), np.nan, np.float32)
        model = HeatmapModel(config, names, to_arrays(net), unsure)
        held_out = collect_patches(validation, config, n_threads)
        return HeatmapModel(config, names, model.weights, _calibration(net, model, held_out))


def _kept_patches(
    frames: FrameSequence, config: HeatmapConfig, n_threads: int, checkpoint: Checkpoint | None
) -> JointPatches:
    """The patches of the frames; an interrupted training does not cut them anew, which may take minutes."""
    kept = None if checkpoint is None else checkpoint.load(_PATCHES)
    if kept is not None:
        return JointPatches(**kept)
    patches = collect_patches(frames, config, n_threads)
    if checkpoint is not None:
        checkpoint.save(_PATCHES, patches._asdict())
    return patches


def told_names(config: HeatmapConfig, labels: LabelTable) -> Names:
    """What a net learns to tell of frames with these labels."""
    n_classes = {"none": 0, "one_class": 1, "each_class": labels.n_labels - labels.n_parts}[config.naming]
    n_parts = labels.n_parts if config.parts_weight > 0.0 else 0
    return Names(len(labels.joints), n_parts, n_classes if config.layer == "composite" else 0)


class _Cost:
    """The cost of a batch of patches."""

    def __init__(self, net: HeatmapNet, patches: JointPatches, config: HeatmapConfig, labels: LabelTable) -> None:
        self._net, self._config, self._patches = net, config, patches
        self._n_parts = labels.n_parts
        self._mirrored = mirrored_order(labels.joints)
        turned = 1 + mirrored_order(labels.parts)
        self._turned = np.concatenate([[0], turned]).astype(np.uint8)

    def __call__(self, batch: NDArray[np.int64], rng: np.random.Generator, generator: torch.Generator) -> Tensor:
        config, patches = self._config, self._patches
        draws = draw(rng, len(batch), config)
        label = patches.label[batch]
        kind = (label > 0).astype(np.uint8) + (label > self._n_parts)
        relative = torch.from_numpy(patches.relative[batch])
        images = training_inputs(relative, torch.from_numpy(kind), draws, config.view, generator)
        targets = targets_of(patches, batch, draws, config.view, self._mirrored)
        maps, deepest = self._net.features(images)
        cost = self._joint_cost(maps, deepest, targets)
        if self._net.part is not None or self._net.object is not None:
            cost = cost + self._named_cost(maps, patches.part[batch], label, draws)
        return cost

    def _joint_cost(self, maps: Tensor, deepest: Tensor, targets: Targets) -> Tensor:
        config, net = self._config, self._net
        cost = heat_cost(net.heat(maps), targets, config.heat_cost)
        cost = cost + config.depth_weight * depth_cost(net.depth(maps), targets)
        return cost + config.state_weight * state_cost(net.states(deepest), targets)

    def _named_cost(self, maps: Tensor, part: NDArray[np.uint8], label: NDArray[np.uint8], draws: Draws) -> Tensor:
        """The cost of parts and of objects in the cells, told by the pixels in their middles."""
        config, net = self._config, self._net
        cost = torch.zeros(())
        if net.part is not None:
            parts = shown_in_cells(part, draws, config.view)
            parts = np.where(draws.is_mirrored[:, None, None], self._turned[parts], parts)
            is_told = torch.from_numpy((part > 0).any(axis=(1, 2)))
            classes = torch.from_numpy(parts.astype(np.int64))
            cost = cost + config.parts_weight * cell_cost(net.part(maps), classes, is_told)
        if net.object is not None:
            shown = shown_in_cells(label, draws, config.view).astype(np.int64) - self._n_parts
            shown = np.clip(shown, 0, 1 if config.naming == "one_class" else None)
            shown[draws.is_cut] = 0
            is_told = torch.ones(len(part), dtype=torch.bool)
            cost = cost + config.naming_weight * cell_cost(net.object(maps), torch.from_numpy(shown), is_told)
        return cost


def _calibration(net: HeatmapNet, model: HeatmapModel, patches: JointPatches) -> NDArray[np.float32]:
    """(n_outcomes, n_joints, N_TERMS) float32 weights; NaN of joints that no validation frame knows."""
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
    of_states = [patches.state == STATES.index(name) for name in OUTCOMES[1:]]
    for k, outcome in enumerate((error <= WITHIN_M, *of_states)):
        for joint in range(told.shape[1]):
            known = is_known[:, joint]
            if known.any():
                weights[k, joint] = fit_logistic(told[known, joint], outcome[known, joint])
    return weights
