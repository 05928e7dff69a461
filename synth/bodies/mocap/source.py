"""A recorded motion as the body sees it: joints in metres with z up, directions of limbs, turns of the trunk."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.bvh import Bvh, MocapError, place_joints, rest_values
from synth.bodies.mocap.roles import Convention, joints_of

LEG_LENGTH = 0.835
"""Hip to ankle of an adult of 1.70 m, by which units are found out [m]."""
UNITS: dict[str, float] = {"m": 1.0, "5.64 cm": 0.0254 / 0.45, "inch": 0.0254, "cm": 0.01, "mm": 0.001}
"""Usual units of BVH files [m]; 5.64 cm is the CMU database's own (an inch over 0.45)."""
UNIT_SLACK = 0.25
"""A leg in a usual unit may be off `LEG_LENGTH` by this share; else the unit is what gives that length."""
ARM_SLACK = np.radians(25.0)
"""Arms of a T-pose are this level."""
LEG_SLACK = np.radians(12.0)
"""Legs of a T-pose are this upright."""
ASKEW = np.radians(15.0)
"""Someone whose hips are turned less than this from an axis of the file faces along an axis."""
SIDES = "lr"
"""Order of the sides in arrays of limbs."""


@dataclass(frozen=True)
class Source:
    """A motion in metres and z up. Directions are unit vectors, turns are from the rest pose.

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
        palm: (n, 2, 3) out of the palm; palms face down at rest.
        toes: (n, 2, 3) along the sole, level at rest.
        sole: (n, 2, 3) up through the sole.
        is_t_pose: (n,) whether a frame is a T-pose and no pose of the motion.
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

    def at(self, role: str) -> NDArray[np.float64]:
        """(n, 3) where a joint is [m]."""
        return self.position[:, self.joints[role]]


def read_source(bvh: Bvh, custom: Convention | None = None) -> Source:
    """Turns a file into a motion.

    The rest pose is the first frame if that is a T-pose, else the file's own (no joint turned).

    Args:
        bvh: The file.
        custom: Naming of the joints; by default a known one that fits.

    Raises:
        MocapError: Joints are missing, two coincide, or neither rest pose is a T-pose.
    """
    convention, joints = joints_of(bvh, custom)
    columns = list(joints.values())
    values = np.concatenate([bvh.values, rest_values(bvh)])
    position, rotation = (array[:, columns] for array in place_joints(bvh, values))
    place = {role: k for k, role in enumerate(joints)}
    unit = _unit(position[-1], place)
    for rest in (0, -1):
        axes = _axes(position[rest], place)
        turned = position @ axes.T
        is_t_pose = _is_t_pose(turned, place)
        if is_t_pose[rest]:
            rotation = axes @ rotation @ axes.T
            return _measured(convention, place, unit, turned * unit, rotation, rest, is_t_pose)
    raise MocapError("has no T-pose: neither its first frame nor its rest pose has level arms and straight legs")


def _measured(
    convention: Convention,
    place: dict[str, int],
    unit: float,
    position: NDArray[np.float64],
    rotation: NDArray[np.float64],
    rest: int,
    is_t_pose: NDArray[np.bool_],
) -> Source:
    """Limbs point where their joints' turns since the T-pose take them.

    In a T-pose elbows and knees are straight and the limbs lie in the frontal plane, whatever the offsets say:
    skeletons are drawn with bent elbows while their turns mean straight ones.
    """

    def turn(role: str) -> NDArray[np.float64]:
        return (rotation[:, place[role]] @ rotation[rest, place[role]].T)[:-1]

    def straight(start: str, end: str) -> NDArray[np.float64]:
        return _unit_vector((position[rest, place[end]] - position[rest, place[start]]) * (0.0, 1.0, 1.0))

    thorax = turn("thorax")
    limb, clavicle, clavicle_rest, fingers, palm, toes, sole = [], [], [], [], [], [], []
    for s, sign in (("l", 1.0), ("r", -1.0)):
        arm, leg = straight(f"{s}_shoulder", f"{s}_wrist"), straight(f"{s}_hip", f"{s}_ankle")
        if convention.arms_at_rest is not None:
            arm = np.array([0.0, sign * np.cos(convention.arms_at_rest), np.sin(convention.arms_at_rest)])
        roles = (("shoulder", arm), ("elbow", arm), ("hip", leg), ("knee", leg))
        limb.append(np.stack([turn(f"{s}_{role}") @ at_rest for role, at_rest in roles], axis=1))
        way = position[:, place[f"{s}_shoulder"]] - position[:, place[f"{s}_clavicle"]]
        clavicle.append(np.einsum("nba,nb->na", thorax, way[:-1]))
        clavicle_rest.append(way[rest])
        fingers.append(turn(f"{s}_wrist") @ arm)
        palm.append(turn(f"{s}_wrist") @ np.array([0.0, sign * arm[2], -sign * arm[1]]))
        forward = (position[rest, place[f"{s}_toe"]] - position[rest, place[f"{s}_ankle"]]) * (1.0, 1.0, 0.0)
        toes.append(turn(f"{s}_ankle") @ _unit_vector(forward))
        sole.append(turn(f"{s}_ankle") @ np.array([0.0, 0.0, 1.0]))
    return Source(
        unit=unit,
        joints=place,
        position=position[:-1],
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
        is_t_pose=is_t_pose[:-1],
    )


def _axes(rest: NDArray[np.float64], place: dict[str, int]) -> NDArray[np.float64]:
    """(3, 3) rows: the person's forward, left and up at rest, in the file's axes.

    Up is an axis of the file; so is left, unless the person stands askew.
    """
    hips = 0.5 * (rest[place["l_hip"]] + rest[place["r_hip"]])
    spine = rest[place["head"]] - hips
    up = np.zeros(3)
    longest = int(np.argmax(np.abs(spine)))
    up[longest] = np.sign(spine[longest])
    across = rest[place["l_hip"]] - rest[place["r_hip"]]
    across[longest] = 0.0
    if not up.any() or not across.any():
        raise MocapError("has a rest pose whose hips and head coincide")
    left = across / np.linalg.norm(across)
    if np.abs(left).max() > np.cos(ASKEW):
        left = np.sign(left) * (np.abs(left) == np.abs(left).max())
    return np.stack([np.cross(left, up), left, up])


def _unit(rest: NDArray[np.float64], place: dict[str, int]) -> float:
    """Size of the file's unit [m], from the length of the legs."""
    leg = 0.0
    for start, end in (("hip", "knee"), ("knee", "ankle")):
        leg += float(
            np.mean([np.linalg.norm(rest[place[f"{s}_{end}"]] - rest[place[f"{s}_{start}"]]) for s in SIDES])
        )
    if leg <= 0.0:
        raise MocapError("has legs without length")
    wanted = LEG_LENGTH / leg
    nearest = min(UNITS.values(), key=lambda unit: abs(np.log(unit / wanted)))
    return nearest if abs(nearest / wanted - 1.0) < UNIT_SLACK else wanted


def _is_t_pose(position: NDArray[np.float64], place: dict[str, int]) -> NDArray[np.bool_]:
    """(n,) whether arms are level and to the sides, legs straight down, in any heading."""
    across = position[:, place["l_hip"]] - position[:, place["r_hip"]]
    across[:, 2] = 0.0
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-12)[:, None]
    out = np.ones(len(position), dtype=np.bool_)
    for side, sign in (("l", 1.0), ("r", -1.0)):
        arm = position[:, place[f"{side}_wrist"]] - position[:, place[f"{side}_shoulder"]]
        leg = position[:, place[f"{side}_ankle"]] - position[:, place[f"{side}_hip"]]
        out &= sign * (arm * across).sum(axis=1) > np.cos(ARM_SLACK) * np.linalg.norm(arm, axis=1)
        out &= -leg[:, 2] > np.cos(LEG_SLACK) * np.linalg.norm(leg, axis=1)
    return out


def _unit_vector(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    norm = float(np.linalg.norm(vector))
    if norm < 1e-6:
        raise MocapError("has limbs or feet without length in the T-pose")
    return vector / norm
