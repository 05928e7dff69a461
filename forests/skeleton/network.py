"""A small perceptron: trained with Adam in numpy, asked by a kernel about an image and its mirror image together."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

BETA_1, BETA_2, EPSILON = 0.9, 0.999, 1e-6
"""Of Adam (Kingma and Ba 2015, algorithm 1)."""


class Network(NamedTuple):
    """Three layers of weights; the first two are followed by max(0, x).

    Attributes:
        w1: (n_in, n_hidden) float32.
        b1: (n_hidden,) float32.
        w2: (n_hidden, n_hidden) float32.
        b2: (n_hidden,) float32.
        w3: (n_hidden, n_out) float32.
        b3: (n_out,) float32.
    """

    w1: NDArray[np.float32]
    b1: NDArray[np.float32]
    w2: NDArray[np.float32]
    b2: NDArray[np.float32]
    w3: NDArray[np.float32]
    b3: NDArray[np.float32]


def new_network(n_in: int, n_hidden: int, n_out: int, rng: np.random.Generator) -> Network:
    """A network with the random weights of He et al. 2015; the last layer's are a tenth of that."""

    def layer(n: int, m: int, scale: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        weights = rng.normal(0.0, scale * np.sqrt(2.0 / n), (n, m))
        return weights.astype(np.float32), np.zeros(m, np.float32)

    return Network(*layer(n_in, n_hidden, 1.0), *layer(n_hidden, n_hidden, 1.0), *layer(n_hidden, n_out, 0.1))


def no_network() -> Network:
    """A network without weights, which proposes nothing."""
    return Network(*(np.zeros((0, 0) if k % 2 == 0 else 0, np.float32) for k in range(6)))


class Trainer:
    """Adam with decoupled weight decay, and dropout behind the hidden layers.

    Attributes:
        network: Changed in place by every step.
    """

    def __init__(self, network: Network, rng: np.random.Generator, dropout: float, decay: float) -> None:
        self.network = network
        self._rng = rng
        self._dropout = np.float32(dropout)
        self._decay = np.float32(decay)
        self._mean = [np.zeros_like(each) for each in network]
        self._square = [np.zeros_like(each) for each in network]
        self._n_steps = 0

    def forward(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """(n, n_out) float32 answers to (n, n_in) features; kept for `step`."""
        w1, b1, w2, b2, w3, b3 = self.network
        self._first = self._rectified(features @ w1 + b1)
        self._second = self._rectified(self._first @ w2 + b2)
        self._features = features
        return self._second @ w3 + b3

    def step(self, gradient: NDArray[np.float32], rate: float) -> None:
        """Goes one step against the gradient (n, n_out) of the loss at the last answers."""
        _, _, w2, _, w3, _ = self.network
        at_second = (gradient @ w3.T) * (self._second > 0) * self._scale
        at_first = (at_second @ w2.T) * (self._first > 0) * self._scale
        slopes = (
            self._features.T @ at_first,
            at_first.sum(axis=0),
            self._first.T @ at_second,
            at_second.sum(axis=0),
            self._second.T @ gradient,
            gradient.sum(axis=0),
        )
        self._n_steps += 1
        unbiased = np.sqrt(1.0 - BETA_2**self._n_steps) / (1.0 - BETA_1**self._n_steps)
        for values, slope, mean, square in zip(self.network, slopes, self._mean, self._square, strict=True):
            mean[:] += np.float32(1.0 - BETA_1) * (slope - mean)
            square[:] += np.float32(1.0 - BETA_2) * (slope * slope - square)
            if values.ndim == 2:
                values[:] -= np.float32(rate) * self._decay * values
            values[:] -= np.float32(rate * unbiased) * mean / (np.sqrt(square) + np.float32(EPSILON))

    @property
    def _scale(self) -> np.float32:
        return np.float32(1.0) / (np.float32(1.0) - self._dropout)

    def _rectified(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        is_kept = self._rng.random(values.shape, np.float32) >= self._dropout
        return np.maximum(values, 0.0) * is_kept * self._scale


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def ask_network(network: Network, features: np.ndarray, out: np.ndarray) -> None:
    """Answers to several feature vectors at once, so that each weight is read once.

    Args:
        network: The network.
        features: (n, n_in) float32.
        out: (n, n_out) float32 to fill.
    """
    first = np.empty((len(features), len(network.b1)), np.float32)
    second = np.empty((len(features), len(network.b2)), np.float32)
    _layer(features, network.w1, network.b1, first, True)
    _layer(first, network.w2, network.b2, second, True)
    _layer(second, network.w3, network.b3, out, False)


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def _layer(values: np.ndarray, weights: np.ndarray, bias: np.ndarray, out: np.ndarray, is_hidden: bool) -> None:
    for i in range(len(values)):
        out[i] = bias
    for k in range(values.shape[1]):
        row = weights[k]
        for i in range(len(values)):
            value = values[i, k]
            if value != 0.0:
                own = out[i]
                for m in range(len(row)):
                    own[m] += value * row[m]
    if is_hidden:
        for i in range(len(values)):
            for m in range(len(bias)):
                out[i, m] = max(out[i, m], np.float32(0.0))
