"""A recorded motion as the body sees it: joints in metres with z up, directions of limbs, turns of the trunk."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.bvh import Bvh, MocapError, place_joints
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
        limb: (n, 2, 4, 3) by side: upper arm, forearm, thigh, shank, from the trunk outwards.
        clavicle: (n, 2, 3) inner end to shoulder, thorax frame.
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

    The rest pose is the first frame if that is a T-pose, else the file's own (all channels zero).

    Args:
        bvh: The file.
        custom: Naming of the joints; by default a known one that fits.

    Raises:
        MocapError: Joints are missing, two coincide, or neither rest pose is a T-pose.
    """
    joints = joints_of(bvh, custom)
    columns = list(joints.values())
    zero = np.zeros((1, bvh.values.shape[1]))
    position, rotation = (array[:, columns] for array in place_joints(bvh, np.concatenate([bvh.values, zero])))
    place = {role: k for k, role in enumerate(joints)}
    axes = _axes(position[-1], place)
    position = position @ axes.T
    rotation = axes @ rotation @ axes.T
    unit = _unit(position[-1], place)
    is_t_pose = _is_t_pose(position, place)
    if not is_t_pose[0] and not is_t_pose[-1]:
        raise MocapError(
            "has no T-pose: neither its first frame nor its rest pose has level arms and straight legs"
        )
    rest = 0 if is_t_pose[0] else -1
    return _measured(place, unit, position * unit, rotation, rest, is_t_pose)


def _measured(
    place: dict[str, int],
    unit: float,
    position: NDArray[np.float64],
    rotation: NDArray[np.float64],
    rest: int,
    is_t_pose: NDArray[np.bool_],
) -> Source:
    def turn(role: str) -> NDArray[np.float64]:
        return rotation[:, place[role]] @ rotation[rest, place[role]].T

    def carried(role: str, at_rest: NDArray[np.float64]) -> NDArray[np.float64]:
        return turn(role) @ at_rest

    def both(direction: list[NDArray[np.float64]]) -> NDArray[np.float64]:
        return np.stack(direction, axis=1)[:-1]

    def way(start: str, end: str) -> NDArray[np.float64]:
        return _unit_vectors(position[:, place[end]] - position[:, place[start]], f"{start} and {end}")

    bones = (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
    limb = [np.stack([way(f"{s}_{a}", f"{s}_{b}") for a, b in bones], axis=1) for s in SIDES]
    forward = [_level(way(f"{s}_ankle", f"{s}_toe")[rest]) for s in SIDES]
    thorax = turn("thorax")
    clavicle = [np.einsum("nba,nb->na", thorax, way(f"{s}_clavicle", f"{s}_shoulder")) for s in SIDES]
    fingers = [
        way(f"{s}_wrist", f"{s}_fingers")
        if f"{s}_fingers" in place
        else carried(f"{s}_wrist", way(f"{s}_elbow", f"{s}_wrist")[rest])
        for s in SIDES
    ]
    up = np.array([0.0, 0.0, 1.0])
    return Source(
        unit=unit,
        joints=place,
        position=position[:-1],
        pelvis=turn("hips")[:-1],
        thorax=thorax[:-1],
        head=turn("head")[:-1],
        limb=both(limb),
        clavicle=both(clavicle),
        clavicle_rest=np.stack([c[rest] for c in clavicle]),
        fingers=both(fingers),
        palm=both([carried(f"{s}_wrist", -up) for s in SIDES]),
        toes=both([carried(f"{s}_ankle", f) for s, f in zip(SIDES, forward, strict=True)]),
        sole=both([carried(f"{s}_ankle", up) for s in SIDES]),
        is_t_pose=is_t_pose[:-1],
    )


def _axes(rest: NDArray[np.float64], place: dict[str, int]) -> NDArray[np.float64]:
    """(3, 3) rows: the person's forward, left and up at rest, in the file's axes."""
    hips = 0.5 * (rest[place["l_hip"]] + rest[place["r_hip"]])
    spine = rest[place["head"]] - hips
    up = np.zeros(3)
    longest = int(np.argmax(np.abs(spine)))
    up[longest] = np.sign(spine[longest])
    across = rest[place["l_hip"]] - rest[place["r_hip"]]
    across[longest] = 0.0
    left = np.zeros(3)
    widest = int(np.argmax(np.abs(across)))
    left[widest] = np.sign(across[widest])
    if not up.any() or not left.any():
        raise MocapError("has a rest pose whose hips and head coincide")
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


def _level(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    flat = direction * (1.0, 1.0, 0.0)
    norm = float(np.linalg.norm(flat))
    if norm < 0.2:
        raise MocapError("has feet that point straight up or down in the T-pose")
    return flat / norm


def _unit_vectors(vectors: NDArray[np.float64], between: str) -> NDArray[np.float64]:
    norms = np.linalg.norm(vectors, axis=1, keepdims=True)
    if norms.min() < 1e-9:
        raise MocapError(f"has {between} at one place")
    return vectors / norms
