"""Self-collision: does a limb go into the trunk, the head or another limb?

Each segment of a body is fitted once by its radius over height and direction about the bone (a profile). Skin
points of the limbs are then tested against the profiles of the segments they must stay out of.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.body import Body, Pose, kept_with_body
from synth.bodies.rig.collision_profiles import (
    N_DIRECTIONS,
    N_HEIGHTS,
    Profiles,
    fill_profile,
    spread_points,
    worst_depth,
)
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.rig.skinning import pose_skin
from synth.bodies.skeleton import LINK_IDX, N_LINKS

N_POINTS = 70
"""Skin points sampled a limb segment."""
MIN_SHARE = 0.3
"""A vertex belongs to a profile when the segment's links hold at least this share of its weight."""

HARD = 0.021
"""Depths allowed up to this are for firm pairs; larger ones grow with the body's girth [m]."""
USUAL_GIRTH = 0.125
"""Mean radius of the thorax for which the depths allowed in flesh are meant [m]."""

_SIDED = {
    "upper_arm": ("shoulder_rotation", ("shoulder_abduction", "shoulder_rotation")),
    "forearm": ("elbow_flexion", ("elbow_flexion", "forearm_pronation")),
    "hand": ("wrist_deviation", ("wrist_deviation",)),
    "fingers": ("fingers_flexion", ("fingers_flexion",)),
    "thigh": ("hip_rotation", ("hip_abduction", "hip_rotation")),
    "shank": ("knee_flexion", ("knee_flexion",)),
    "foot": ("ankle_inversion", ("ankle_inversion", "toes_extension")),
}
_TRUNK = {
    "pelvis": ("root", ("root",)),
    "abdomen": ("lumbar_rotation", ("lumbar_rotation",)),
    "thorax": ("thorax_rotation", ("thorax_rotation",)),
    "neck": ("neck_rotation", ("neck_rotation",)),
    "head": ("head_rotation", ("head_rotation",)),
}
SEGMENTS: dict[str, tuple[str, tuple[str, ...]]] = _TRUNK | {
    f"{side}_{name}": (f"{side}_{frame}", tuple(f"{side}_{link}" for link in links))
    for side in "lr"
    for name, (frame, links) in _SIDED.items()
}
"""Segment name to the hinge whose link is its frame and the hinges whose links' skin it is made of."""
SEGMENT_IDX: dict[str, int] = {name: i for i, name in enumerate(SEGMENTS)}

_ALL_TRUNK = dict.fromkeys(_TRUNK, 0.012)
# Points of a segment on one side -> (segments they are tested against -> depth allowed [m]). "o_" is the other
# side, "s_" the same. Flesh on flesh gives way, hands against trunk do not.
_RULES: dict[str, dict[str, float]] = {
    "upper_arm": {"abdomen": 0.03, "thorax": 0.04, "pelvis": 0.03, "o_upper_arm": 0.02},
    "forearm": _ALL_TRUNK
    | {"s_thigh": 0.015, "o_thigh": 0.015, "o_upper_arm": 0.015, "o_forearm": 0.015, "o_hand": 0.012}
    | {"o_fingers": 0.012},
    "hand": _ALL_TRUNK
    | {"s_thigh": 0.015, "o_thigh": 0.015, "s_shank": 0.012, "o_shank": 0.012, "o_upper_arm": 0.02}
    | {"o_forearm": 0.02, "o_hand": 0.012, "o_fingers": 0.012},
    "thigh": {"o_thigh": 0.05},
    "shank": {"o_thigh": 0.035, "o_shank": 0.025, "o_foot": 0.015},
    "foot": {"o_thigh": 0.03, "o_shank": 0.015, "o_foot": 0.012},
}
_LIMBS = {"arm": ("upper_arm", "forearm", "hand"), "leg": ("thigh", "shank", "foot")}
# Links whose skin the points of a segment are drawn from.
_POINT_LINKS = {name: links for name, (_, links) in _SIDED.items()} | {
    "hand": ("wrist_deviation", "fingers_flexion", "fingertips_flexion", "thumb_flexion")
}
# Share of the segment next to the trunk whose points are left out: it touches by nature.
_SKIPPED = {"upper_arm": 0.45, "thigh": 0.5}


