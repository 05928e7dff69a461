"""Inverse kinematics of an arm or a leg within joint limits.

A two-bone closed form bends and swings the limb to the first goal; Levenberg-Marquardt steps with the hinges at
their limits held (a projected Gauss-Newton method, Nocedal & Wright 2006, chapters 10 and 16.7) do the rest.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.bodies.rig.ik_kernels import GoalArrays, solve_chain
from synth.bodies.rig.kinematics import AXIS_IDX, AXIS_SIGN
from synth.bodies.skeleton import DOF_IDX, LOWER, PARENT_LINK, UPPER, Skeleton


class Chain(NamedTuple):
    """Hinges of one limb from the trunk outwards.

    Attributes:
        dof: (n,) hinge indices, each on the link that the one before moves.
        swing: Position in `dof` of the flexion hinge of the ball joint at the limb's root; abduction follows it.
        bend: Position in `dof` of the elbow or knee.
    """

    dof: NDArray[np.int64]
    swing: int
    bend: int


_ARM = (
    "clavicle_elevation", "clavicle_protraction", "shoulder_flexion", "shoulder_abduction", "shoulder_rotation",
    "elbow_flexion", "forearm_pronation", "wrist_flexion", "wrist_deviation",
)  # fmt: skip
_LEG = ("hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "ankle_flexion", "ankle_inversion")


def _chain(side: str, names: tuple[str, ...], swing: int, bend: int) -> Chain:
    return Chain(np.array([DOF_IDX[f"{side}_{name}"] for name in names], dtype=np.int64), swing, bend)


CHAINS: dict[str, Chain] = {
    "l_arm": _chain("l", _ARM, 2, 5),
    "r_arm": _chain("r", _ARM, 2, 5),
    "l_leg": _chain("l", _LEG, 0, 3),
    "r_leg": _chain("r", _LEG, 0, 3),
}
"""The limbs that can be solved."""


@dataclass(frozen=True)
class Goal:
    """What a point fixed to a link, or an axis of it, should become.

    Attributes:
        link: Name of the hinge that moves the link, without side, such as "wrist_deviation".
        local: (3,) point [m] or unit axis in the link's frame.
        target: (3,) world point [m] or unit direction.
        weight: One number, or one a world axis; 0 leaves that coordinate free. A direction is as strong as a
            point when its weight is about 0.1 (0.1 m a radian).
        is_point: A point if true, else a direction.
    """

    link: str
    local: ArrayLike
    target: ArrayLike
    weight: float | tuple[float, float, float] = 1.0
    is_point: bool = True


@dataclass(frozen=True)
class Solution:
    """Outcome of one solve.

    Attributes:
        angles: (n_dofs,) all hinges; only the chain's differ from the given ones.
        point_error: Largest weighted distance of a point goal [m].
        axis_error: Largest angle of a direction goal whose coordinates all count [rad].
    """

    angles: NDArray[np.float64]
    point_error: float
    axis_error: float


def solve_limb(
    skeleton: Skeleton,
    limb: str,
    T_world_link: NDArray[np.float64],
    angles: NDArray[np.float64],
    goals: list[Goal],
    rest_weight: float | NDArray[np.float64] = 0.01,
) -> Solution:
    """Moves one limb to its goals, as near to the given angles as the goals allow.

    Args:
        skeleton: The person's hinges.
        limb: Name in `CHAINS`.
        T_world_link: (n_links, 4, 4) from `link_transforms`; only the link that carries the limb is read.
        angles: (n_dofs,) all hinges; the limb's own are the rest pose [rad].
        goals: At least one; the closed-form start uses the first if it is a point.
        rest_weight: Pull towards the rest pose [m/rad], one number or one a hinge of the chain.
    """
    if limb not in CHAINS:
        raise ValueError(f"limb {limb!r} is unknown; known are {', '.join(CHAINS)}")
    chain = CHAINS[limb]
    rest = np.clip(angles[chain.dof], LOWER[chain.dof], UPPER[chain.dof])
    theta, point_error, axis_error = solve_chain(
        chain.dof,
        chain.swing,
        chain.bend,
        skeleton.offsets,
        AXIS_IDX,
        AXIS_SIGN,
        LOWER[chain.dof],
        UPPER[chain.dof],
        _goal_arrays(limb, chain, goals),
        rest,
        np.full(len(rest), rest_weight) if np.isscalar(rest_weight) else np.asarray(rest_weight, np.float64),
        np.ascontiguousarray(T_world_link[PARENT_LINK[chain.dof[0]]]),
    )
    out = angles.copy()
    out[chain.dof] = theta
    return Solution(out, float(point_error), float(axis_error))


def _goal_arrays(limb: str, chain: Chain, goals: list[Goal]) -> GoalArrays:
    n = len(goals)
    out = GoalArrays(np.empty(n, np.int64), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty(n))
    place = _PLACES[limb]
    for m, goal in enumerate(goals):
        if goal.link not in place:
            raise ValueError(f"link {goal.link!r} is not on {limb}; known are {', '.join(place)}")
        out.position[m] = place[goal.link]
        out.local[m] = goal.local
        out.target[m] = goal.target
        out.weight[m] = goal.weight
        out.is_point[m] = goal.is_point
    return out


_PLACES: dict[str, dict[str, int]] = {
    limb: {name: i for i, name in enumerate(_ARM if limb.endswith("arm") else _LEG)} for limb in CHAINS
}
