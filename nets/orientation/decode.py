"""From what an orientation net puts out to angles; the same for torch, ONNX and averages over crops."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nets.orientation.angles import Array, bin_centre, interpolated_peak, wrapped
from nets.orientation.config import Output


class RawOutputs(NamedTuple):
    """What a net puts out.

    Attributes:
        angle: (n, n_angle) float32: unit vectors (cosine, sine), angles [rad], or logits of sectors.
        log_concentration: (n,) float32, before calibration.
        auxiliary: (n, n_auxiliary) float32: logits of postures, or tilt and roll [rad].
    """

    angle: NDArray[np.float32]
    log_concentration: NDArray[np.float32]
    auxiliary: NDArray[np.float32]


def decode_angle(raw: NDArray[np.floating], output: Output) -> Array:
    """(n,) angles [rad] of what one forward pass puts out.

    Args:
        raw: (n, n_angle).
        output: What the net puts out.
    """
    return decode_crops(np.asarray(raw)[:, None], output)


def decode_crops(raw: NDArray[np.floating], output: Output) -> Array:
    """(n,) angles [rad] of several crops of each image: the crops' outputs are averaged.

    Unit vectors are averaged as vectors, angles as numbers (which is what the paper's baselines do, and is wrong
    where they wrap), classes by their probabilities.

    Args:
        raw: (n, n_crops, n_angle).
        output: What the net puts out.
    """
    values = np.asarray(raw, np.float64)
    if output.startswith("biternion"):
        mean = values.mean(axis=1)
        return np.asarray(np.arctan2(mean[:, 1], mean[:, 0]))
    if not output.startswith("softmax"):
        return wrapped(values[:, :, 0].mean(axis=1))
    posterior = softmax(values).mean(axis=1)
    if output == "softmax_interpolated":
        return interpolated_peak(posterior)
    return bin_centre(posterior.argmax(axis=1), posterior.shape[1])


def softmax(logits: NDArray[np.floating]) -> Array:
    """Probabilities along the last axis."""
    values = np.asarray(logits, np.float64)
    raised = np.exp(values - values.max(axis=-1, keepdims=True))
    return np.asarray(raised / raised.sum(axis=-1, keepdims=True))
