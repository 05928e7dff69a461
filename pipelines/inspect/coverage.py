"""What a corpus covers: views by bearing and distance, bends of limbs, and the share of recorded life near it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus import Corpus
from pipelines.corpus.rooms.people import by_person
from synth.bodies.life.coverage import nearest_distances, places_of
from synth.bodies.life.model import POSTURES, life_model
from synth.bodies.skeleton import DOFS
from synth.vocabulary import JOINT_NAMES, JointState

BEARINGS: NDArray[np.float64] = np.arange(-180.0, 181.0, 30.0)
"""Edges of the camera's bearing [deg]."""
DISTANCES: NDArray[np.float64] = np.arange(0.0, 6.01, 0.5)
"""Edges of the camera's distance [m]."""
BEND_EDGES: NDArray[np.float64] = np.arange(0.0, 181.0, 10.0)
"""Edges of angles between limbs [deg]."""
N_ASKED = 500
"""Poses of each posture drawn from the model of recorded life."""
WITHIN = 0.08
"""A pose is covered if one of the corpus is within this mean joint distance [m]."""
_LIMBS = {
    "Hips: thigh against trunk": ("neck", "hip", "knee"),
    "Knees: shank against thigh": ("hip", "knee", "foot"),
    "Shoulders: upper arm against trunk": ("hip", "shoulder", "elbow"),
    "Elbows: forearm against upper arm": ("shoulder", "elbow", "hand"),
}
"""Joints whose middle one bends, by what is said of it."""
_BENT_FROM_STRAIGHT = ("Hips", "Knees", "Elbows")


@dataclass(frozen=True)
class Grid:
    """Frames by bearing and distance.

    Attributes:
        bearings: n + 1 edges of the camera's bearing seen from the person [deg].
        distances: m + 1 edges of the distance from camera to torso [m].
        counts: m rows of n counts; values outside the edges fall into the outer cells.
    """

    bearings: list[float]
    distances: list[float]
    counts: list[list[int]]


def views_grid(bearings: NDArray[np.floating], distances: NDArray[np.floating]) -> Grid:
    """Counts frames by bearing [deg] and distance [m], each (n,)."""
    counts = np.histogram2d(
        np.clip(distances, DISTANCES[0], DISTANCES[-1]),
        np.clip(bearings, BEARINGS[0], BEARINGS[-1]),
        bins=(DISTANCES, BEARINGS),
    )[0]
    return Grid(BEARINGS.tolist(), DISTANCES.tolist(), counts.astype(int).tolist())


def bends_of(joints: NDArray[np.floating], states: NDArray[np.integer]) -> dict[str, NDArray[np.float64]]:
    """How far limbs are bent, of both sides together.

    Args:
        joints: (n, 15, 3) in any frame [m].
        states: (n, 15) of each joint; unknown ones are left out.

    Returns:
        (m,) degrees by name: 0 is straight, of shoulders an arm along the trunk.
    """
    out = {}
    for title, names in _LIMBS.items():
        angles = []
        for side in "lr":
            a, b, c = (JOINT_NAMES.index(n if n == "neck" else f"{side}_{n}") for n in names)
            is_known = (states[:, [a, b, c]] != JointState.UNKNOWN).all(axis=1)
            to_a, to_c = (
                joints[is_known][:, a] - joints[is_known][:, b],
                joints[is_known][:, c] - joints[is_known][:, b],
            )
            norm = np.maximum(np.linalg.norm(to_a, axis=1) * np.linalg.norm(to_c, axis=1), 1e-12)
            angle = np.degrees(np.arccos(np.clip((to_a * to_c).sum(axis=1) / norm, -1.0, 1.0)))
            angles.append(180.0 - angle if title.startswith(_BENT_FROM_STRAIGHT) else angle)
        out[title] = np.concatenate(angles).astype(np.float64)
    return out


def life_covered(corpus: Corpus) -> dict[str, float]:
    """Share of poses out of the model of recorded life that have a pose of the corpus near them, by posture.

    Scale and heading are removed. Empty if the corpus does not tell the joint angles of our skeleton.
    """
    if [name for name, *_ in corpus.header.labels["angles"]] != [dof.name for dof in DOFS]:
        return {}
    known = places_of(by_person(corpus, "angles"), by_person(corpus, "T_world_root")[:, :3, :3])
    rng = np.random.default_rng(0)
    out: dict[str, float] = {}
    for posture in POSTURES:
        drawn = [life_model().draw(posture, rng, 1.0) for _ in range(N_ASKED)]
        asked = places_of(np.array([one.angles for one in drawn]), np.array([one.R_world_root for one in drawn]))
        out[posture] = float((nearest_distances(asked, known) <= WITHIN).mean())
    return out
