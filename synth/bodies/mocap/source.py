"""A captured motion as the body sees it: joints in metres with z up, directions of limbs, turns of the trunk."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.bvh import Bvh, place_joints, rest_values
from synth.bodies.mocap.positions import Directions, directions_of, limb_ways, ways_of
from synth.bodies.mocap.rest import Rest, bends_of, find_rest, find_world, is_t_pose, straight_trunk, unit_of
from synth.bodies.mocap.roles import Convention, joints_in_front, joints_of
from synth.bodies.mocap.text import MocapError

SHORTEST_FOOT = 0.02
"""Toes less than this before the ankle do not tell where a foot points [m]."""
DRAWN_SLACK = np.radians(4.0)
"""Elbows drawn as a naming's files draw them bend within this of its `drawn_elbows`."""


@dataclass(frozen=True)
class Source:
    """A motion in metres and z up. Directions are unit vectors, turns are from a T-pose or what stands in for it.

    Attributes:
        unit: Size of the file's unit [m].
        joints: Column in `position` by role.
        position: (n, n_roles, 3) world [m].
        pelvis: (n, 3, 3) T_world_pelvis's rotation; at rest the identity: x forward, y left, z up.
        thorax: (n, 3, 3) likewise.
        head: (n, 3, 3) likewise.
        limb: (n, 2, 4, 3) by side, world: upper arm, forearm, thigh, shank, from the trunk outwards.
        clavicle: (n, 2, 3) inner end to shoulder, thorax frame [m].
        clavicle_rest: (2, 3) likewise at rest.
        fingers: (n, 2, 3) from the wrist.
        palm: (n, 2, 3) out of the palm; palms face down at rest. 0 if it is not known.
        toes: (n, 2, 3) along the sole, level at rest.
        sole: (n, 2, 3) up through the sole.
        is_t_pose: (n,) whether a frame is a T-pose and no pose of the motion.
        has_rest: Whether trunk, head, hands and feet are counted from a T-pose; else they follow from positions.
    """

    unit: float
    joints: dict[str, int]
    position: NDArray[np.float64]
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
    is_t_pose: NDArray[np.bool_]
    has_rest: bool

    def at(self, role: str) -> NDArray[np.float64]:
        """(n, 3) where a joint is [m]."""
        return self.position[:, self.joints[role]]


def read_source(bvh: Bvh, custom: Convention | None = None) -> Source:
    """Turns a file into a motion. Limbs point from joint to joint.

    What trunk, head, hands and feet do is counted from a T-pose: the first frame if it is one, unless only the pose
    without turns (no joint turned) is an exact one; else the pose without turns if it nearly is one. If neither is, it
    follows from the positions of joints.

    Args:
        bvh: The file.
        custom: Naming of the joints; by default a known one that fits.

    Raises:
        MocapError: Joints are missing or coincide, or there is no T-pose and nobody upright.
    """
    moved = _moved(bvh, custom)
    drawn = np.zeros((2, 2)) if moved.drawn is None else moved.drawn
    rest = find_rest(moved.position[:, list(moved.joints.values())], moved.place, drawn)
    return _from_positions(bvh, moved) if rest is None else _from_turns(moved, rest)


def read_source_from_positions(bvh: Bvh, custom: Convention | None = None) -> Source:
    """Likewise, but as if the file had no T-pose.

    Args:
        bvh: The file.
        custom: Naming of the joints; by default a known one that fits.

    Raises:
        MocapError: Joints are missing or coincide, or nobody is upright.
    """
    return _from_positions(bvh, _moved(bvh, custom))


class _Moved(NamedTuple):
    """A file's joints as they move.

    Attributes:
        joints: Index of the joint of each role.
        place: Column of each role among those.
        position: (n + 1, n_joints, 3) in the file's axes; the last row is the pose without turns.
        rotation: (n + 1, n_joints, 3, 3) likewise.
        arms_at_rest: Elevation of arms that are drawn bent but turn as if they were straight [rad].
        drawn: (2, 2) by side, bends of elbow and knee that mean straight limbs [rad]; None if limbs are as drawn.
    """

    joints: dict[str, int]
    place: dict[str, int]
    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    arms_at_rest: float
    drawn: NDArray[np.float64] | None


def _moved(bvh: Bvh, custom: Convention | None) -> _Moved:
    convention, joints = joints_of(bvh, custom)
    position, rotation = place_joints(bvh, np.concatenate([bvh.values, rest_values(bvh)]))
    joints = joints_in_front(bvh, joints, position[:-1])
    place = {role: k for k, role in enumerate(joints)}
    drawn = bends_of(position[-1:, list(joints.values())], place)[0]
    elbows = convention.drawn_elbows
    is_drawn_so = elbows is not None and bool((np.abs(drawn[:, 0] - elbows) < DRAWN_SLACK).all())
    return _Moved(
        joints, place, position, rotation, convention.arms_at_rest or 0.0, drawn if is_drawn_so else None
    )


