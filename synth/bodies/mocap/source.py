"""A captured motion as the body sees it: joints in metres with z up, directions of limbs, turns of the trunk."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.bvh import Bvh, MocapError, place_joints, rest_values
from synth.bodies.mocap.positions import Directions, directions_of, ways_of
from synth.bodies.mocap.rest import Rest, find_rest, find_world, is_t_pose, straight_trunk, unit_of
from synth.bodies.mocap.roles import Convention, joints_of


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
        has_rest: Whether limbs are turns since a T-pose; else they are lines between joints.
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
    """Turns a file into a motion.

    The rest pose is the first frame if that is a T-pose, else the file's own (no joint turned). If that is none
    either, limbs point from joint to joint.

    Args:
        bvh: The file.
        custom: Naming of the joints; by default a known one that fits.

    Raises:
        MocapError: Joints are missing or coincide, or there is no T-pose and nobody upright.
    """
    convention, joints = joints_of(bvh, custom)
    position, rotation = place_joints(bvh, np.concatenate([bvh.values, rest_values(bvh)]))
    columns = list(joints.values())
    place = {role: k for k, role in enumerate(joints)}
    rest = find_rest(position[:, columns], place)
    if rest is None:
        return _from_positions(bvh, joints, position, rotation)
    return _from_turns(convention, place, rest, position[:, columns], rotation[:, columns])


def read_source_from_positions(bvh: Bvh, custom: Convention | None = None) -> Source:
    """Likewise, but as if the file had no T-pose.

    Args:
        bvh: The file.
        custom: Naming of the joints; by default a known one that fits.

    Raises:
        MocapError: Joints are missing or coincide, or nobody is upright.
    """
    _, joints = joints_of(bvh, custom)
    return _from_positions(bvh, joints, *place_joints(bvh, np.concatenate([bvh.values, rest_values(bvh)])))


def _from_positions(
    bvh: Bvh, joints: dict[str, int], position: NDArray[np.float64], rotation: NDArray[np.float64]
) -> Source:
    """Motion without a T-pose; the last row of positions and rotations is the pose without turns."""
    columns = list(joints.values())
    place = {role: k for k, role in enumerate(joints)}
    drawn = straight_trunk(position[-1, columns], place)
    position, rotation = position[:-1], rotation[:-1]
    world = find_world(position[:, columns], place)
    unit = unit_of(position[0, columns], place)
    position, rotation = position @ world.T * unit, world @ rotation[:, columns]
    ways = ways_of(bvh, joints, position)
    position = position[:, columns]
    directions = directions_of(position, rotation, ways, drawn, place)
    return Source(unit, place, position, *directions, is_t_pose(position, place), has_rest=False)


def _from_turns(
    convention: Convention,
    place: dict[str, int],
    rest: Rest,
    position: NDArray[np.float64],
    rotation: NDArray[np.float64],
) -> Source:
    """Motion since a T-pose; the last row of positions and rotations is the pose without turns."""
    unit = unit_of(position[-1], place)
    turned, rotation = position @ rest.axes.T, rest.axes @ rotation @ rest.axes.T
    turn = np.stack([rotation[:, k] @ rotation[rest.row, k].T for k in place.values()], axis=1)[:-1]
    placed = turned
    if rest.world is not rest.axes:
        turn, placed = rest.world @ rest.axes.T @ turn, position @ rest.world.T
    directions = _measured(convention, place, turned[rest.row] * unit, (placed * unit)[:-1], turn)
    return Source(unit, place, (placed * unit)[:-1], *directions, is_t_pose(placed, place)[:-1], has_rest=True)


def _measured(
    convention: Convention,
    place: dict[str, int],
    rest: NDArray[np.float64],
    position: NDArray[np.float64],
    turns: NDArray[np.float64],
) -> Directions:
    """Limbs point where their joints' turns since the T-pose take them.

    In a T-pose elbows and knees are straight and the limbs lie in the frontal plane, whatever the offsets say:
    skeletons are drawn with bent elbows while their turns mean straight ones.
    """

    def turn(role: str) -> NDArray[np.float64]:
        return np.ascontiguousarray(turns[:, place[role]])

    def straight(start: str, end: str) -> NDArray[np.float64]:
        return _unit_vector((rest[place[end]] - rest[place[start]]) * (0.0, 1.0, 1.0))

    thorax = turn("thorax")
    limb, clavicle, clavicle_rest, fingers, palm, toes, sole = [], [], [], [], [], [], []
    for s, sign in (("l", 1.0), ("r", -1.0)):
        arm, leg = straight(f"{s}_shoulder", f"{s}_wrist"), straight(f"{s}_hip", f"{s}_ankle")
        if convention.arms_at_rest is not None:
            arm = np.array([0.0, sign * np.cos(convention.arms_at_rest), np.sin(convention.arms_at_rest)])
        roles = (("shoulder", arm), ("elbow", arm), ("hip", leg), ("knee", leg))
        limb.append(np.stack([turn(f"{s}_{role}") @ at_rest for role, at_rest in roles], axis=1))
        inner, outer = place[f"{s}_clavicle"], place[f"{s}_shoulder"]
        clavicle.append(np.einsum("nba,nb->na", thorax, position[:, outer] - position[:, inner]))
        clavicle_rest.append(rest[outer] - rest[inner])
        fingers.append(turn(f"{s}_wrist") @ arm)
        palm.append(turn(f"{s}_wrist") @ np.array([0.0, sign * arm[2], -sign * arm[1]]))
        forward = (rest[place[f"{s}_toe"]] - rest[place[f"{s}_ankle"]]) * (1.0, 1.0, 0.0)
        toes.append(turn(f"{s}_ankle") @ _unit_vector(forward))
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


def _unit_vector(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    norm = float(np.linalg.norm(vector))
    if norm < 1e-6:
        raise MocapError("has limbs or feet of length 0 in the T-pose")
    return vector / norm
