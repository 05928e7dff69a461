"""What a batch of patches should give, as drawn, and what it costs if it does not."""

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from nets.heatmap.config import SIGMA, STRIDE, HeatCost
from nets.heatmap.samples import JointPatches
from nets.inputs import Draws
from nets.views import View


class Targets(NamedTuple):
    """What a net should put out of n people.

    Attributes:
        heat: (n, n_joints, rows, columns) float32 bells about the joints, at most 1; zeros of those beyond the map.
        is_on_map: (n, n_joints) bool, the joint lies on the map.
        depth: (n, n_joints) float32, minus the distance that is told [m]; 0 where unknown.
        state: (n, 2, n_joints) float32: hidden by an object, outside the image; 0 or 1.
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
    place, depth = patches.place[batch].astype(np.float64), patches.depth[batch]
    state = np.stack([patches.is_hidden[batch], patches.is_outside[batch]], axis=1)
    turned = draws.is_mirrored
    place[turned] = place[turned][:, mirrored]
    depth = np.where(turned[:, None], depth[:, mirrored], depth)
    state[turned] = state[turned][:, :, mirrored]
    cells = crop_places(place, draws, view) / STRIDE
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
    moved = np.nan_to_num(depth + draws.depth_m[:, None]).astype(np.float32)
    return Targets(
        torch.from_numpy(heat),
        torch.from_numpy(is_on_map),
        torch.from_numpy(moved),
        torch.from_numpy(state.astype(np.float32)),
        torch.from_numpy(is_known),
    )


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
    share = targets.heat.flatten(2)
    share = share / share.sum(dim=2, keepdim=True).clamp(min=1e-6)
    cost = -(share * functional.log_softmax(heat.flatten(2), dim=2)).sum(dim=2)
    return (cost * targets.is_on_map).sum() / targets.is_on_map.sum().clamp(min=1)


def depth_cost(depth: Tensor, targets: Targets) -> Tensor:
    """The mean absolute deviation of the depths about the true places [m]."""
    share = targets.heat.flatten(2)
    share = share / share.sum(dim=2, keepdim=True).clamp(min=1e-6)
    off = (share * (depth.flatten(2) - targets.depth[:, :, None]).abs()).sum(dim=2)
    return (off * targets.is_on_map).sum() / targets.is_on_map.sum().clamp(min=1)


def state_cost(state: Tensor, targets: Targets) -> Tensor:
    """The mean negative log-likelihood of the states of known joints."""
    cost = functional.binary_cross_entropy_with_logits(state, targets.state, reduction="none").mean(dim=1)
    return (cost * targets.is_known).sum() / targets.is_known.sum().clamp(min=1)