def _from_positions(bvh: Bvh, moved: _Moved) -> Source:
    """Motion without a T-pose."""
    columns, place = list(moved.joints.values()), moved.place
    drawn = straight_trunk(moved.position[-1, columns], place)
    position, rotation = moved.position[:-1], moved.rotation[:-1]
    world = find_world(position[:, columns], place)
    unit = unit_of(position[0, columns], place)
    position, rotation = position @ world.T * unit, world @ rotation[:, columns]
    ways = ways_of(bvh, moved.joints, position)
    position = position[:, columns]
    directions = directions_of(position, rotation, ways, drawn, place)
    is_rest = is_t_pose(position, place, np.zeros((2, 2)) if moved.drawn is None else moved.drawn)
    return Source(unit, place, position, *directions, is_rest, has_rest=False)


def _from_turns(moved: _Moved, rest: Rest) -> Source:
    """Motion since a T-pose."""
    columns, place = list(moved.joints.values()), moved.place
    position, rotation = moved.position[:, columns], moved.rotation[:, columns]
    unit = unit_of(position[-1], place)
    turned, rotation = position @ rest.axes.T, rest.axes @ rotation @ rest.axes.T
    turn = np.stack([rotation[:, k] @ rotation[rest.row, k].T for k in place.values()], axis=1)[:-1]
    placed = turned
    if rest.world is not rest.axes:
        turn, placed = rest.world @ rest.axes.T @ turn, position @ rest.world.T
    directions = _measured(moved, turned[rest.row] * unit, (placed * unit)[:-1], turn)
    is_rest = is_t_pose(placed, place, np.zeros((2, 2)) if moved.drawn is None else moved.drawn)[:-1]
    return Source(unit, place, (placed * unit)[:-1], *directions, is_rest, has_rest=True)


def _measured(
    moved: _Moved, rest: NDArray[np.float64], position: NDArray[np.float64], turns: NDArray[np.float64]
) -> Directions:
    """Trunk, head, hands and feet point where their joints' turns since the T-pose take them.

    So do limbs that are drawn bent while their turns mean straight ones; others point from joint to joint.
    """
    place = moved.place

    def turn(role: str) -> NDArray[np.float64]:
        return np.ascontiguousarray(turns[:, place[role]])

    thorax = turn("thorax")
    limb, clavicle, clavicle_rest, fingers, palm, toes, sole = [], [], [], [], [], [], []
    for s, sign in (("l", 1.0), ("r", -1.0)):
        if moved.drawn is None:
            arm = _unit_vector(rest[place[f"{s}_wrist"]] - rest[place[f"{s}_elbow"]])
            limb.append(limb_ways(position, place, s))
        else:
            arm = np.array([0.0, sign * np.cos(moved.arms_at_rest), np.sin(moved.arms_at_rest)])
            leg = _unit_vector((rest[place[f"{s}_ankle"]] - rest[place[f"{s}_hip"]]) * (0.0, 1.0, 1.0))
            roles = (("shoulder", arm), ("elbow", arm), ("hip", leg), ("knee", leg))
            limb.append(np.stack([turn(f"{s}_{role}") @ at_rest for role, at_rest in roles], axis=1))
        inner, outer = place[f"{s}_clavicle"], place[f"{s}_shoulder"]
        clavicle.append(np.einsum("nba,nb->na", thorax, position[:, outer] - position[:, inner]))
        clavicle_rest.append(rest[outer] - rest[inner])
        fingers.append(turn(f"{s}_wrist") @ arm)
        palm.append(turn(f"{s}_wrist") @ _unit_vector(arm[2] * arm - np.array([0.0, 0.0, 1.0])))
        toes.append(turn(f"{s}_ankle") @ _forward(rest[place[f"{s}_toe"]] - rest[place[f"{s}_ankle"]]))
        sole.append(turn(f"{s}_ankle") @ np.array([0.0, 0.0, 1.0]))
    return Directions(
        pelvis=turn("hips"),
        thorax=thorax,
        head=turn("head"),
        limb=np.stack(limb, axis=1),
        clavicle=np.stack(clavicle, axis=1),
        clavicle_rest=np.stack(clavicle_rest),
        fingers=np.stack(fingers, axis=1),
        palm=np.stack(palm, axis=1),
        toes=np.stack(toes, axis=1),
        sole=np.stack(sole, axis=1),
    )


def _forward(way: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) level direction of a foot at rest, straight ahead if its toes are straight below the ankle."""
    level = way * (1.0, 1.0, 0.0)
    if np.linalg.norm(level) < SHORTEST_FOOT:
        return np.array([1.0, 0.0, 0.0])
    return _unit_vector(level)


def _unit_vector(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    norm = float(np.linalg.norm(vector))
    if norm < 1e-6:
        raise MocapError("has limbs of length 0 in the T-pose")
    return vector / norm
