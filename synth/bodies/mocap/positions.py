"""Directions of limbs and turns of the trunk where no rest pose says what a joint's turn means.

Limbs point from joint to joint. Pelvis, thorax, head and feet turn as their joints do; how they lie in their
joints' axes is the average of the frames that show it.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.bvh import Bvh, MocapError
from synth.bodies.mocap.rest import SIDES

UPRIGHT = np.radians(20.0)
"""Spine and legs of who stands upright are this near to the vertical."""
PLANTED = 0.02
"""A foot whose ankle is less than this above its usual lowest height is flat on the floor [m]."""
SHORTEST_HAND = 0.03
"""A joint nearer than this to the wrist does not tell where the hand points [m]."""
_UP = np.array([0.0, 0.0, 1.0])
_LIMBS = (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))


class Directions(NamedTuple):
    """What a motion tells of the body; as in `Source`.

    Attributes:
        pelvis: (n, 3, 3).
        thorax: (n, 3, 3).
        head: (n, 3, 3).
        limb: (n, 2, 4, 3).
        clavicle: (n, 2, 3).
        clavicle_rest: (2, 3).
        fingers: (n, 2, 3).
        palm: (n, 2, 3).
        toes: (n, 2, 3).
        sole: (n, 2, 3).
    """

    pelvis: NDArray[np.float64]
    thorax: NDArray[np.float64]
    head: NDArray[np.float64]
    limb: NDArray[np.float64]
    clavicle: NDArray[np.float64]
    clavicle_rest: NDArray[np.float64]
    fingers: NDArray[np.float64]
    palm: NDArray[np.float64]
    toes: NDArray[np.float64]
    sole: NDArray[np.float64]


def directions_of(
    position: NDArray[np.float64],
    rotation: NDArray[np.float64],
    hands: NDArray[np.float64],
    place: dict[str, int],
) -> Directions:
    """Measures a motion.

    Args:
        position: (n, n_roles, 3) world, z up [m].
        rotation: (n, n_roles, 3, 3) world; joints' own axes may point anywhere.
        hands: (n, 2, 3) from the wrists to the fingers [m]; 0 where the file has none.
        place: Column by role.

    Raises:
        MocapError: Joints coincide.
    """

    def way(start: str, end: str) -> NDArray[np.float64]:
        return position[:, place[end]] - position[:, place[start]]

    ups, upright = _upright_frames(position, place)
    pelvis = _turned(rotation[:, place["hips"]], _unit(way("r_hip", "l_hip")), ups, upright)
    thorax = _turned(rotation[:, place["thorax"]], _unit(way("r_shoulder", "l_shoulder")), ups, upright)
    head = _turned(rotation[:, place["head"]], thorax[:, :, 1], ups, upright)
    limb, clavicle, fingers, toes, sole = [], [], [], [], []
    for k, s in enumerate(SIDES):
        limb.append(np.stack([_unit(way(f"{s}_{start}", f"{s}_{end}")) for start, end in _LIMBS], axis=1))
        clavicle.append(np.einsum("nba,nb->na", thorax, way(f"{s}_clavicle", f"{s}_shoulder")))
        has_hand = np.linalg.norm(hands[:, k], axis=1) > SHORTEST_HAND
        fingers.append(_unit(np.where(has_hand[:, None], hands[:, k], limb[k][:, 1])))
        ankle = rotation[:, place[f"{s}_ankle"]]
        foot = _turned_foot(ankle, way(f"{s}_ankle", f"{s}_toe"), position[:, place[f"{s}_ankle"], 2])
        toes.append(foot[:, :, 0])
        sole.append(foot[:, :, 2])
    return Directions(
        pelvis=pelvis,
        thorax=thorax,
        head=head,
        limb=np.stack(limb, axis=1),
        clavicle=np.stack(clavicle, axis=1),
        clavicle_rest=np.median(np.stack(clavicle), axis=1),
        fingers=np.stack(fingers, axis=1),
        palm=np.zeros((len(position), 2, 3)),
        toes=np.stack(toes, axis=1),
        sole=np.stack(sole, axis=1),
    )


def hand_ways(bvh: Bvh, joints: dict[str, int], position: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2, 3) from the wrists to the mean of the nearest joints of the fingers; 0 if there are none.

    Args:
        bvh: The file.
        joints: Index of the joint of each role.
        position: (n, n_joints, 3) [m].
    """
    out = np.zeros((len(position), 2, 3))
    for k, s in enumerate(SIDES):
        ways = position - position[:, joints[f"{s}_wrist"], None]
        is_far = np.linalg.norm(ways, axis=2).mean(axis=0) > SHORTEST_HAND
        knuckles = list(_knuckles(bvh, joints[f"{s}_wrist"], is_far))
        if knuckles:
            out[:, k] = ways[:, knuckles].mean(axis=1)
    return out


def _knuckles(bvh: Bvh, joint: int, is_far: NDArray[np.bool_]) -> Iterator[int]:
    """The first joints below one that are far enough from it, without thumbs."""
    for child, other in enumerate(bvh.joints):
        if other.parent != joint or "thumb" in other.name.lower():
            continue
        if is_far[child]:
            yield child
        else:
            yield from _knuckles(bvh, child, is_far)


def _upright_frames(
    position: NDArray[np.float64], place: dict[str, int]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(n, 3) where the trunk's up is, and (n,) in which frames that can be told.

    Those who stand upright; without any, those whose trunk is; without any, all, with the spine for up.
    """

    def middle(role: str) -> NDArray[np.float64]:
        return 0.5 * (position[:, place[f"l_{role}"]] + position[:, place[f"r_{role}"]])

    spine = _unit(position[:, place["neck"]] - middle("hip"))
    legs = _unit(middle("hip") - middle("ankle"))
    is_tall = spine[:, 2] > np.cos(UPRIGHT)
    stands = is_tall & (legs[:, 2] > np.cos(UPRIGHT))
    if is_tall.any():
        return np.broadcast_to(_UP, spine.shape), stands if stands.any() else is_tall
    return spine, np.ones(len(spine), np.bool_)


def _turned(
    rotation: NDArray[np.float64],
    left: NDArray[np.float64],
    up: NDArray[np.float64],
    shows_up: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """(n, 3, 3) turns of a part: forward, left and up are fixed to its joint where they are on average."""
    own_left = _unit(np.einsum("nba,nb->na", rotation, left).mean(axis=0))
    own_up = np.einsum("nba,nb->na", rotation[shows_up], up[shows_up]).mean(axis=0)
    own_up = _unit(own_up - (own_up @ own_left) * own_left)
    return rotation @ np.stack([np.cross(own_left, own_up), own_left, own_up], axis=1)


def _turned_foot(
    rotation: NDArray[np.float64], forward: NDArray[np.float64], height: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n, 3, 3) turns of a foot, whose sole is level on average where its ankle is low."""
    is_planted = height < np.percentile(height, 10.0) + PLANTED
    own_up = _unit(rotation[is_planted][:, 2].mean(axis=0))
    own_forward = np.einsum("nba,nb->na", rotation, forward).mean(axis=0)
    own_forward = _unit(own_forward - (own_forward @ own_up) * own_up)
    return rotation @ np.stack([own_forward, np.cross(own_up, own_forward), own_up], axis=1)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    if not (length > 1e-6).all():
        raise MocapError("has joints that coincide, so that limbs or the trunk have no direction")
    return vectors / length
