"""Slow, obvious twins of mean shift and of the leaf tables."""

import numpy as np
from scipy.optimize import minimize


def density(points: np.ndarray, weights: np.ndarray, place: np.ndarray, bandwidth: float) -> float:
    """Sum of w exp(-|place - p|^2 / b^2) (equation 6)."""
    squared = ((points - place) ** 2).sum(axis=1)
    return float((weights * np.exp(-squared / bandwidth**2)).sum())


def mean_shift(points: np.ndarray, weights: np.ndarray, bandwidth: float) -> tuple[np.ndarray, np.ndarray]:
    """Every point climbs by plain steps to the very top; tops a tenth of a bandwidth apart are two modes.

    Returns:
        Modes (n, 3) and the weight that ended in each, heaviest first.
    """
    modes: list[np.ndarray] = []
    ended: list[float] = []
    for start, weight in zip(points, weights, strict=True):
        place, step = start.astype(float), np.inf
        while step > 1e-9 * bandwidth:
            kernel = weights * np.exp(-((points - place) ** 2).sum(axis=1) / bandwidth**2)
            mean = kernel @ points / kernel.sum()
            step = float(np.linalg.norm(mean - place))
            place = mean
        near = [k for k, mode in enumerate(modes) if np.linalg.norm(mode - place) < 0.1 * bandwidth]
        if near:
            ended[near[0]] += weight
        else:
            modes.append(place)
            ended.append(float(weight))
    order = np.argsort(-np.array(ended), kind="stable")
    return np.array(modes)[order], np.array(ended)[order]


def highest_place(points: np.ndarray, weights: np.ndarray, bandwidth: float) -> np.ndarray:
    """Where the density is greatest, by a general optimiser from every point."""

    def negative(place: np.ndarray) -> float:
        return -density(points, weights, place, bandwidth)

    tops = [minimize(negative, point, method="BFGS", options={"gtol": 1e-7}) for point in points]
    return np.array(min(tops, key=lambda top: top.fun).x)


def leaf_modes(
    offsets: np.ndarray, is_occluder: np.ndarray, bandwidth: float, n_modes: int, n_layers: int
) -> tuple[np.ndarray, np.ndarray]:
    """Modes (n_layers, n_joints, n_modes, 3) and weights (n_layers, n_joints, n_modes) of one leaf.

    Args:
        offsets: (n, n_joints, 3) of the leaf's samples.
        is_occluder: (n,) bool.
        bandwidth: b.
        n_modes: Modes kept.
        n_layers: 1 or 2.
    """
    n, n_joints, _ = offsets.shape
    mode, weight = np.zeros((n_layers, n_joints, n_modes, 3)), np.zeros((n_layers, n_joints, n_modes))
    for layer in range(n_layers):
        own = offsets[is_occluder == bool(layer)]
        for joint in range(n_joints if len(own) else 0):
            modes, ended = mean_shift(own[:, joint], np.ones(len(own)), bandwidth)
            kept = min(n_modes, len(modes))
            mode[layer, joint, :kept], weight[layer, joint, :kept] = modes[:kept], ended[:kept] / n
    return mode, weight
