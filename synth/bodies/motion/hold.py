"""Hands that hold something while the body and the thing move."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body
from synth.bodies.motion.record import Motion
from synth.bodies.rig.ik import CHAINS, Goal, solve_limb
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import LINK_IDX
from synth.vocabulary import CONTACT_NAMES

HAND_LINK = "wrist_deviation"
"""The link of a hand, without side."""
TURNED = 0.06
"""Strength of the hand's axes beside its place [m/rad]."""
REST = 0.004
"""Pull to the angles with which the thing was taken [m/rad]."""


def hand_in(body: Body, angles: NDArray[np.float64], T_world_root: NDArray[np.float64], side: str) -> NDArray:
    """(4, 4) T_world_hand of a pose."""
    return np.asarray(link_transforms(body.skeleton, angles, T_world_root)[LINK_IDX[f"{side}_{HAND_LINK}"]])


def held(
    motion: Motion,
    body: Body,
    angles: NDArray[np.float64],
    T_world_item: NDArray[np.float64],
    T_item_hand: Mapping[str, NDArray[np.float64]],
) -> tuple[Motion, float]:
    """A motion whose hands stay where they are on a thing.

    Args:
        motion: What the body does.
        body: Who.
        angles: (n_dofs,) a pose with the hands on the thing; arms stay near it [rad].
        T_world_item: (n, 4, 4) where the thing is.
        T_item_hand: (4, 4) of each hand that holds it, by side.

    Returns:
        The motion, with contacts of these hands; and how far a hand is from its place at most [m].
    """
    out, missed = motion.angles.copy(), 0.0
    for side in T_item_hand:
        out[:, CHAINS[f"{side}_arm"].dof] = angles[CHAINS[f"{side}_arm"].dof]
    for k in range(len(motion)):
        links = link_transforms(body.skeleton, out[k], motion.T_world_root[k])
        for side, T_hand in T_item_hand.items():
            T = T_world_item[k] @ T_hand
            goals = [
                Goal(HAND_LINK, (0.0, 0.0, 0.0), T[:3, 3]),
                Goal(HAND_LINK, (1.0, 0.0, 0.0), T[:3, 0], TURNED, is_point=False),
                Goal(HAND_LINK, (0.0, 0.0, 1.0), T[:3, 2], TURNED, is_point=False),
            ]
            solved = solve_limb(body.skeleton, f"{side}_arm", links, out[k], goals, REST)
            out[k] = solved.angles
            missed = max(missed, solved.point_error)
    contacts = motion.contacts.copy()
    for side in T_item_hand:
        contacts[:, CONTACT_NAMES.index(f"{side}_hand")] = True
    return replace(motion, angles=out, contacts=contacts), missed
