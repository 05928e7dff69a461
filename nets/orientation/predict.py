"""Asks orientation nets."""

import math
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from forests.boxes import Box
from forests.frames import Pinhole, check_depth
from nets.inputs import crop_inputs
from nets.orientation.angles import Array
from nets.orientation.config import OrientationConfig, Region
from nets.orientation.decode import RawOutputs, decode_crops, softmax
from nets.orientation.estimate import OrientationEstimate
from nets.orientation.frames import patch_of
from nets.orientation.model import OrientationModel
from nets.orientation.network import OrientationNet, net_of

BATCH = 64


class Answers(NamedTuple):
    """What a net answers about n patches.

    Attributes:
        angle: (n,) [rad].
        log_concentration: (n,) before calibration.
        auxiliary: (n, n_auxiliary): probabilities of postures, or tilt and roll [rad].
    """

    angle: Array
    log_concentration: Array
    auxiliary: Array


def n_crops_of(config: OrientationConfig) -> int:
    """Crops that are averaged: five as in the paper, one of small nets."""
    return 5 if config.architecture == "paper" else 1


def ask_patches(net: OrientationNet, config: OrientationConfig, relative: NDArray[np.int16]) -> Answers:
    """Asks about many patches.

    Args:
        net: In evaluation mode.
        config: Its settings.
        relative: (n, ...) int16 patches with their margin [mm].
    """
    return read_outputs(raw_outputs(net, config, relative), config, n_crops_of(config))


def raw_outputs(net: OrientationNet, config: OrientationConfig, relative: NDArray[np.int16]) -> RawOutputs:
    """What the net puts out for all crops of many patches, those of each patch after one another."""
    n_crops = n_crops_of(config)
    none = np.empty((0, config.n_angle)), np.empty(0), np.empty((0, config.n_auxiliary))
    parts = [RawOutputs(*(values.astype(np.float32) for values in none))]
    with torch.inference_mode():
        for begin in range(0, len(relative), BATCH):
            images = crop_inputs(relative[begin : begin + BATCH], config.view, n_crops)
            parts.append(RawOutputs(*(value.numpy() for value in net(images))))
    return RawOutputs(*map(np.concatenate, zip(*parts, strict=True)))


def read_outputs(raw: RawOutputs, config: OrientationConfig, n_crops: int) -> Answers:
    """Averages over the crops of each image.

    Args:
        raw: Of all crops, those of each image after one another.
        config: The net's settings.
        n_crops: Crops of each image.
    """
    angle, told, auxiliary = (np.asarray(value, np.float64) for value in raw)
    auxiliary = auxiliary.reshape(-1, n_crops, config.n_auxiliary)
    auxiliary = softmax(auxiliary) if config.region == "body" else auxiliary
    return Answers(
        decode_crops(angle.reshape(-1, n_crops, config.n_angle), config.output),
        told.reshape(-1, n_crops).mean(axis=1),
        auxiliary.mean(axis=1),
    )


class OrientationPredictor:
    """Tells which way the person in a depth image faces. It may be asked from several threads at once.

    Attributes:
        model: The trained net.
    """

    def __init__(self, model: OrientationModel) -> None:
        """Makes a model ready to be asked.

        Raises:
            ValueError: Its weights are not those of such a net.
        """
        self.model = model
        self._net = net_of(model.config, model.weights)

    @property
    def region(self) -> Region:
        """What is looked at: body or head."""
        return self.model.config.region

    def predict(self, depth: NDArray[np.uint16], camera: Pinhole, box: Box) -> OrientationEstimate:
        """Tells which way the person faces.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Intrinsics.
            box: left, top, right, bottom [px] of the body or of the head.

        Raises:
            ValueError: No depth image, an empty box, or one in which the image shows nothing.
        """
        config = self.model.config
        patch = patch_of(config.region, config.view, check_depth(depth), camera, box)
        return self.estimates(patch.relative[None])[0]

    def estimates(self, relative: NDArray[np.int16]) -> list[OrientationEstimate]:
        """Tells of each of the patches (n, ...) int16 [mm], with their margin, which way the person faces."""
        config, calibration = self.model.config, self.model.calibration
        answers = ask_patches(self._net, config, relative)
        concentration = calibration.concentration(answers.log_concentration)
        probability = calibration.probability(answers.log_concentration)
        out = []
        for row, angle in enumerate(answers.angle.tolist()):
            second = answers.auxiliary[row]
            tilt, roll = (math.nan, math.nan) if config.region == "body" else second.tolist()
            postures = second.astype(np.float32) if config.region == "body" else np.empty(0, np.float32)
            told = float(concentration[row]), float(probability[row])
            out.append(OrientationEstimate(config.region, angle, *told, tilt, roll, postures))
        return out
