"""Crossed legs of a seated person."""

import numpy as np

from synth.bodies.poses.draft import Draft
from synth.bodies.poses.landmarks import mean_radius
from synth.bodies.poses.stand import OTHER, SIGN
from synth.bodies.rig.ik import Goal
from synth.bodies.skeleton import LINK_IDX


def cross_legs(draft: Draft, rng: np.random.Generator) -> str | None:
    """Crosses the legs in one of two ways, tried a few times; thighs too thick for it stay side by side.

    Returns:
        Side of the upper leg, or None.
    """
    uncrossed = draft.angles.copy()
    for _ in range(10):
        lead = "l" if rng.random() < 0.5 else "r"
        draft.angles = uncrossed.copy()
        cross = _cross_knees if rng.random() < 0.55 else _cross_ankle_on_knee
        cross(draft, lead, rng)
        draft.set(f"{lead}_", toes_extension=0)
        if max(draft.excess_of(side, "leg") for side in "lr") <= 0.0:
            return lead
    draft.angles = uncrossed
    return None


def _cross_knees(draft: Draft, lead: str, rng: np.random.Generator) -> None:
    """Lays one thigh over the other knee; its shank hangs beside the other shank."""
    other = OTHER[lead]
    draft.set(f"{other}_", hip_abduction=float(rng.uniform(-10, 3)))
    carrying = draft.point(f"{other}_knee_flexion")
    lift = mean_radius(draft.body, f"{lead}_thigh", 0.3) + mean_radius(draft.body, f"{other}_thigh", 0.15)
    lift *= float(rng.uniform(1.05, 1.4))
    ahead, inward = float(rng.uniform(0.03, 0.12)), float(rng.uniform(0.01, 0.05))
    knee = carrying + np.array([ahead, SIGN[lead] * inward, lift])
    T = draft.links()[LINK_IDX[f"{other}_knee_flexion"]]
    shank = -T[:3, 2] + np.array(
        [float(rng.uniform(0.7, 1.3)), SIGN[other] * float(rng.uniform(-0.15, 0.12)), 0.0]
    )
    goals = [
        Goal("knee_flexion", (0, 0, 0), knee, 1.0),
        Goal("knee_flexion", (0, 0, -1), shank / np.linalg.norm(shank), 0.15, is_point=False),
    ]
    draft.set(f"{lead}_", hip_flexion=105, hip_abduction=-10, hip_rotation=0, knee_flexion=80)
    draft.solve(f"{lead}_leg", goals, 0.01)
    draft.set(f"{lead}_", ankle_flexion=float(rng.uniform(-35, -8)), ankle_inversion=float(rng.uniform(0, 12)))


def _cross_ankle_on_knee(draft: Draft, lead: str, rng: np.random.Generator) -> None:
    """Lays one ankle on the other thigh just above the knee, the knee falling outwards."""
    other = OTHER[lead]
    marks = draft.marks
    T = draft.links()[LINK_IDX[f"{other}_hip_rotation"]]
    lift = (
        mean_radius(draft.body, f"{other}_thigh", 0.25)
        + mean_radius(draft.body, f"{lead}_shank", 0.15)
        + float(rng.uniform(0.01, 0.04))
    )
    below = -marks.thigh * float(rng.uniform(0.78, 0.88))
    target = T[:3, :3] @ np.array([lift, 0.0, below]) + T[:3, 3]
    shank = np.array([float(rng.uniform(0.0, 0.3)), SIGN[other], float(rng.uniform(-0.15, 0.1))])
    goals = [
        Goal("knee_flexion", (0, 0, -0.82 * marks.shank), target, 1.0),
        Goal("knee_flexion", (0, 0, -1), shank / np.linalg.norm(shank), 0.06, is_point=False),
    ]
    draft.set(f"{lead}_", hip_flexion=95, hip_abduction=35, hip_rotation=-45, knee_flexion=100)
    draft.solve(f"{lead}_leg", goals, 0.01)
    draft.set(f"{lead}_", ankle_flexion=float(rng.uniform(-10, 10)), ankle_inversion=float(rng.uniform(0, 15)))
