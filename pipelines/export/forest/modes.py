"""Part of a forest's graph: mean shift to the modes of the cells and of the votes, as `forests.oarf.peaks` has it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.modes import MERGED, QUICK_MAX_STEPS, QUICK_TOLERANCE
from forests.oarf.peaks import N_EXTRA_STARTS, N_SETTLING_STEPS, NEAR
from nets.values import LAST, Value, constant, joined, repeated
from pipelines.export.forest.cells import Cells
from pipelines.export.forest.votes import CastVotes


class Modes(NamedTuple):
    """Modes of each joint's density, the densest first.

    Attributes:
        place: (n_joints, n_modes, 3) float32 [m]; NaN where missing.
        density: (n_joints, n_modes) float32; 0 where missing.
    """

    place: Value
    density: Value


def modes_of_cells(cells: Cells, bandwidth: NDArray[np.float32], n_modes: int) -> Modes:
    """Mean shift from the heaviest cells.

    Args:
        cells: Cells of the votes.
        bandwidth: (n_joints,) float32, b_j [m].
        n_modes: Modes of a joint, at most.
    """
    n_starts = n_modes + N_EXTRA_STARTS
    start, is_start = _starts(cells, n_starts)
    end, density, way = _climb(cells, start, is_start)
    found: list[Value] = []
    for k in range(n_starts):
        is_found = is_start.pick(k, 1)
        for earlier, is_mode in enumerate(found):  # a climb that comes near a mode ends in it
            away = way.pick(k, 2) - end.pick(earlier, 1)
            is_near = ((away * away).sum(2) < MERGED**2).cast(np.int32).max(0) > 0
            is_found = is_found & ~(is_mode & is_near)
        found.append(is_found)
    is_mode = joined([of.with_axis(1) for of in found], 1)
    count = constant(end.graph, np.array([n_modes]))
    density, which = is_mode.where(density, 0.0).sorted(count, 1, is_rising=False)
    numbers = which.with_axis(2)
    place = end.node("GatherElements", numbers + np.zeros(3, np.int64), axis=1).cast(np.float64)
    metres = cells.origin.with_axis(1) + place * bandwidth.astype(np.float64)[:, None, None]
    is_there = (density > 0.0).with_axis(2)
    return Modes(is_there.where(metres.cast(np.float32), float("nan")), density)


def _starts(cells: Cells, n_starts: int) -> tuple[Value, Value]:
    """The heaviest cells that are farther than a bandwidth from one another.

    Returns:
        Their places (n_joints, n_starts, 3), and whether there was one, (n_joints, n_starts) bool.
    """
    weight, places, are_starts = cells.weight, [], []
    for _ in range(n_starts):
        best = weight.first_of_most(1).reshaped(-1, 1, 1) + np.zeros((1, 1, 3), np.int64)
        place = cells.place.node("GatherElements", best, axis=1)
        places.append(place)
        are_starts.append(weight.max(1, keepdims=True) > 0.0)
        away = cells.place - place
        weight = ((away * away).sum(2) <= 1.0).where(0.0, weight)
    return joined(places, 1), joined(are_starts, 1)


def _climb(cells: Cells, start: Value, is_start: Value) -> tuple[Value, Value, Value]:
    """Climbs from starts, at most QUICK_MAX_STEPS steps.

    Args:
        cells: Cells of the votes.
        start: (n_joints, n_starts, 3) float32, in bandwidths.
        is_start: (n_joints, n_starts) bool, which of them climb.

    Returns:
        Where the climbs end, (n_joints, n_starts, 3); the densities before their last steps, (n_joints, n_starts); and
        where they were after each step, (n_steps, n_joints, n_starts, 3).
    """
    places = cells.place.turned(2, 0, 1).with_axis(2)  # (3, n_joints, 1, n)
    weight = cells.weight.with_axis(1)
    with_one = joined([cells.place, cells.weight.with_axis(2) * 0.0 + 1.0], 2)

    def step(state: list[Value]) -> tuple[Value, list[Value], list[Value]]:
        here, density, is_moving = state
        kernel = weight * bell(_sum_of_squares(places - here.turned(2, 0, 1).with_axis(3)))
        sums = kernel.node("MatMul", with_one)
        total = sums.pick(3, 2)
        there = is_moving.with_axis(2).where(sums.part([0], [3], [2]) / total.with_axis(2), here)
        length = there - here
        is_far = (length * length).sum(2) >= QUICK_TOLERANCE**2
        is_going = is_far & is_moving
        is_any = is_going.cast(np.int32).reshaped(-1).max(0) > 0
        return is_any, [there, is_moving.where(total, density), is_going], [there]

    (end, density, _), (way,) = repeated(step, [start, start.pick(0, 2) * 0.0, is_start], QUICK_MAX_STEPS)
    return end, density, way


def _sum_of_squares(away: Value) -> Value:
    """(...) of (3, ...)."""
    x, y, z = (away.pick(axis) for axis in range(3))
    return x * x + y * y + z * z


def bell(t: Value) -> Value:
    """exp(-t) with the polynomial of `forests.modes.quick_bell`."""
    s = t.least(16.0) * (1.0 / 256.0)
    p = s * -1.0 + 1.0 + s * 0.5 * s
    for _ in range(8):
        p = p * p
    return p


def settle(modes: Modes, votes: CastVotes, bandwidth: NDArray[np.float32]) -> Modes:
    """Moves the densest mode of each joint by mean shift over the votes near it.

    Args:
        modes: Modes of the cells.
        votes: Votes.
        bandwidth: (n_joints,) float32, b_j [m].
    """
    graph = votes.place.graph
    first, width = modes.place.pick(0, 1), constant(graph, bandwidth)
    per_bandwidth = (1.0 / bandwidth).astype(np.float32)
    away = (votes.place - first.at(votes.joint)) * constant(graph, per_bandwidth).at(votes.joint).with_axis(1)
    near = ((away * away).sum(1) <= NEAR**2).true_places().pick(0)
    joint, away, weight = votes.joint.at(near), away.at(near), votes.weight.at(near)
    with_one = joined([away, weight.with_axis(1) * 0.0 + 1.0], 1)
    of_joint = joint.equals(np.arange(len(bandwidth))[:, None]).cast(np.float32)
    here, total = constant(graph, np.zeros((len(bandwidth), 3), np.float32)), first
    for _ in range(N_SETTLING_STEPS):
        kernel = weight * bell(_sum_of_squares((away - here.at(joint)).turned(1, 0)))
        sums = of_joint.node("MatMul", kernel.with_axis(1) * with_one)
        total = sums.pick(3, 1)
        here = sums.part([0], [3], [1]) / total.with_axis(1)
    settled = (first + here * width.with_axis(1)).with_axis(1)
    others = modes.place.part([1], [LAST], [1])
    ratio = (total / modes.density.pick(0, 1)).with_axis(1)
    density = (modes.density > 0.0).where(modes.density * ratio, 0.0)
    return Modes(joined([settled, others], 1), density)
