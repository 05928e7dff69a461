"""Asks heat map nets for joints."""

import numpy as np
import torch
from numpy.typing import NDArray

from forests.boxes import Box
from forests.calibration import logistic
from forests.crops import foreground_box
from forests.estimate import JointEstimate
from forests.frames import Pinhole, check_depth
from nets.heatmap.config import STRIDE
from nets.heatmap.decode import N_PEAKS, Peaks, find_peaks, shares_of
from nets.heatmap.model import HeatmapModel, patch_places, terms_of
from nets.heatmap.network import HeatmapNet, names_of, net_of
from nets.heatmap.samples import from_patch
from nets.inputs import crop_inputs
from nets.modules import from_arrays
from nets.patches import body_window, cut_patch


def ask_net(
    net: HeatmapNet, model: HeatmapModel, relative: NDArray[np.int16]
) -> tuple[Peaks, NDArray[np.float32]]:
    """Peaks of one patch, and (4, n_joints) logits of states.

    Args:
        net: In evaluation mode.
        model: Its settings.
        relative: (height, width) int16 patch with its margin [mm].
    """
    with torch.inference_mode():
        heat, depth, state = (value[0].numpy() for value in net(crop_inputs(relative[None], model.config.view, 1)))
    return find_peaks(shares_of(heat, model.config.heat_cost), depth), state


class HeatmapPredictor:
    """A trained net, ready to be asked from several threads at once.

    Attributes:
        model: The trained net.
    """

    def __init__(self, model: HeatmapModel) -> None:
        """Makes a model ready to be asked.

        Raises:
            ValueError: Its weights are not those of such a net.
        """
        self.model = model
        self._net = net_of(model.config, names_of(model.weights, len(model.joints)))
        from_arrays(self._net, model.weights)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of every answer."""
        return self.model.joints

    @property
    def box_joints(self) -> tuple[str, ...]:
        """The box should lie about all joints."""
        return self.model.joints

    def predict(self, depth: NDArray[np.uint16], camera: Pinhole, box: Box | None = None) -> JointEstimate:
        """Finds the joints; see `forests.estimate.JointPredictor`.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Intrinsics.
            box: Where the person is; None = everything that the image shows.

        Raises:
            ValueError: No depth image, or an empty box.
        """
        depth, view = check_depth(depth), self.model.config.view
        box = foreground_box(depth) if box is None else box
        try:
            window = body_window(depth, camera, box, view.height * view.pixel_m)
        except ValueError:
            if depth.any() and not (box[0] < box[2] and box[1] < box[3]):
                raise
            return self._nothing(camera)
        patch = cut_patch(depth, camera, window, view.patch, view.pixel_m)
        peaks, state = ask_net(self._net, self.model, patch.relative)
        proposals = from_patch(patch_places(peaks, view), camera, window, view)
        terms = terms_of(peaks, state)
        within, hidden, self_hidden, outside = (logistic(weights, terms) for weights in self.model.calibration)
        return JointEstimate(
            proposals.astype(np.float32),
            peaks.heat,
            within,
            hidden,
            (peaks.spread * STRIDE * view.pixel_m).astype(np.float32),
            camera,
            outside_probability=outside,
            self_hidden_probability=self_hidden,
        )

    def _nothing(self, camera: Pinhole) -> JointEstimate:
        """The answer about an image that shows nothing."""
        n = len(self.joints)
        none = np.full((n, N_PEAKS, 3), np.nan, np.float32)
        unknown = np.full(n, np.nan, np.float32)
        return JointEstimate(none, np.zeros((n, N_PEAKS), np.float32), unknown, unknown, unknown, camera)