@dataclass(frozen=True)
class BodyFit:
    """What is fitted to a body once.

    Attributes:
        profiles: Radius tables by `SEGMENT_IDX`.
        points: (n_points,) indices of skin vertices that are tested.
        allowed: (n_points, n_segments) depth allowed [m]; negative where a pair is not tested.
        limb_rows: Limb name to its range of points.
    """

    profiles: Profiles
    points: NDArray[np.int64]
    allowed: NDArray[np.float64]
    limb_rows: dict[str, slice]


def link_shares(body: Body) -> NDArray[np.float32]:
    """(n_vertices, n_links) skin weights as a full table."""
    weights = body.weights
    table = np.zeros((len(body.mesh.vertices), N_LINKS), dtype=np.float32)
    _fill_shares(weights.indptr, weights.link, weights.weight, table)
    return table


@njit(cache=True, nogil=True)
def _fill_shares(
    indptr: NDArray[np.int32], link: NDArray[np.int32], weight: NDArray[np.float32], table: NDArray[np.float32]
) -> None:
    """Adds weights in CSR order to a table (n_vertices, n_links) of zeros."""
    for v in range(table.shape[0]):
        for e in range(indptr[v], indptr[v + 1]):
            table[v, link[e]] += weight[e]


@kept_with_body
def dominant_links(body: Body) -> NDArray[np.int64]:
    """(n_vertices,) the link that moves each vertex most, the first of equals; found at the first call."""
    weights = body.weights
    return _largest(weights.indptr, weights.link, weights.weight, N_LINKS)


@njit(cache=True, nogil=True)
def _largest(
    indptr: NDArray[np.int32], link: NDArray[np.int32], weight: NDArray[np.float32], n_links: int
) -> NDArray[np.int64]:
    """(n,) link of the greatest sum of weights in each CSR row, the first of equals."""
    out = np.zeros(indptr.shape[0] - 1, dtype=np.int64)
    total = np.zeros(n_links, dtype=np.float32)
    for v in range(out.shape[0]):
        for e in range(indptr[v], indptr[v + 1]):
            total[link[e]] += weight[e]
        best = n_links
        for e in range(indptr[v], indptr[v + 1]):
            k = link[e]
            if best == n_links or total[k] > total[best] or (total[k] == total[best] and k < best):
                best = k
        out[v] = best
        for e in range(indptr[v], indptr[v + 1]):
            total[link[e]] = np.float32(0.0)
    return out


@kept_with_body
def _vertices_by_link(body: Body) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(n_vertices,) vertices by the link that moves them most, and (n_links + 1,) where each link's begin."""
    dominant = dominant_links(body)
    order = np.argsort(dominant, kind="stable")
    return order, np.searchsorted(dominant[order], np.arange(N_LINKS + 1))


def moved_by(body: Body, links: Iterable[str]) -> NDArray[np.int64]:
    """(m,) vertices that some links, by name, move most, in rising order."""
    order, start = _vertices_by_link(body)
    rows = [LINK_IDX[link] for link in links]
    return np.sort(np.concatenate([order[start[row] : start[row + 1]] for row in rows]))


@kept_with_body
def fit_of(body: Body) -> BodyFit:
    """The body's fit, made at the first call and kept as long as the body lives."""
    shares = link_shares(body)
    T_bind = link_transforms(body.skeleton, body.bind_angles, np.eye(4))
    vertices = body.mesh.vertices.astype(np.float64)
    n = len(SEGMENTS)
    profiles = Profiles(
        np.array([LINK_IDX[frame] for frame, _ in SEGMENTS.values()], dtype=np.int64),
        np.zeros(n),
        np.zeros(n),
        np.zeros((n, N_HEIGHTS, 2)),
        np.zeros((n, N_HEIGHTS, N_DIRECTIONS)),
        np.zeros(n),
    )
    for i, (frame, links) in enumerate(SEGMENTS.values()):
        own = vertices[_held_by(shares, np.array([LINK_IDX[link] for link in links]), MIN_SHARE)]
        T = T_bind[LINK_IDX[frame]]
        if len(own) >= 8:
            fill_profile(profiles, i, (own - T[:3, 3]) @ T[:3, :3])
    girth = float(profiles.radius[SEGMENT_IDX["thorax"]].mean())
    flesh = min(max(girth / USUAL_GIRTH, 0.6), 2.0)
    cloth = {"arm": body.spec.top_ease, "leg": body.spec.bottom_ease}
    return BodyFit(profiles, *_test_points(body, vertices, T_bind, flesh, cloth))


