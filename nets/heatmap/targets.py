"""What a batch of patches should give, as drawn, and what it costs if it does not."""

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from nets.heatmap.config import CELL_MIDDLE, SIGMA, STRIDE, HeatCost
from nets.heatmap.samples import JointPatches
from nets.inputs import Draws, shown_pixels
from nets.views import View


class Targets(NamedTuple):
    """What a net should put out of n people.

    Attributes:
        heat: (n, n_joints, rows, columns) float32 bells about the joints, at most 1; zeros of those beyond the map.
        is_on_map: (n, n_joints) bool, the joint lies on the map.
        depth: (n, n_joints) float32, minus the distance that is told [m]; 0 where unknown.
        state: (n, n_joints) int64, number in `STATES`; -1 = unknown.
        is_known: (n, n_joints) bool.
    """

    heat: Tensor
    is_on_map: Tensor
    depth: Tensor
    state: Tensor
    is_known: Tensor


def targets_of(
    patches: JointPatches, batch: NDArray[np.int64], draws: Draws, view: View, mirrored: NDArray[np.int64]
) -> Targets:
    """The targets of a batch.

    Args:
        patches: All patches.
        batch: (n,) which of them.
        draws: What happens to each.
        view: What the net looks at.
        mirrored: (n_joints,) the joint on the other side.
    """
    place, depth, state = patches.place[batch].astype(np.float64), patches.depth[batch], patches.state[batch]
    turned = draws.is_mirrored[:, None]
    place = np.where(turned[:, :, None], place[:, mirrored], place)
    depth, state = (np.where(turned, values[:, mirrored], values) for values in (depth, state))
    cells = (crop_places(place, draws, view) - CELL_MIDDLE) / STRIDE
    rows, columns = view.height // STRIDE, view.width // STRIDE
    is_known = np.isfinite(place).all(axis=2)
    is_inside = (cells >= -0.5) & (cells < np.array([rows, columns]) - 0.5)
    is_on_map = np.asarray(is_known & is_inside.all(axis=2))
    cells = np.where(is_on_map[:, :, None], cells, -1e3)
    along = [
        np.exp(-0.5 * ((np.arange(n) - cells[:, :, axis, None]) / SIGMA) ** 2)
        for axis, n in enumerate((rows, columns))
    ]
    heat = (along[0][..., :, None] * along[1][..., None, :]).astype(np.float32)
    moved = np.nan_to_num(depth / draws.scale[:, None] + draws.depth_m[:, None]).astype(np.float32)
    return Targets(*map(torch.from_numpy, (heat, is_on_map, moved, state, is_known)))


def crop_places(place: NDArray[np.float64], draws: Draws, view: View) -> NDArray[np.float64]:
    """(n, n_joints, 2) rows and columns in the crop [px] that `nets.inputs.training_inputs` shows of patches."""
    middle = (np.array(view.patch) - 1) / 2.0 + draws.shift[:, None, :]
    at = (place - middle) / draws.scale[:, None, None]
    at[draws.is_mirrored, :, 1] *= -1.0
    return at + (np.array([view.height, view.width]) - 1) / 2.0


def heat_cost(heat: Tensor, targets: Targets, kind: HeatCost) -> Tensor:
    """The mean cost of the maps of joints that lie on theirs; with mse also of those that do not, as empty maps."""
    if kind == "mse":
        known = targets.is_known
        square = ((heat - targets.heat) ** 2).sum(dim=(2, 3))
        return (square * known).sum() / known.sum().clamp(min=1)
    cost = -(_shares(targets) * functional.log_softmax(heat.flatten(2), dim=2)).sum(dim=2)
    return (cost * targets.is_on_map).sum() / targets.is_on_map.sum().clamp(min=1)


def depth_cost(depth: Tensor, targets: Targets) -> Tensor:
    """The mean absolute deviation of the depths about the true places [m]."""
    off = (_shares(targets) * (depth.flatten(2) - targets.depth[:, :, None]).abs()).sum(dim=2)
    return (off * targets.is_on_map).sum() / targets.is_on_map.sum().clamp(min=1)


def _shares(targets: Targets) -> Tensor:
    """(n, n_joints, n_cells) the bells as distributions; zeros of joints beyond the map."""
    share = targets.heat.flatten(2)
    return share / share.sum(dim=2, keepdim=True).clamp(min=1e-6)


def state_cost(state: Tensor, targets: Targets) -> Tensor:
    """The mean negative log-likelihood of the states (n, n_states, n_joints) of known joints."""
    cost = functional.cross_entropy(state, targets.state, ignore_index=-1, reduction="sum")
    return cost / targets.is_known.sum().clamp(min=1)


def shown_in_cells(values: NDArray[np.uint8], draws: Draws, view: View) -> NDArray[np.uint8]:
    """(n, rows, columns) what crops of patches (n, height, width) show in the middles of a map's cells."""
    rows, columns = (along.numpy() for along in shown_pixels(draws, view))
    middle = slice(STRIDE // 2, None, STRIDE)
    return values[np.arange(len(values))[:, None, None], rows[:, middle], columns[:, :, middle]]


def cell_cost(logits: Tensor, classes: Tensor, counts: Tensor) -> Tensor:
    """The mean negative log-likelihood of what the cells of maps show.

    Args:
        logits: (n, n_classes, rows, columns).
        classes: (n, rows, columns) int64.
        counts: (n,) bool, images that are learned from.
    """
    cost = functional.cross_entropy(logits, classes, reduction="none").mean(dim=(1, 2))
    return (cost * counts).sum() / counts.sum().clamp(min=1)
