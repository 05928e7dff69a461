"""How far solids may move along a straight line before they come near points."""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from synth.occluders.model import CAPSULE
from synth.occluders.solids.distance import FASTMATH, PlacedSolids, point_distance

TOLERANCE = 0.001
"""A way ends within this of the wanted gap [m]."""
_MAX_STEPS = 100


def joined(parts: Sequence[PlacedSolids]) -> PlacedSolids:
    """Several objects' posed solids as one."""
    return PlacedSolids(*(np.concatenate(field) for field in zip(*parts, strict=True)))


def free_way(placed: PlacedSolids, points: ArrayLike, direction: ArrayLike, gap: float, longest: float) -> float:
    """How far posed solids move along a direction until they are `gap` away from the points.

    The distance to a moving object changes by at most the step, so a step of (distance - gap) never overshoots
    (conservative advancement; Mirtich 1996, "Impulse-based dynamic simulation of rigid body systems", 2.3).

    Args:
        placed: The solids, where they start.
        points: (n, 3) world frame [m].
        direction: (3,) unit vector, world frame.
        gap: Distance to stop at [m].
        longest: Longest way of interest [m].

    Returns:
        The way [m]; -1 if the solids start nearer than the gap, infinity if they meet nothing within `longest`.
    """
    xyz = np.ascontiguousarray(points, dtype=np.float64)
    unit = np.ascontiguousarray(direction, dtype=np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3:
        raise ValueError(f"points have shape {xyz.shape}, must be (n, 3)")
    if unit.shape != (3,) or not abs(float(unit @ unit) - 1.0) < 1e-6:
        raise ValueError(f"direction={unit.tolist()} must be a unit vector of 3 numbers")
    return float(_free_way(xyz, placed, unit, float(gap), float(longest), np.zeros(len(xyz))))


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def _box(placed):  # type: ignore[no-untyped-def]
    """Corners of an axis-aligned box round all solids; a cylinder or capsule counts as the box round it."""
    low = np.full(3, np.inf)
    high = np.full(3, -np.inf)
    for k in range(len(placed.kind)):
        for axis in range(3):
            half = placed.size[k, 0] if placed.kind[k] == CAPSULE else 0.0
            for j in range(3):
                half += abs(placed.T_solid_world[k, j, axis]) * placed.size[k, j]
            low[axis] = min(low[axis], placed.centre[k, axis] - half)
            high[axis] = max(high[axis], placed.centre[k, axis] + half)
    return low, high


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def _bound_from_below(points, placed, unit, gap, longest, lower):  # type: ignore[no-untyped-def]
    """Each point's lower bound: its distance from the solids' box, infinite if the swept box passes it by."""
    low, high = _box(placed)
    margin = gap + 2.0 * TOLERANCE
    for i in range(len(points)):
        square = 0.0
        is_aside = False
        for axis in range(3):
            x = points[i, axis]
            way = longest * unit[axis]
            is_aside |= x < low[axis] + min(way, 0.0) - margin or x > high[axis] + max(way, 0.0) + margin
            off = max(low[axis] - x, x - high[axis], 0.0)
            square += off * off
        lower[i] = np.inf if is_aside else np.sqrt(square)


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def _lowest(points, placed, shift, bound, lower):  # type: ignore[no-untyped-def]
    """Smallest distance below the bound of the points, moved by -shift; raises each point's lower bound."""
    best = bound
    moved = np.empty(3)
    # A first look at every 16th point gives a bound that lets the second pass skip most of the others.
    for stride in (16, 1):
        for i in range(0, len(points), stride):
            if lower[i] >= best:
                continue
            for axis in range(3):
                moved[axis] = points[i, axis] - shift[axis]
            distance = point_distance(moved, placed, best)
            lower[i] = distance
            best = min(best, distance)
    return best


@njit(cache=True, nogil=True, fastmath=FASTMATH)
def _free_way(points, placed, unit, gap, longest, lower):  # type: ignore[no-untyped-def]
    _bound_from_below(points, placed, unit, gap, longest, lower)
    way = 0.0
    for _ in range(_MAX_STEPS):
        bound = longest - way + gap + 2.0 * TOLERANCE
        distance = _lowest(points, placed, way * unit, bound, lower)
        if distance >= bound:
            return np.inf
        if distance < gap - TOLERANCE:
            return -1.0
        if distance <= gap + TOLERANCE:
            return way
        step = distance - gap
        way += step
        for i in range(len(lower)):
            lower[i] -= step
    return way