@njit(cache=True, nogil=True)
def _held_by(shares: NDArray[np.float32], links: NDArray[np.int64], least: float) -> NDArray[np.int64]:
    """(m,) vertices of which some links together hold at least a share; shares is (n_vertices, n_links)."""
    out = np.empty(shares.shape[0], dtype=np.int64)
    n = 0
    for v in range(shares.shape[0]):
        total = shares[v, links[0]]
        for k in range(1, links.shape[0]):
            total += shares[v, links[k]]
        if total >= np.float32(least):
            out[n] = v
            n += 1
    return out[:n]


def _test_points(
    body: Body,
    vertices: NDArray[np.float64],
    T_bind: NDArray[np.float64],
    flesh: float,
    cloth: dict[str, float],
) -> tuple[NDArray[np.int64], NDArray[np.float64], dict[str, slice]]:
    """Points of all limbs, what each may do, and the range of rows of each limb."""
    points: list[NDArray[np.int64]] = []
    allowed: list[NDArray[np.float64]] = []
    limb_rows: dict[str, slice] = {}
    for limb, names in _LIMBS.items():
        for side in "lr":
            start = sum(len(own) for own in points)
            for name in names:
                own = moved_by(body, (f"{side}_{link}" for link in _POINT_LINKS[name]))
                if name in _SKIPPED and len(own):
                    T = T_bind[LINK_IDX[f"{side}_{_SIDED[name][0]}"]]
                    z = ((vertices[own] - T[:3, 3]) @ T[:3, :3])[:, 2]
                    own = own[z < z.max() - _SKIPPED[name] * (z.max() - z.min())]
                own = own[spread_points(vertices[own], N_POINTS)]
                points.append(own)
                allowed.append(np.tile(_allowances(name, side, flesh, cloth[limb]), (len(own), 1)))
            limb_rows[f"{side}_{limb}"] = slice(start, sum(len(own) for own in points))
    return np.concatenate(points).astype(np.int64), np.concatenate(allowed), limb_rows


def _allowances(name: str, side: str, flesh: float, cloth: float) -> NDArray[np.float64]:
    """(n_segments,) depth allowed in each other segment [m], -1 where a pair is not tested; cloth gives way."""
    row = np.full(len(SEGMENTS), -1.0)
    prefix = {"s_": f"{side}_", "o_": "r_" if side == "l" else "l_"}
    for rule, depth in _RULES[name].items():
        segment = prefix.get(rule[:2], rule[:2]) + rule[2:]
        row[SEGMENT_IDX[segment]] = cloth + (depth * flesh if depth > HARD else depth)
    return row


def excess_depth(body: Body, pose: Pose) -> float:
    """Depth of the worst self-collision beyond what is allowed for its pair of segments [m]; negative if none.

    Args:
        body: The person.
        pose: Angles and root.
    """
    fit = fit_of(body)
    T_world_link, skin = pose_skin(body, pose.angles, pose.T_world_root, fit.points)
    return float(worst_depth(fit.profiles, T_world_link, skin, fit.allowed)[0])


def excess_of_limb(body: Body, angles: NDArray[np.float64], T_world_root: NDArray[np.float64], limb: str) -> float:
    """`excess_depth` of the skin of one limb alone: "l_arm", "r_arm", "l_leg" or "r_leg"."""
    fit = fit_of(body)
    own = fit.limb_rows[limb]
    T_world_link, skin = pose_skin(body, angles, T_world_root, fit.points[own])
    return float(worst_depth(fit.profiles, T_world_link, skin, fit.allowed[own])[0])


def worst_collision(body: Body, pose: Pose) -> tuple[str, float]:
    """Name of the segment entered the deepest beyond what is allowed, and that excess [m]."""
    fit = fit_of(body)
    T_world_link, skin = pose_skin(body, pose.angles, pose.T_world_root, fit.points)
    excess, point, segment = worst_depth(fit.profiles, T_world_link, skin, fit.allowed)
    owner = tuple(LINK_IDX)[dominant_links(body)[fit.points[point]]]
    return f"{owner} in {tuple(SEGMENTS)[segment]}", float(excess)


def self_collides(body: Body, pose: Pose) -> bool:
    """Whether a limb lies in the trunk, the head or another limb deeper than flesh gives way.

    Args:
        body: The person.
        pose: Angles and root.
    """
    return excess_depth(body, pose) > 0.0
