"""Directions of limbs and turns of the trunk where no rest pose says what a joint's turn means.

Limbs point from joint to joint. Pelvis, thorax, head and feet turn as their joints do; how they lie in their
joints' axes is told by the pose without turns if its trunk is straight, else by lines between joints.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.bvh import Bvh
from synth.bodies.mocap.rest import LIMBS, SIDES
from synth.bodies.mocap.text import MocapError

UPRIGHT = np.radians(20.0)
"""Trunk and legs of who stands upright are this near to the vertical."""
PLANTED = 0.02
"""A foot whose ankle is less than this above its usual lowest height is flat on the floor [m]."""
SHORTEST = 0.03
"""Joints nearer than this to each other do not tell where a hand, the spine or the head points [m]."""
_NO_FINGER = ("thumb", "pollex")
_NO_CROWN = ("eye", "jaw", "chin", "nose")


class Ways(NamedTuple):
    """Ways beyond the joints that have roles, world [m]; 0 where the file has none.

    Attributes:
        hands: (n, 2, 3) from the wrists to the fingers.
        crown: (n, 3) from the head's joint up.
    """

    hands: NDArray[np.float64]
    crown: NDArray[np.float64]


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
    ways: Ways,
    drawn: NDArray[np.float64] | None,
    place: dict[str, int],
) -> Directions:
    """Measures a motion.

    Args:
        position: (n, n_roles, 3) world, z up [m].
        rotation: (n, n_roles, 3, 3) world; joints' own axes may point anywhere.
        ways: What joints without a role tell.
        drawn: (3, 3) rows: forward, left and up of the trunk in the pose without turns, if it is straight there.
        place: Column by role.

    Raises:
        MocapError: Joints coincide.
    """

    def way(start: str, end: str) -> NDArray[np.float64]:
        return position[:, place[end]] - position[:, place[start]]

    pelvis, thorax, head = (
        _trunk_turns(position, rotation, ways.crown, place)
        if drawn is None
        else [rotation[:, place[role]] @ drawn.T for role in ("hips", "thorax", "head")]
    )
    limb, clavicle, fingers, toes, sole = [], [], [], [], []
    for k, s in enumerate(SIDES):
        limb.append(limb_ways(position, place, s))
        clavicle.append(np.einsum("nba,nb->na", thorax, way(f"{s}_clavicle", f"{s}_shoulder")))
        fingers.append(_unit(_first_long(ways.hands[:, k], limb[k][:, 1])))
        ankle = rotation[:, place[f"{s}_ankle"]]
        height = position[:, place[f"{s}_ankle"], 2]
        foot = _turned_foot(ankle, way(f"{s}_ankle", f"{s}_toe"), height, pelvis[:, :, 0])
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


def limb_ways(position: NDArray[np.float64], place: dict[str, int], side: str) -> NDArray[np.float64]:
    """(n, 4, 3) directions from joint to joint along upper arm, forearm, thigh and shank.

    Args:
        position: (n, n_roles, 3).
        place: Column by role.
        side: "l" or "r".

    Raises:
        MocapError: Joints coincide.
    """
    ends = [(place[f"{side}_{start}"], place[f"{side}_{end}"]) for start, end in LIMBS]
    return np.stack([_unit(position[:, end] - position[:, start]) for start, end in ends], axis=1)


def ways_of(bvh: Bvh, joints: dict[str, int], position: NDArray[np.float64]) -> Ways:
    """Finds fingers and crown among a file's joints.

    Args:
        bvh: The file.
        joints: Index of the joint of each role.
        position: (n, n_joints, 3) world [m].
    """

    def beyond(start: int, without: tuple[str, ...]) -> NDArray[np.float64]:
        ways = position - position[:, start, None]
        is_far = np.linalg.norm(ways, axis=2).mean(axis=0) > SHORTEST
        ends = list(_joints_beyond(bvh, start, is_far, without))
        return ways[:, ends].mean(axis=1) if ends else np.zeros((len(position), 3))

    hands = np.stack([beyond(joints[f"{s}_wrist"], _NO_FINGER) for s in SIDES], axis=1)
    return Ways(hands, beyond(joints["head"], _NO_CROWN))


def _joints_beyond(bvh: Bvh, joint: int, is_far: NDArray[np.bool_], without: tuple[str, ...]) -> Iterator[int]:
    """The first joints below one that are far enough from it."""
    for child, other in enumerate(bvh.joints):
        if other.parent != joint or any(name in other.name.lower() for name in without):
            continue
        if is_far[child]:
            yield child
        else:
            yield from _joints_beyond(bvh, child, is_far, without)


def _trunk_turns(
    position: NDArray[np.float64],
    rotation: NDArray[np.float64],
    crown: NDArray[np.float64],
    place: dict[str, int],
) -> list[NDArray[np.float64]]:
    """(n, 3, 3) of pelvis, thorax and head: left along hips and shoulders, up along the spine and to the crown.

    The pelvis is upright, as the spine is, in those who stand upright; the head faces where the shoulders do on
    average.
    """

    def at(role: str) -> NDArray[np.float64]:
        return position[:, place[role]]

    hips, ankles = (0.5 * (at(f"l_{role}") + at(f"r_{role}")) for role in ("hip", "ankle"))
    neck = at("neck") - hips
    stands = (_unit(neck)[:, 2] > np.cos(UPRIGHT)) & (_unit(hips - ankles)[:, 2] > np.cos(UPRIGHT))
    shown = stands if stands.any() else np.ones_like(stands)
    spine = _first_long(at("thorax") - hips, neck)
    pelvis = _turned(rotation[:, place["hips"]], at("l_hip") - at("r_hip"), spine, shown)
    across, ribs = at("l_shoulder") - at("r_shoulder"), _first_long(at("neck") - at("thorax"), neck)
    thorax = _turned(rotation[:, place["thorax"]], across, ribs)
    up = _first_long(crown, at("head") - at("thorax"))
    return [pelvis, thorax, _turned(rotation[:, place["head"]], thorax[:, :, 1], up)]


def _first_long(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(np.linalg.norm(first, axis=1, keepdims=True) > SHORTEST, first, second)


def _turned(
    rotation: NDArray[np.float64],
    left: NDArray[np.float64],
    up: NDArray[np.float64],
    shows_up: NDArray[np.bool_] | slice = slice(None),
) -> NDArray[np.float64]:
    """(n, 3, 3) turns of a part: forward, left and up are fixed to its joint where they are on average."""
    own_left = _unit(np.einsum("nba,nb->na", rotation, _unit(left)).mean(axis=0))
    own_up = _unit(np.einsum("nba,nb->na", rotation[shows_up], _unit(up)[shows_up]).mean(axis=0))
    own_up = _unit(own_up - (own_up @ own_left) * own_left)
    return rotation @ np.stack([np.cross(own_left, own_up), own_left, own_up], axis=1)


def _turned_foot(
    rotation: NDArray[np.float64],
    forward: NDArray[np.float64],
    height: NDArray[np.float64],
    pelvis_forward: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(n, 3, 3) turns of a foot, whose sole is level on average where its ankle is low.

    A foot whose toes are straight below the ankle points where the pelvis does on average.
    """
    is_planted = height < np.percentile(height, 10.0) + PLANTED
    own_up = _unit(rotation[is_planted][:, 2].mean(axis=0))
    ways = (np.einsum("nba,nb->na", rotation, way).mean(axis=0) for way in (forward, pelvis_forward))
    level = [way - (way @ own_up) * own_up for way in ways]
    own_forward = _unit(level[0] if np.linalg.norm(level[0]) > SHORTEST else level[1])
    return rotation @ np.stack([own_forward, np.cross(own_up, own_forward), own_up], axis=1)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    if not (length > 1e-6).all():
        raise MocapError("has joints that coincide, so that limbs or the trunk have no direction")
    return vectors / length
