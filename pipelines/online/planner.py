"""Chooses whom to analyse: a pure function of what is known of the tracks, within a budget of time for each image.

Every pair of a person and a module has a priority, the weighted sum of five terms: how near the person is, how fast
they come nearer, how much they face the camera, how much of them is visible, and how long the module's last answer is
ago. Pairs are taken in falling order of priority until the next one would cost more than what is left. What is left
then is added to the next image's budget, up to one greatest cost, so that a costly module has its turn.

The last term grows without bound while the others lie within 0..1, so that whoever can be analysed is, in the end.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.online.messages import Plan, Request, Skip, TrackedPerson

Array = NDArray[np.float64]

CHOSEN, BUDGET, UNSEEN, FAR, FRESH, DOWN = range(6)
"""Codes of what was decided."""
REASONS = (
    "chosen",
    "the budget of this image is spent on others",
    "not detected in this image",
    "too far away for the module",
    "the last answer is recent enough",
    "the module is not running",
)
"""In words, by code."""


@dataclass(frozen=True)
class PlannerSettings:
    """How people are chosen.

    Attributes:
        budget_s: For each image [s].
        near: Weight of nearness: 1 at the camera, a half at `near_m`.
        near_m: See `near` [m].
        approach: Weight of the speed at which somebody comes nearer: 1 from `approach_speed` on.
        approach_speed: See `approach` [m/s].
        facing: Weight of facing the camera: 1 = towards it, 0 = away, a half where nothing is known.
        visible: Weight of the visible share.
        stale: Weight of how long the last answer is ago, for each `stale_s`.
        stale_s: See `stale` [s].
    """

    budget_s: float = 0.02
    near: float = 1.0
    near_m: float = 3.0
    approach: float = 0.5
    approach_speed: float = 1.5
    facing: float = 0.5
    visible: float = 0.5
    stale: float = 1.0
    stale_s: float = 0.2

    def __post_init__(self) -> None:
        for name in ("near", "approach", "facing", "visible"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"{name}={getattr(self, name)} must be at least 0")
        for name in ("budget_s", "near_m", "approach_speed", "stale", "stale_s"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)} must be above 0")


class TrackStates(NamedTuple):
    """What is known of n tracks and their answers from m modules.

    Attributes:
        distance: (n,) level, from the camera [m].
        approach: (n,) speed at which they come nearer, below 0 = farther [m/s].
        facing: (n,) cosine of the angle between where they face and the camera; NaN = not known.
        visible: (n,) share that is visible, 0..1.
        is_seen: (n,) bool, detected in this image.
        stale: (n, m) since each module's last answer, or since a second before the track began [s].
    """

    distance: Array
    approach: Array
    facing: Array
    visible: Array
    is_seen: NDArray[np.bool_]
    stale: Array


class ModuleStates(NamedTuple):
    """What is known of m modules.

    Attributes:
        cost: (m,) of one answer [s].
        interval: (m,) a younger answer is not renewed [s].
        reach: (m,) people farther away are not asked about [m].
        weight: (m,) factor of the whole priority.
        is_up: (m,) bool, it can be asked.
    """

    cost: Array
    interval: Array
    reach: Array
    weight: Array
    is_up: NDArray[np.bool_]


class Decision(NamedTuple):
    """What was decided.

    Attributes:
        code: (n, m) uint8, CHOSEN or why not.
        priority: (n, m) float64.
        order: (k, 2) int64, row and module of the chosen, highest priority first.
        spent_s: What they are expected to cost [s].
        credit_s: What the next image may spend beside its budget [s].
    """

    code: NDArray[np.uint8]
    priority: Array
    order: NDArray[np.int64]
    spent_s: float
    credit_s: float


def decide(
    tracks: TrackStates, modules: ModuleStates, settings: PlannerSettings, credit_s: float = 0.0
) -> Decision:
    """Chooses pairs of a track and a module.

    Over any number of images the chosen cost no more than the images' budgets and one greatest cost.

    Args:
        tracks: All.
        modules: All.
        settings: How.
        credit_s: Left by the image before [s].
    """
    n, m = len(tracks.distance), len(modules.cost)
    code, priority = np.empty((n, m), np.uint8), np.empty((n, m))
    weights = np.array(
        [
            settings.near,
            settings.near_m,
            settings.approach,
            settings.approach_speed,
            settings.facing,
            settings.visible,
            settings.stale / settings.stale_s,
        ]
    )
    _prioritise(tracks, modules, weights, code, priority)
    order, spent, left = _choose(modules.cost, settings.budget_s + credit_s, code, priority)
    most = float(modules.cost[modules.is_up].max()) if modules.is_up.any() else 0.0
    return Decision(code, priority, order, spent, min(max(left, 0.0), most))


@njit(cache=True, nogil=True)
def _prioritise(tracks, modules, weights, code, priority):  # type: ignore[no-untyped-def]
    """Fills in the priority of every pair, and why some cannot be chosen; the others are marked with BUDGET."""
    near, near_m, approach, approach_speed, facing, visible, stale = weights
    for i in range(len(tracks.distance)):
        towards = 0.5 if np.isnan(tracks.facing[i]) else 0.5 + 0.5 * tracks.facing[i]
        come = min(max(tracks.approach[i] / approach_speed, 0.0), 1.0)
        own = near * near_m / (near_m + tracks.distance[i]) + approach * come
        own += facing * towards + visible * tracks.visible[i]
        for j in range(len(modules.cost)):
            priority[i, j] = modules.weight[j] * (own + stale * tracks.stale[i, j])
            if not modules.is_up[j]:
                code[i, j] = DOWN
            elif not tracks.is_seen[i]:
                code[i, j] = UNSEEN
            elif tracks.distance[i] > modules.reach[j]:
                code[i, j] = FAR
            elif tracks.stale[i, j] < modules.interval[j]:
                code[i, j] = FRESH
            else:
                code[i, j] = BUDGET


@njit(cache=True, nogil=True)
def _choose(cost, budget, code, priority):  # type: ignore[no-untyped-def]
    """Marks pairs as chosen in falling order of priority, equal ones by row, until one is too costly."""
    n, m = code.shape
    rank = np.empty(n * m)
    for i in range(n):
        for j in range(m):
            rank[i * m + j] = -priority[i, j] if code[i, j] == BUDGET else np.inf
    by_rank = np.argsort(rank, kind="mergesort")
    order = np.empty((n * m, 2), np.int64)
    k, spent = 0, 0.0
    for place in by_rank:
        i, j = place // m, place % m
        if code[i, j] != BUDGET or spent + cost[j] > budget:
            break
        spent += cost[j]
        code[i, j] = CHOSEN
        order[k, 0], order[k, 1] = i, j
        k += 1
    return order[:k], spent, budget - spent


def plan_of(
    stamp: int, decision: Decision, persons: tuple[TrackedPerson, ...], modules: tuple[str, ...], budget_s: float
) -> Plan:
    """A decision as messages.

    Args:
        stamp: Of the image [ns].
        decision: What was decided.
        persons: The tracks, in the order of the decision's rows.
        modules: Names, in the order of its columns.
        budget_s: What the image was allowed to cost [s].
    """
    requests = []
    for row, column in decision.order.tolist():
        found = persons[row].detection
        assert found is not None
        requests.append(
            Request(stamp, persons[row].track_id, modules[column], found.box, found.upper_body, found.axis)
        )
    skips = tuple(
        Skip(stamp, persons[i].track_id, modules[j], REASONS[decision.code[i, j]])
        for i, j in np.argwhere(decision.code != CHOSEN).tolist()
    )
    return Plan(stamp, tuple(requests), skips, float(decision.spent_s), budget_s)
